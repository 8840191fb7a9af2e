"""Sums that are exact, so that they do not depend on any order or split of the work."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import polars as pl

from pipeline.arrays import F64

#: Values are rounded to multiples of this. Their float64 sums below 2**23 are then exact, so they are
#: the same in any order and for any split of the work.
QUANTUM = 2.0**-30

#: Rows that :func:`added_up` holds back before it adds them up; this bounds its memory.
_BUFFERED_ROWS = 1 << 20


def exact(values: F64, quantum: float = QUANTUM) -> F64:
    """Round ``values`` [any shape] to multiples of a quantum (of :data:`QUANTUM`: an error below 5e-10)."""
    return np.rint(values / quantum) * quantum


def added_up(tables: Iterable[pl.DataFrame], keys: Sequence[str]) -> pl.DataFrame:
    """One row for each distinct ``keys``, with the sums of all other columns, in no particular order.

    Sums of :func:`exact` values depend neither on the order of the tables nor on the split of the rows
    over them. Memory is bounded by the number of distinct keys.

    Args:
        tables: at least one, with the same columns.
        keys: columns that are not summed.
    """
    held: list[pl.DataFrame] = []
    rows, most = 0, _BUFFERED_ROWS
    for table in tables:
        held.append(table)
        rows += table.height
        if rows > most:
            held = [_sums(held, keys)]
            rows = held[0].height
            most = rows + max(_BUFFERED_ROWS, rows)
    return _sums(held, keys)


def _sums(tables: list[pl.DataFrame], keys: Sequence[str]) -> pl.DataFrame:
    return pl.concat(tables).lazy().group_by(keys).agg(pl.all().sum()).collect()
