"""A curve: the results of one learner in one game, over penalties and decays of the temperature."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal

import numpy as np
import polars as pl
from pydantic import AfterValidator, Field, model_validator

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.numbers.statistics import mean_interval, wilson
from pitchlore.pipeline.stages.paradigms.games.game import Game
from pitchlore.pipeline.stages.paradigms.games.grid import grid_world
from pitchlore.pipeline.stages.paradigms.games.matrix import (
    climbing,
    fully_stochastic_climbing,
    partially_stochastic_climbing,
    penalty,
    pure_equilibria,
)
from pitchlore.pipeline.stages.paradigms.rules.rules import AnyLearner
from pitchlore.pipeline.stages.paradigms.rules.selection import ActionSelection
from pitchlore.pipeline.stages.paradigms.runner import Runs, Testing, Training, play_runs
from pitchlore.pipeline.stages.paradigms.settling import Settling
from pitchlore.schemas import Paradigms

#: Action selections by the names that settings use: boltzmann, epsilon-greedy, mixed.
SELECTIONS = {selection.name.lower().replace("_", "-"): selection for selection in ActionSelection}


#: Games that curves may name: functions of the penalty k (0 if there is none) and the curve.
GAMES: dict[str, Callable[[float, Curve], Game]] = {
    "penalty": lambda k, _: penalty(k),
    "climbing": lambda _, __: climbing(),
    "partially stochastic climbing": lambda _, __: partially_stochastic_climbing(),
    "fully stochastic climbing": lambda _, __: fully_stochastic_climbing(),
    "grid": lambda k, curve: grid_world(k, punished=curve.punished, stay=curve.stay),
}


#: Games of one state whose rewards are certain.
CERTAIN = ("penalty", "climbing")


def _known(game: str) -> str:
    if game not in GAMES:
        raise ValueError(f"there is no game {game!r}: name one of {', '.join(GAMES)}")
    return game


class Exploration(Frozen):
    """Exploration of a learner that does not explore by the paper's temperatures; its budget is the paper's.

    Attributes:
        selection: rule that makes weights of action values.
        start, end: temperature (or probability of exploring, at most 1) of the first and the last tick; it
            falls by a constant factor.
    """

    selection: Literal["boltzmann", "epsilon-greedy", "mixed"]
    start: float = Field(gt=0)
    end: float = Field(gt=0)

    @model_validator(mode="after")
    def _temperature_may_be_a_probability(self) -> Exploration:
        if self.selection != "boltzmann" and max(self.start, self.end) > 1:
            raise ValueError(f"{self.selection} explores with a probability: start and end are at most 1")
        return self


class Curve(Frozen):
    """Settings of one learner in one game under one reading; each penalty and decay makes a point.

    Attributes:
        study: study that the curve belongs to (schema Paradigms).
        figure: figure of the paper.
        game: name of the game, a key of :data:`GAMES`.
        learner: the learner's name in the figure.
        reading: interpretation of the paper's text, in words.
        rule: the learning rule and its settings.
        ks: penalties as written in the figure: the payoff k of the penalty game, at most 0; the punishment of
            the grid world, at least 0. Empty for a game without penalties.
        decays: factors of the temperature at each tick.
        temperature: temperature of the first tick, T0, in the unit of the rewards.
        floor: training ends when the temperature is below.
        settle: training goes on at the last temperature until the team settles
            (:class:`pipeline.stages.paradigms.settling.Settling`). The game is one of :data:`CERTAIN`.
        exploration: exploration instead of Boltzmann's selection by that temperature.
        tick: the temperature falls with every step, or with every episode.
        episode_steps: an episode of training is broken off after so many steps.
        test_steps: the same in the tests.
        tests: tests of each training's policy.
        test_by: tests choose greedily, ties at random; or by the last temperature of training.
        punished, stay: readings of the grid world (:func:`pipeline.stages.paradigms.games.grid.grid_world`).
    """

    study: Literal["figure", "sensitivity", "confirmation", "comparison"] = "figure"
    figure: Literal[4, 5, 6]
    game: Annotated[str, AfterValidator(_known)]
    learner: str
    reading: str
    rule: AnyLearner
    ks: tuple[float, ...] = ()
    decays: tuple[Annotated[float, Field(gt=0, lt=1)], ...] = Field(min_length=1)
    temperature: float = Field(default=16.0, gt=0)
    floor: float = Field(default=0.01, gt=0)
    settle: bool = False
    exploration: Exploration | None = None
    tick: Literal["step", "episode"] = "step"
    episode_steps: int = Field(default=1_000, ge=1)
    test_steps: int = Field(default=1, ge=1)
    tests: int = Field(default=1, ge=1)
    test_by: Literal["greedy", "last temperature"] = "greedy"
    punished: Literal["both", "alone"] = "both"
    stay: bool = False

    @model_validator(mode="after")
    def _settles_where_it_can(self) -> Curve:
        if self.settle and self.game not in CERTAIN:
            raise ValueError(f"teams settle in games of one state and certain rewards: {', '.join(CERTAIN)}")
        return self

    def points(self) -> Iterator[tuple[float | None, float]]:
        """All pairs of penalty (None if the game has none) and decay."""
        for decay in self.decays:
            for k in self.ks or (None,):
                yield k, decay

    def ticks(self, decay: float) -> int:
        """Number of ticks: the least t with ``temperature * decay**t < floor``, at least 1."""
        return max(1, math.floor(math.log(self.floor / self.temperature) / math.log(decay)) + 1)

    def play(self, k: float | None, decay: float, *, runs: int, seed: int) -> pl.DataFrame:
        """One row of schema Paradigms: one of the :meth:`points` over ``runs`` independent runs."""
        game = GAMES[self.game](k or 0.0, self)
        ticks, explored = self.ticks(decay), self.exploration
        if explored is None:
            temperatures = self.temperature * np.power(decay, np.arange(ticks))
            selection = ActionSelection.BOLTZMANN
        else:
            temperatures = np.geomspace(explored.start, explored.end, ticks)
            selection = SELECTIONS[explored.selection]
        # no two points share this, nor random numbers
        point = f"{self.study} {self.figure} {self.game} {self.learner} {self.reading} {k} {decay}"
        temperature = 0.0 if self.test_by == "greedy" else float(temperatures[-1])
        played = play_runs(
            game, self.rule,
            Training(temperatures, selection, self.tick, self.episode_steps,
                     Settling() if self.settle else None),
            Testing(self.tests, self.test_steps, temperature), runs=range(runs),
            seeds=(seed, int(digest(point.encode())[:16], 16)),
        )
        described: dict[str, Any] = {
            "study": self.study, "figure": self.figure, "game": self.game, "learner": self.learner,
            "reading": self.reading, "k": k, "decay": decay, "steps": ticks, "runs": runs,
            "tests": self.tests, "seed": seed,
        }
        settling = {
            "settled": float(played.settled.mean()), "settle_steps": float(played.settle_steps.mean()),
        } if self.settle else dict.fromkeys(("settled", "settle_steps"))
        return pl.DataFrame([described | _summary(played, game) | settling], schema=Paradigms.dtypes())


def _summary(played: Runs, game: Game) -> dict[str, Any]:
    """Columns that sum up the runs of a point; a run that diverged counts as a failure."""
    runs = len(played.success)
    reached = float(played.success.mean())
    low, high = wilson(reached * runs, runs)
    equilibrium = length = length_low = length_high = None
    lengths = played.length[~np.isnan(played.length)]
    if game.states == 1:
        ended = played.last[~played.diverged]
        equilibrium = float(pure_equilibria(game)[ended].sum() / runs)
    elif len(lengths):
        length = float(lengths.mean())
        length_low, length_high = mean_interval(lengths) or (None, None)
    return {
        "p_optimal": reached, "p_low": low, "p_high": high, "p_equilibrium": equilibrium,
        "path_length": length, "path_low": length_low, "path_high": length_high,
        "diverged": int(played.diverged.sum()),
    }
