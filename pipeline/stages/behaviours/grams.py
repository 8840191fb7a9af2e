"""Grams: distinct runs of consecutive situations, counted and valued (paper section 3.2.2)."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import F64, I32, I64, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.numbers.sums import QUANTUM, added_up, numbered
from pitchlore.pipeline.stages.sequences.windows import codes_of, instances, owner_of, role_of, windows
from pitchlore.schemas import ROLES

#: Quantum of sums that may be larger than those of values; exact below 2**37.
_COARSE = 2.0**-16
#: Columns of grams: whole numbers, sums, and all in the order of the table.
_COUNTS = ("count", "placed", "match_count_square_sum")
_SUMS = (
    "value_sum", "value_square_sum", "paper_sum", "x_sum", "y_sum", "match_square_sum", "match_product_sum")
_IN_ORDER = (
    "count", "value_sum", "value_square_sum", "match_square_sum", "match_product_sum",
    "match_count_square_sum", "paper_sum", "placed", "x_sum", "y_sum")


def cover(sequence: pl.DataFrame, patterns: pl.DataFrame, before: Bools | None = None) -> Bools:
    """Mask of the situations that are part of a behaviour already, bool [S].

    The patterns are applied in the order of the rounds: four situations first, then three in the
    rest, and so on. Overlapping instances of one length all count.

    Args:
        sequence: columns role, code and follows, perhaps who [S].
        patterns: columns role and codes (schema Patterns), perhaps who, of all earlier rounds together.
        before: mask of the situations that longer patterns than these cover; None: none does.
    """
    taken = np.zeros(sequence.height, dtype=np.bool_) if before is None else before.copy()
    for _ in instances(sequence, patterns, taken):
        pass
    return taken


def grams(sequence: pl.DataFrame, n: int, taken: Bools | None = None) -> pl.DataFrame:
    """Count and value the distinct runs of ``n`` consecutive situations.

    Args:
        sequence: rows of schema Sequences of some matches, each whole, one after the other; with a column
            who, grams of these owners are distinguished [S].
        n: 1 to 4.
        taken: bool [S], situations that are used up (:func:`cover`); None for none.

    Returns:
        One row a distinct (owner, role at the start, codes), sorted by ``key``: that of
        :func:`pipeline.stages.sequences.windows.keys_of`, and the counts and sums of schema Grams. Tables of
        other matches are added up by :func:`merge`.
    """
    runs = windows(sequence, n, taken)
    key, (place,) = numbered([runs.key])
    match = sequence["match_id"].rle_id().cast(pl.Int64).to_numpy(writable=True)
    value = sequence["value"].to_numpy(writable=True)
    by_change = sequence["change"].null_count() == 0
    change = sequence["change"].to_numpy(writable=True) if by_change else np.empty(0)
    x, y = (sequence[name].cast(pl.Float64).to_numpy(writable=True) for name in ("x", "y"))
    counts, sums = _added(runs.first, place, n, match, value, change, x, y, len(key))
    columns = dict(zip((*_COUNTS, *_SUMS), (*counts.T, *sums.T), strict=True))
    return pl.DataFrame({"key": key} | {name: np.ascontiguousarray(columns[name]) for name in _IN_ORDER})


@njit(cache=True, nogil=True)
def _added(
    first: I64, place: I32, n: int, match: I64, value: F64, change: F64, x: F64, y: F64, distinct_keys: int
) -> tuple[I64, F64]:
    """Counts and sums of each distinct key: columns of :data:`_COUNTS` and of :data:`_SUMS`.

    Args:
        first: int64 [W], first row of each window.
        place: int32 [W], number of its key.
        n: its length.
        match: int64 [S], number of each row's match; equal ones follow each other.
        value: float64 [S].
        change: float64 [S], or [0] if a group's value is the mean of ``value``.
        x: float64 [S], NaN where unknown.
        y: the same.
        distinct_keys: number of keys.
    """
    counts, sums = np.zeros((distinct_keys, 3), dtype=np.int64), np.zeros((distinct_keys, 7))
    # of the match in which a key was seen last
    latest = np.full(distinct_keys, -1, dtype=np.int64)
    seen, total = np.zeros(distinct_keys, dtype=np.int64), np.zeros(distinct_keys)
    for w in range(len(first)):
        row, k = first[w], place[w]
        paper = value[row]
        for i in range(1, n):
            paper += value[row + i]
        paper = np.rint(paper / n / QUANTUM) * QUANTUM
        instance = paper
        if len(change):
            instance = change[row]
            for i in range(1, n):
                instance += change[row + i]
            instance = np.rint(instance / QUANTUM) * QUANTUM
        if latest[k] != match[row]:
            _close(counts[k], sums[k], seen[k], total[k])
            latest[k], seen[k], total[k] = match[row], 0, 0.0
        seen[k] += 1
        total[k] += instance
        sums[k, 0] += instance
        sums[k, 1] += np.rint(instance * instance / QUANTUM) * QUANTUM
        sums[k, 2] += paper
        if not np.isnan(x[row]):
            counts[k, 1] += 1
            sums[k, 3] += np.rint(x[row] / _COARSE) * _COARSE
            sums[k, 4] += np.rint(y[row] / _COARSE) * _COARSE
    for k in range(distinct_keys):
        _close(counts[k], sums[k], seen[k], total[k])
    return counts, sums


@njit(cache=True, nogil=True, inline="always")
def _close(counts: I64, sums: F64, seen: int, total: float) -> None:
    """Add a match's count and sum of one key, and their squares, to the key's own."""
    counts[0] += seen
    counts[2] += seen * seen
    sums[5] += np.rint(total * total / _COARSE) * _COARSE
    sums[6] += np.rint(total * seen / _COARSE) * _COARSE


def merge(tables: Iterable[pl.DataFrame]) -> pl.DataFrame:
    """Add up grams over matches; see :func:`pipeline.numbers.sums.added_up`.

    Args:
        tables: at least one, of :func:`grams` or of this function, of any lengths.

    Returns:
        One row a distinct key, sorted by key: by owner, role and codes.
    """
    return added_up(tables, "key")


def spelt(merged: pl.DataFrame, n: int) -> pl.DataFrame:
    """Merged grams of one length with the columns of their keys: who (int64), role, codes and n."""
    key = merged["key"].to_numpy()
    codes = pl.Series("codes", codes_of(key, n), dtype=pl.Array(pl.Int16, n)).cast(pl.List(pl.Int16))
    return merged.select(
        pl.Series("who", owner_of(key)),
        pl.Series("role", np.array(ROLES)[role_of(key)], dtype=pl.Enum(ROLES)),
        codes,
        pl.lit(n, dtype=pl.Int8).alias("n"),
        pl.exclude("key"),
    )
