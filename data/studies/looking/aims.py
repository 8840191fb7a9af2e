"""Aims of a learner, which were written down before its seeds were played."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import polars as pl
from looking.learners import CONSTANT, STATIC, Learner

from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.numbers.statistics import mean_interval, welch

#: Column of decisions.csv: share of time that is earned (:func:`looking.earned.earned`).
EARNED = "earned share"


class Aim(NamedTuple):
    """A mean over apprentices that is to be ``least`` at least, with a lower bound above ``needed``."""

    aim: str
    needed: float
    mean: float
    low: float
    high: float
    least: float = -np.inf

    @property
    def reached(self) -> bool:
        """True if the lower bound is above what is needed, and the mean is as great as it has to be."""
        return self.low > self.needed and self.mean >= self.least


def aims(
    found: pl.DataFrame, learner: Learner, control: pl.DataFrame, decided: pl.DataFrame
) -> Iterator[Aim]:
    """The aims of a learner's apprentices.

    Args:
        found: results.csv.
        learner: their learner.
        control: pairs of the best constant team against static, on the same seeds.
        decided: decisions.csv.
    """

    def means(arm: str, opponent: str = STATIC) -> list[float]:
        return found.filter(arm=arm, opponent=opponent)["difference"].to_list()

    ours, theirs = means(learner.panel.name), control["difference"].to_numpy()
    low, high = welch(ours, theirs) or (float("nan"), float("nan"))
    yield _aim("1. ahead of best-constant, head to head", 2.0, means(learner.panel.name, CONSTANT))
    yield Aim("2. ahead of static by more than best-constant (Welch)", 1.0,
              float(np.mean(ours) - theirs.mean()), low, high)
    for opponent in PANEL:
        yield _aim(f"3. not beaten by {opponent}", -1.0, means(learner.panel.name, opponent))
    lost = [a - b for a, b in zip(ours, means(learner.blind.name), strict=True)]
    yield _aim("4. loses when it is blind", 0.0, lost, least=3.0)
    for arm in (*learner.noisy, learner.late):
        yield _aim(f"5. beats static, {arm.name}", 0.0, means(arm.name))
    yield _aim("6. earns half of its time, by its own log (a share)", 0.5, decided[EARNED].to_list())


def _aim(name: str, needed: float, values: Sequence[float], least: float = -np.inf) -> Aim:
    low, high = mean_interval(values) or (float("nan"), float("nan"))
    return Aim(name, needed, float(np.mean(values)), low, high, least)
