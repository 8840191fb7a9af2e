"""Outcomes of shots, in all."""

from __future__ import annotations

from typing import NamedTuple

import polars as pl

from pitchlore.schemas.events import OUTCOMES

#: What the outcomes of the table shots mean.
MEANS = {
    "goal": "it goes in, perhaps off adversaries",
    "saved": "the adversary's goalkeeper touches next",
    "blocked": "another robot of the adversary touches next",
    "own": "another robot of the team touches next",
    "missed": "nobody touches, and there is no goal",
    "wide": "it goes past a post, near it",
}
assert tuple(MEANS) == OUTCOMES
#: Outcomes that the pages call otherwise than the table does: "own" would read as an own goal.
_CALLED = {"own": "ball kept"}


def outcome_words(outcome: str) -> str:
    """An outcome of the table shots as the pages call it."""
    return _CALLED.get(outcome, outcome)


class ShotOutcome(NamedTuple):
    """Shots with one outcome.

    Attributes:
        outcome: one of OUTCOMES.
        means: meaning, in words.
        n: number of shots.
        distance: median distance to the goal's middle, m; None without a shot.
    """

    outcome: str
    means: str
    n: int
    distance: float | None


class Shooting(NamedTuple):
    """Shots of a team.

    Attributes:
        rows: one an outcome, all of OUTCOMES in order.
        n: number of shots.
        on_target: number of these that are not wide.
        distance: median distance of all, m; None without a shot.
        xg: sum of the expected goals that are known; None where none is.
        known: number of shots whose expected goals are known.
        scored: goals among these.
    """

    rows: list[ShotOutcome]
    n: int
    on_target: int
    distance: float | None
    xg: float | None
    known: int
    scored: int


def shooting(shots: pl.DataFrame) -> Shooting:
    """Outcomes of shots, in all.

    Args:
        shots: rows of schema Shots of one team with the column xg of the table chances.
    """
    rows = []
    for outcome, means in MEANS.items():
        own = shots.filter(pl.col("outcome") == outcome)
        rows.append(ShotOutcome(outcome, means, own.height, _median(own)))
    known = shots.drop_nulls("xg")
    return Shooting(
        rows, shots.height, shots.height - rows[-1].n, _median(shots),
        float(known["xg"].sum()) if known.height else None, known.height,
        known.filter(pl.col("outcome") == "goal").height)


def _median(shots: pl.DataFrame) -> float | None:
    middle = shots["distance"].cast(pl.Float64).median()
    return middle if isinstance(middle, float) else None
