"""A match that is played a step at a time by whoever drives one or both of its teams."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.arena.match import observation, sighted
from pitchlore.pipeline.arena.match.controllers import Controller, measures_of
from pitchlore.pipeline.arena.match.driven import Driven
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.numbers.arrays import F32


class SteppedMatch:
    """A match between steps: the referee has made a call, and the next motion is to come.

    So a goal is called in the step in which the ball went in, and at a restart the bodies stand at their new
    places when the next action is chosen. The match is not logged.

    Args:
        recipe: recipe of the match.
        controllers: controllers of home and away; those that are :class:`Driven` are driven.

    Attributes:
        match: the match; it stands at its kick-off at first.

    Raises:
        BadSettings: if nothing can be played by this recipe.
    """

    def __init__(self, recipe: Recipe, controllers: tuple[Controller, Controller]) -> None:
        self.match = MatchInPlay(recipe, controllers, logged=False)
        driven = {team: own for team, own in enumerate(controllers) if isinstance(own, Driven)}
        self._teams, self._driven = tuple(driven), tuple(driven.values())
        self._robots = recipe.robots
        self._scales = observation.scales(recipe)
        self._length = observation.length(recipe.robots)
        self._sight_scales = sighted.scales(recipe)
        self._measures = measures_of(recipe).packed()
        self._frames = 1 + self.match.laws.duration
        self.match.call()

    def step(
        self, actions: Sequence[Sequence[Any] | npt.NDArray[Any]], frames: int, until_goal: bool,
        each: Callable[[], None] | None = None,
    ) -> list[float]:
        """Play some frames, fewer if the match ends.

        Args:
            actions: actions of each driven team, see ``Driven.command``.
            frames: number of frames.
            until_goal: whether a goal ends the step.
            each: called after each frame.

        Returns:
            Goals for less goals against of each driven team in these frames.

        Raises:
            BadSettings: if the actions do not fit; nothing has moved then.
        """
        driven, match = self._driven, self.match
        for own, given in zip(driven, actions, strict=True):
            own.command(given)
            own.earned = 0.0
        for _ in range(frames):
            match.move()
            match.call()
            if each is not None:
                each()
            if match.over or (until_goal and driven[0].earned):
                break
        return [own.earned for own in driven]

    def begin_anew(self, robots: Sequence[Sequence[int]]) -> None:
        """Let robots of each driven team, by index, begin the behaviours of the next step anew."""
        for own, those in zip(self._driven, robots, strict=True):
            own.begin_anew(those)

    def sights(self) -> F32:
        """Sights of all robots of each driven team, float32 [driven teams times N, 33].

        The rows are vectors of :mod:`pipeline.arena.match.sighted`, in an array of their own.
        """
        out = np.empty((len(self._teams) * self._robots, sighted.NUMBERS), dtype=np.float32)
        sighted.observe(self.match.views, self._teams, self._measures, self._sight_scales, out)
        return out

    def observe(self, robots: int) -> F32:
        """Observations of each driven team's first robots, float32 [driven teams times robots, 14 N + 7].

        The rows are vectors of :mod:`pipeline.arena.match.observation`, in an array of their own.
        """
        match = self.match
        home, away = match.score
        out = np.empty((len(self._teams) * robots, self._length), dtype=np.float32)
        left = 1.0 - match.frame / self._frames
        observation.observe(
            match.views, self._teams, home - away, left, match.in_play, self._scales, out)
        return out
