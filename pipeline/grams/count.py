"""Grams: distinct runs of consecutive situations, counted and valued (paper section 3.2.2)."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
import polars as pl

from pipeline.sequences import (
    I64,
    QUANTUM,
    Bool,
    codes_of,
    exact,
    instances,
    keys_of_table,
    lengths_of,
    mark,
    role_of,
    windows,
)
from pipeline.settings import GramSettings
from schemas import ROLES, SIDES, Grams

#: Rows that :func:`merge` collects before it adds them up; this bounds its memory.
_BUFFERED_ROWS = 1 << 20


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


def cover(situations: pl.DataFrame, patterns: pl.DataFrame, settings: GramSettings) -> Bool:
    """Mask of the situations that are part of a behaviour already, bool [S].

    The patterns are applied in the order of the rounds: four situations first, then three in the
    rest, and so on. Overlapping instances of one length all count.

    Args:
        situations: rows of schema Situations of one match [S].
        patterns: columns role and codes (schema Patterns) of all earlier rounds together.
        settings: gap_s.
    """
    taken = np.zeros(situations.height, dtype=np.bool_)
    for found in instances(situations, patterns, settings.gap_s):
        mark(found.first, found.n, taken)
    return taken


def grams(valued: pl.DataFrame, n: int, taken: Bool | None, settings: GramSettings) -> pl.DataFrame:
    """Count and value the distinct runs of ``n`` consecutive situations of one match.

    Args:
        valued: situations with their values, from :func:`value` [S].
        n: 1 to 4.
        taken: bool [S], situations that are used up (:func:`cover`); None for none.
        settings: gap_s.

    Returns:
        Rows of schema Grams, one a distinct (team, role at the start, codes). An instance's
        value is the mean of its situations' values.
    """
    runs = windows(valued, n, taken, settings.gap_s)
    values = valued["value"].to_numpy()
    instance = exact(values[runs.first[:, None] + np.arange(n)].mean(axis=1))
    team = valued["team"].cast(pl.Enum(SIDES)).to_physical().to_numpy()[runs.first]
    split = len(ROLES) << 32
    keys, which = np.unique(runs.key + team.astype(np.int64) * split, return_inverse=True)
    return pl.DataFrame(
        {
            "match_id": np.repeat(valued["match_id"].head(1).to_numpy(), len(keys)),
            "team": _labels(SIDES, keys // split),
            "role": _labels(ROLES, role_of(keys % split)),
            "codes": _lists(codes_of(keys % split, n)),
            "n": np.full(len(keys), n),
            "count": np.bincount(which, minlength=len(keys)),
            "value_sum": np.bincount(which, weights=instance, minlength=len(keys)),
            "value_square_sum": np.bincount(which, weights=exact(instance**2), minlength=len(keys)),
        },
        schema=Grams.dtypes(),
    )


def merge(tables: Iterable[pl.DataFrame]) -> pl.DataFrame:
    """Add up grams over matches and teams.

    The sums are exact, so the result depends neither on the order of the tables nor on the split of
    the matches over them. Memory is bounded by the number of distinct grams.

    Args:
        tables: rows of schema Grams, or earlier results of this function.

    Returns:
        Columns role, codes, n, count, value_sum and value_square_sum as in schema Grams, one
        row a distinct (role, codes), sorted by n, role, codes.
    """
    total = np.empty((0, 4), dtype=np.int64)
    held: list[I64] = []
    rows = 0
    for table in tables:
        held.append(_sums(table))
        rows += table.height
        if rows > max(_BUFFERED_ROWS, len(total)):
            total, held, rows = _add_up([total, *held]), [], 0
    total = _add_up([total, *held])
    key, count, value_sum, square_sum = total.T
    length = lengths_of(key)
    codes = pl.concat(
        [_lists(codes_of(key[length == n], n)) for n in np.unique(length).tolist()]
        or [pl.Series("codes", [], pl.List(pl.Int16))]
    )
    order = np.argsort(length, kind="stable")
    key, count, value_sum, square_sum, length = (
        column[order] for column in (key, count, value_sum, square_sum, length)
    )
    return pl.DataFrame(
        {
            "role": _labels(ROLES, role_of(key)),
            "codes": codes,
            "n": length,
            "count": count,
            "value_sum": value_sum * QUANTUM,
            "value_square_sum": square_sum * QUANTUM,
        },
        schema={name: dtype for name, dtype in Grams.dtypes().items() if name not in ("match_id", "team")},
    )


def _sums(table: pl.DataFrame) -> I64:
    """Key, count, sum and sum of squares (in quanta) of a table of grams, int64 [rows, 4]."""
    return np.column_stack(
        [
            keys_of_table(table),
            table["count"].to_numpy(),
            *(
                np.rint(table[name].to_numpy() / QUANTUM).astype(np.int64)
                for name in ("value_sum", "value_square_sum")
            ),
        ]
    )


def _add_up(parts: list[I64]) -> I64:
    """The parts' rows [*, 4] with those of one key added up, sorted by key."""
    rows = np.concatenate(parts)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    starts = np.flatnonzero(np.diff(rows[:, 0], prepend=-1))
    added = rows[starts]
    if len(starts):
        added[:, 1:] = np.add.reduceat(rows[:, 1:], starts, axis=0)
    return added


def _labels(categories: tuple[str, ...], index: I64) -> pl.Series:
    """An Enum column from the indices of its categories."""
    return pl.Series(np.array(categories)[index], dtype=pl.Enum(categories))


def _lists(codes: npt.NDArray[np.int16]) -> pl.Series:
    """A list column from codes [W, n]."""
    return pl.Series("codes", codes, dtype=pl.Array(pl.Int16, codes.shape[1])).cast(pl.List(pl.Int16))
