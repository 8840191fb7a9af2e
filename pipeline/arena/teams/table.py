"""The teams that can play, one entry each. Every list of teams, help text and plot is made from them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy.typing as npt
from numpy.random import Generator

from pitchlore.pipeline.arena.teams import counter, human_like, moving_randomly, pressing, static
from pitchlore.pipeline.arena.teams.people import People
from pitchlore.pipeline.game.tactics.measures import Measures

#: The arrays that a team remembers a match in; their meaning is the team's business.
TeamMemory = tuple[npt.NDArray[Any], ...]


class Script(NamedTuple):
    """Fixed rules that play a team.

    Attributes:
        new_memory: makes the memory of a team before a match from N, the measures, a generator that
            draws the person of a human-like team, and the settings of that draw.
        play: a frame of play, compiled: ``play(view, packed, splitmix, wheels, *memory)``.

            - view: float64 [1 + 2 N, 6], see :func:`pipeline.game.bodies.see`: own robots in rows 1 to N, the
              own goal at -x. All numbers are finite.
            - packed: ``Measures.packed()``; ``frame_s`` is the time between two calls.
            - splitmix: uint64 [1], the team's own: all that it leaves to chance.
            - wheels: float64 [N, 2], written: left and right wheel of the robots of rows 1 to N, m/s,
              within ± ``top``.
            - memory: as ``new_memory`` made it and the frames before left it.
    """

    new_memory: Callable[[int, Measures, Generator, People], TeamMemory]
    play: Callable[..., None]


class TeamEntry(NamedTuple):
    """A kind of team.

    Attributes:
        name: the word that settings, commands and tables call it by.
        description: one sentence on how it plays.
        colour: colour of its curves in plots, ``#RRGGBB``.
        dashes: line style of these curves, a matplotlib line style.
        script: its rules; None if a policy or a person plays it (``pipeline.arena.match``).
    """

    name: str
    description: str
    colour: str
    dashes: str | tuple[int, tuple[float, ...]] = "solid"
    script: Script | None = None


#: All teams by name. The colours are Okabe and Ito's.
TEAMS = {
    team.name: team
    for team in (
        TeamEntry(
            "static", "One robot keeps the goal, one attacks, the others support, by fixed rules.",
            "#0072B2", script=Script(static.new_memory, static.play),
        ),
        TeamEntry(
            "human-like", "One robot is driven late and unsteadily as by a person, the others are static.",
            "#D55E00", (0, (5, 2)), Script(human_like.new_memory, human_like.play),
        ),
        TeamEntry(
            "pressing", "The nearest robot is always on the ball, a second close behind, one keeps the goal.",
            "#56B4E9", (0, (3, 1, 1, 1)), Script(pressing.new_memory, pressing.play),
        ),
        TeamEntry(
            "counter", "A deep block before the area until the ball is won, then forward passes and shots.",
            "#000000", (0, (6, 1, 1, 1)), Script(counter.new_memory, counter.play),
        ),
        TeamEntry(
            "random", "Every robot moves randomly.",
            "#009E73", (0, (1.2, 1.2)), Script(moving_randomly.new_memory, moving_randomly.play),
        ),
        TeamEntry("learned", "Every robot takes the behaviour that a policy values most in its state.",
                  "#CC79A7"),
        TeamEntry("human", "A person drives one robot at a time, the others are static.", "#E69F00"),
        TeamEntry("remote", "Another program drives the robots, over the network.", "#999999"),
    )
}  # fmt: skip

#: Names of the teams that play by fixed rules.
SCRIPTED = tuple(team.name for team in TEAMS.values() if team.script is not None)

if TYPE_CHECKING:
    TeamKind = str
else:
    #: The name of a team, for settings.
    TeamKind = Literal[tuple(TEAMS)]
