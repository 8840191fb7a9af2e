"""Grams: distinct runs of consecutive situations, counted and valued (paper section 3.2.2)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain

import numpy as np
import polars as pl

from pipeline.arrays import F64, I16, I64, Bools
from pipeline.sequences import added_up, codes_of, exact, instances, mark, role_of, windows
from pipeline.settings import GramSettings
from schemas import ROLES, SIDES, Grams

#: Quantum of sums that may be larger than those of values; exact below 2**37.
_COARSE = 2.0**-16


def value(
    situations: pl.DataFrame, goals: pl.DataFrame, settings: GramSettings, *, start: str = "start_ns"
) -> pl.DataFrame:
    """Add the value of each situation: how soon the next goal of either side follows.

    Args:
        situations: rows of schema Situations of one match, or other rows with a team and a start.
        goals: columns t_ns and team (schema Goals) of the same match, in any order.
        settings: alpha and tick_s.
        start: name of the column with their start, ns.

    Returns:
        The situations with column ``value`` (float64): alpha^t if the next goal after the
        situation's start is for the robot's team, -alpha^t if it is against, 0 if none follows. If
        that goal's team is null, the value is 0, and no later goal counts. t is the time from the
        situation's start to the goal in ticks; it is not rounded, because samples need not come at
        the tick. A situation that starts at the very time of a goal is after it.
    """
    goals = goals.select("t_ns", "team").sort("t_ns")
    goal_ns = goals["t_ns"].to_numpy()
    unknown = len(SIDES)
    scorer = goals["team"].cast(pl.Enum(SIDES)).to_physical().fill_null(unknown).to_numpy()
    start_ns = situations[start].to_numpy()
    team = situations["team"].cast(pl.Enum(SIDES)).to_physical().to_numpy()
    values = np.zeros(len(start_ns), dtype=np.float64)
    following = np.searchsorted(goal_ns, start_ns, side="right")
    before = following < len(goal_ns)
    following = following[before]
    ticks = (goal_ns[following] - start_ns[before]) / (settings.tick_s * 1e9)
    sign = np.where(scorer[following] == team[before], 1.0, -1.0)
    sign[scorer[following] == unknown] = 0.0
    values[before] = sign * settings.alpha**ticks
    return situations.with_columns(pl.Series("value", values))


def cover(situations: pl.DataFrame, patterns: pl.DataFrame, settings: GramSettings) -> Bools:
    """Mask of the situations that are part of a behaviour already, bool [S].

    The patterns are applied in the order of the rounds: four situations first, then three in the
    rest, and so on. Overlapping instances of one length all count.

    Args:
        situations: rows of schema Situations of one match [S].
        patterns: columns role and codes (schema Patterns), and side, of all earlier rounds together.
        settings: gap_s.
    """
    taken = np.zeros(situations.height, dtype=np.bool_)
    for found in instances(situations, patterns, settings.gap_s):
        mark(found.first, found.n, taken)
    return taken


def grams(valued: pl.DataFrame, n: int, taken: Bools | None, settings: GramSettings) -> pl.DataFrame:
    """Count and value the distinct runs of ``n`` consecutive situations of one match.

    Args:
        valued: situations with their values by the next goal, from :func:`value`, and the columns change,
            x and y of schema Worths [S].
        n: 1 to 4.
        taken: bool [S], situations that are used up (:func:`cover`); None for none.
        settings: gap_s and outcome.

    Returns:
        Rows of schema Grams, one a distinct (team, role at the start, codes).
    """
    runs = windows(valued, n, taken, settings.gap_s)
    rows = runs.first[:, None] + np.arange(n)
    paper = exact(valued["value"].to_numpy()[rows].mean(axis=1))
    instance = paper if settings.outcome == "paper" else exact(valued["change"].to_numpy()[rows].sum(axis=1))
    team = valued["team"].cast(pl.Enum(SIDES)).to_physical().to_numpy()[runs.first]
    split = len(ROLES) << 32
    keys, which = np.unique(runs.key + team.astype(np.int64) * split, return_inverse=True)

    def total(weights: F64) -> F64:
        summed: F64 = np.bincount(which, weights=weights, minlength=len(keys)).astype(np.float64)
        return summed

    count, value_sum = np.bincount(which, minlength=len(keys)), total(instance)
    x, y = (exact(valued[name].cast(pl.Float64).to_numpy()[runs.first], _COARSE) for name in ("x", "y"))
    known = ~np.isnan(x)
    return pl.DataFrame(
        {
            "match_id": np.repeat(valued["match_id"].head(1).to_numpy(), len(keys)),
            "team": _labels(SIDES, keys // split),
            "role": _labels(ROLES, role_of(keys % split)),
            "codes": _lists(codes_of(keys % split, n)),
            "n": np.full(len(keys), n),
            "count": count,
            "value_sum": value_sum,
            "value_square_sum": total(exact(instance**2)),
            "match_square_sum": exact(value_sum**2, _COARSE),
            "match_product_sum": exact(value_sum * count, _COARSE),
            "match_count_square_sum": count**2,
            "paper_sum": total(paper),
            "placed": total(known.astype(np.float64)).astype(np.int64),
            "x_sum": total(np.where(known, x, 0.0)),
            "y_sum": total(np.where(known, y, 0.0)),
        },
        schema=Grams.dtypes(),
    )


def merge(tables: Iterable[pl.DataFrame], apart: tuple[str, ...] = ()) -> pl.DataFrame:
    """Add up grams over matches; see :func:`pipeline.sequences.added_up`.

    Args:
        tables: rows of schema Grams, or earlier results of this function.
        apart: further columns of text, by which grams are told apart.

    Returns:
        The columns ``apart`` and those of schema Grams but match_id and team, one row a distinct
        (``apart``, role, codes), sorted by these and n.
    """
    columns = [*apart, *(name for name in Grams.dtypes() if name not in ("match_id", "team"))]
    none = Grams.empty().with_columns(pl.lit(None, dtype=pl.String).alias(name) for name in apart)
    every = (table.select(columns) for table in chain([none], tables))
    return added_up(every, (*apart, "role", "codes", "n")).select(columns).sort(*apart, "n", "role", "codes")


def _labels(categories: tuple[str, ...], index: I64) -> pl.Series:
    """An Enum column from the indices of its categories."""
    return pl.Series(np.array(categories)[index], dtype=pl.Enum(categories))


def _lists(codes: I16) -> pl.Series:
    """A list column from codes [W, n]."""
    return pl.Series("codes", codes, dtype=pl.Array(pl.Int16, codes.shape[1])).cast(pl.List(pl.Int16))
