"""The controller of a person, who drives one robot at a time; the others play the static rules."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from pitchlore.pipeline.arena.match.controllers import Controller, ScriptedController, measures_of
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.game.bodies import BALL, X, Y
from pitchlore.pipeline.game.tactics.steering import set_wheels
from pitchlore.pipeline.numbers.arrays import F64

# Share of the top speed at which a person drives without boost, for full speed takes skill; and the
# fastest turn, radians a second: half a circle in 0.6 s. Ours.
_CRUISE = 0.6
_TURN = 5.0


class DriveCommand(NamedTuple):
    """Command of a person to the robot that they drive.

    Attributes:
        forward: part of the speed, in [-1, 1]; backwards below 0.
        turn: part of the turn rate, in [-1, 1]; to the left above 0.
        boost: at full speed; forward if they ask for nothing else, and turning on the spot becomes the
            spin with which these robots, that cannot kick, hit a ball.
    """

    forward: float = 0.0
    turn: float = 0.0
    boost: bool = False


class HumanController(Controller):
    """Plays a team for a person.

    The static rules give a job to every robot, also to the driven one. If the person drives the attacker,
    the other robots keep the goal and support. No decisions are logged; the recogniser finds a person's
    situations like those of any team.

    Args:
        recipe: recipe of the match.
        rng: decides what the team leaves to chance.

    Attributes:
        driven: row of the robot in the team's view, and its number in the log: 1 to N.
        playing: whether play is on.
        reward: at the last stop of play: +1 for an own goal scored, -1 for one conceded, else 0.
    """

    def __init__(self, recipe: Recipe, rng: np.random.Generator) -> None:
        self._others = ScriptedController(TeamSettings(kind="static"), recipe, rng)
        self._robots = recipe.robots
        self._measures = measures_of(recipe)
        self._command = DriveCommand()
        self._to_nearest = True  # whoever is nearest to the ball begins
        self.driven = 1
        self.playing = False
        self.reward = 0.0

    def command(self, command: DriveCommand) -> None:
        """Follow this command from the next frame on, until the next command."""
        self._command = command

    def switch(self, to: Literal["next", "nearest"]) -> None:
        """Drive another robot: the next by its number, or the one that is nearest to the ball.

        The nearest is found when play is on next.
        """
        if to == "next":
            self.driven = self.driven % self._robots + 1
        self._to_nearest = to == "nearest"

    def restarted(self, frame: int, lead: int) -> None:  # noqa: D102
        self.playing = True

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        if self._to_nearest:
            self._to_nearest = False
            own = view[1 : 1 + self._robots]
            self.driven = 1 + int(np.hypot(own[:, X] - view[BALL, X], own[:, Y] - view[BALL, Y]).argmin())
        self._others.think(frame, view, wheels)
        self._drive(wheels)

    def stopped(self, frame: int, reward: float) -> None:  # noqa: D102
        self.playing, self.reward = False, reward

    def _drive(self, wheels: F64) -> None:
        """The wheels of the driven robot."""
        forward, turn, boost = self._command
        top = self._measures.top
        forward, turn = min(max(forward, -1.0), 1.0), min(max(turn, -1.0), 1.0)
        if boost and forward == 0.0 and turn == 0.0:
            forward = 1.0
        rate = _TURN
        if boost and forward == 0.0:
            rate = 2 * top / self._measures.axle
        speed = top if boost else _CRUISE * top
        set_wheels(speed * forward, rate * turn, self.driven, self._measures, wheels)
