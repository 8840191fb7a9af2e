"""Controllers of teams that somebody drives from outside the match, a step at a time."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.arena.match.controllers import Controller, measures_of
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.arena.teams.chosen import carry_out
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.tactics.executors.actions import ACTION, CODES
from pitchlore.pipeline.game.tactics.splitmix import seeded
from pitchlore.pipeline.numbers.arrays import F64

_CODES = np.array(CODES)
_STANDS = 184


class Driven(Controller):
    """A team that is driven from outside.

    Attributes:
        earned: goals for less goals against since whoever reads it last set it to 0.
    """

    earned = 0.0

    @abstractmethod
    def command(self, actions: Sequence[Any] | npt.NDArray[Any]) -> None:
        """Follow these actions, one of each robot in the order of numbers, until the next command.

        Raises:
            BadSettings: if they are not what this team follows.
        """

    def begin_anew(self, robots: Sequence[int]) -> None:
        """Let robots, by index, begin anew what they are told next, if they would go on with it."""

    def stopped(self, frame: int, reward: float) -> None:  # noqa: D102
        self.earned += reward


class WheelController(Driven):
    """Turns the wheels of its robots as it is commanded.

    An action is the speeds of the left and right wheel, as shares of the top speed in [-1, 1]; what is beyond
    is cut by the motors. At first wheels stand still.

    Args:
        recipe: recipe of the match.
    """

    def __init__(self, recipe: Recipe) -> None:
        self._top = recipe.physics.wheel_speed
        self._shares: F64 = np.zeros((recipe.robots, 2))

    def command(self, actions: Sequence[Any] | npt.NDArray[Any]) -> None:  # noqa: D102
        shares = self._shares
        try:
            for robot, action in enumerate(actions):
                shares[robot] = action
        except (IndexError, TypeError, ValueError) as error:
            raise _unfit(actions, f"{len(shares)} pairs of wheel speeds") from error

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        np.multiply(self._shares, self._top, out=wheels)


class BehaviourController(Driven):
    """Carries out behaviours as it is commanded, see :mod:`pipeline.arena.teams.chosen`.

    An action is an index in ``executors.actions.CODES``. At first robots stand (184).

    Args:
        recipe: recipe of the match.
        rng: decides what is left to chance: the wheels of random moves.
    """

    def __init__(self, recipe: Recipe, rng: np.random.Generator) -> None:
        self._codes = np.full(recipe.robots, _STANDS)
        self._robots = np.zeros(recipe.robots, dtype=ACTION)
        self._measures = measures_of(recipe).packed()
        self._splitmix = seeded(rng)

    def command(self, actions: Sequence[Any] | npt.NDArray[Any]) -> None:  # noqa: D102
        chosen = np.asarray(actions)
        if chosen.shape != self._codes.shape or chosen.dtype.kind not in "iu" or not (
            (chosen >= 0) & (chosen < len(CODES))
        ).all():
            raise _unfit(actions, f"{len(self._codes)} whole numbers from 0 to {len(CODES) - 1}")
        self._codes[:] = _CODES[chosen]

    def begin_anew(self, robots: Sequence[int]) -> None:  # noqa: D102
        self._robots["code"][robots] = 0

    def restarted(self, frame: int, lead: int) -> None:  # noqa: D102
        self._robots["code"] = 0

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        carry_out(view, self._codes, self._robots, self._measures, self._splitmix, wheels)


def _unfit(actions: object, wanted: str) -> BadSettings:
    return BadSettings(f"these are no actions of the robots: {actions!r}"[:200], where="step",
                       next_step=f"Give {wanted}, one of each robot")
