"""The minds of teams: what they see they turn into wheel speeds, once a frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import polars as pl

from pipeline.arena.match.recipe import Recipe, TeamSettings
from pipeline.arena.teams import learned, teams
from pipeline.arena.teams.dice import new_dice
from pipeline.arena.teams.measures import Measures
from pipeline.arena.teams.playbook import Playbook, open_playbook
from pipeline.arena.teams.teams import Team
from pipeline.bodies import F64
from pipeline.errors import BadSettings
from pipeline.matches.frame import AWAY, HOME
from pipeline.pitch import Pitch
from pipeline.state import Breaks, radix
from schemas import Policies

#: The kinds of team that play by fixed rules.
SCRIPTED = {"random": Team.RANDOM, "static": Team.STATIC, "human-like": Team.HUMAN_LIKE}


class Mind(Protocol):
    """Who plays a team; all it sees is turned so that its own goal is at -x.

    A mind that says no more than how it thinks keeps no account of play, and has decided nothing that
    anything could be learned from.
    """

    def restarted(self, frame: int, lead: int) -> None:
        """Play is on from this frame; ``lead`` is own goals minus the other's."""
        return

    def think(self, frame: int, view: F64, wheels: F64) -> None:
        """A frame of play.

        Args:
            frame: its number.
            view: float64 [1 + 2 N, 6], see :func:`pipeline.bodies.see`.
            wheels: float64 [N, 2], written: left and right wheel, m/s.
        """

    def stopped(self, frame: int, reward: float) -> None:
        """Play has stopped at this frame: by a goal for (+1) or against (-1), or for another reason (0)."""
        return

    def decided(self) -> list[Decided]:
        """What was decided in the episodes that have ended since this was last asked, in order."""
        return []


class Decided(NamedTuple):
    """A decision of a robot in an episode that is over.

    Attributes:
        frame: at which it was made.
        robot: number.
        role: index in ROLES, when it decided.
        state: by all elements.
        behaviour_id: chosen; None for moves randomly.
        random: whether it was chosen at random.
        episode: stretch of play, counted from 0.
        end: frame of the robot's next decision in the episode, or at which the episode ended.
        last: whether the episode ended then.
        reward: +1 or -1 if it is the last and a goal ended the episode, else 0.
    """

    frame: int
    robot: int
    role: int
    state: int
    behaviour_id: str | None
    random: bool
    episode: int
    end: int
    last: bool
    reward: float


class Scripted(Mind):
    """A team of fixed rules."""

    def __init__(
        self, settings: TeamSettings, robots: int, measures: Measures, rng: np.random.Generator
    ) -> None:
        team = SCRIPTED[settings.kind]
        self._team = int(team)  # numba needs long to make a number of an enum
        self._measures = measures.packed()
        self._memory = teams.new_memory(team, robots, measures, rng, settings.people)
        self._dice = new_dice(rng)

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        teams.play_packed(self._team, view, self._memory, self._measures, self._dice, wheels)


class Learned(Mind):
    """A team that plays a policy.

    Args:
        book: the policy.
        names: of its behaviours, see :func:`pipeline.arena.teams.playbook.open_playbook`.
        settings: how it explores.
        robots: N.
        pitch: of the match.
        measures: of the pitch.
        rng: decides what is left to chance.
    """

    def __init__(
        self, book: Playbook, names: Sequence[str | None], settings: TeamSettings, robots: int, pitch: Pitch,
        measures: Measures, rng: np.random.Generator,
    ) -> None:
        self._policy, self._book = book, book._replace(values=book.values.copy())
        self._names, self._settings = names, settings
        self._measures, self._breaks = measures.packed(), Breaks.of(pitch)
        self._digits, self._levels = radix("full36")
        self._memory = learned.new_memory(robots)
        self._dice = new_dice(rng)
        self._made = np.zeros((robots, learned.COLUMNS), dtype=np.int64)
        self._due = True
        self._lead = self._episode = 0
        self._rows: list[tuple[int, ...]] = []
        self._over: list[Decided] = []

    def restarted(self, frame: int, lead: int) -> None:  # noqa: D102
        learned.forget(self._memory)
        known, own = self._policy, self._settings
        learned.believe(known.values, known.doubts, own.doubt, own.caution, self._dice, self._book.values)
        self._due, self._lead = True, lead

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        learned.watch_ball(view, self._memory, self._breaks.moving)
        if self._due:
            made = learned.decide(
                view, self._lead, self._memory, self._book, self._digits, self._levels,
                self._settings.explore, self._breaks, self._measures, self._dice, self._made,
            )
            for row in self._made[:made].tolist():
                self._rows.append((frame, *row))
        self._due = learned.carry_on(
            view, self._memory, self._book.codes, self._measures, self._dice, wheels
        )

    def stopped(self, frame: int, reward: float) -> None:  # noqa: D102
        following: dict[int, int] = {}
        closed = []
        for at, robot, role, state, chosen, random, _ in reversed(self._rows):
            last = robot not in following
            closed.append(Decided(
                at, robot, role, state, self._names[chosen], bool(random), self._episode,
                following.get(robot, frame), last, reward if last else 0.0,
            ))
            following[robot] = at
        self._over += reversed(closed)
        self._rows.clear()
        self._episode += 1

    def decided(self) -> list[Decided]:  # noqa: D102
        over, self._over = self._over, []
        return over


def mind_of(
    settings: TeamSettings, recipe: Recipe, team: int, policy: pl.DataFrame | None = None
) -> Mind:
    """The mind of a team that plays by itself.

    Args:
        settings: of the team.
        recipe: of the match.
        team: 0 home, 1 away; its chances do not depend on the other's.
        policy: rows of schema Policies for a learned team; None if it knows nothing.

    Raises:
        BadSettings: if a person has to play it.
    """
    measures = measures_of(recipe)
    rng = np.random.default_rng([recipe.seed, 1 + team])
    if settings.kind == "learned":
        book, names = open_playbook(Policies.empty() if policy is None else policy, settings.trust)
        return Learned(book, names, settings, recipe.robots, recipe.pitch, measures, rng)
    if settings.kind == "human":
        raise BadSettings("a person plays at the window", where="human", next_step="Use `pitchlore play`")
    return Scripted(settings, recipe.robots, measures, rng)


def minds_of(
    recipe: Recipe, policies: Mapping[str, pl.DataFrame], person: Mind | None = None
) -> tuple[Mind, Mind]:
    """The minds of both teams, home and away.

    Args:
        recipe: of the match.
        policies: rows of schema Policies by the label that the recipe's teams name.
        person: plays the team that is of kind human.

    Raises:
        BadSettings: if a team needs a person and there is none.
    """
    home, away = (
        person if settings.kind == "human" and person is not None
        else mind_of(settings, recipe, team, policies[settings.policy] if settings.policy else None)
        for team, settings in ((HOME, recipe.home), (AWAY, recipe.away))
    )
    return home, away


def measures_of(recipe: Recipe) -> Measures:
    """What players reckon with in a match."""
    physics = recipe.physics
    return Measures.of(
        recipe.pitch, top=physics.wheel_speed, axle=physics.axle, acceleration=physics.wheel_acceleration,
        frame_s=1 / physics.hz,
    )
