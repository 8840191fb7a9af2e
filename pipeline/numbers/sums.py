"""Sums that are exact, so that they do not depend on any order or split of the work."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import F64, I32, I64
from pitchlore.pipeline.numbers.kernels import njit

#: Values are rounded to multiples of this. Their float64 sums below 2**23 are then exact, so they are
#: the same in any order and for any split of the work.
QUANTUM = 2.0**-30

#: Rows that :func:`added_up` holds back before it adds them up; this bounds its memory.
_BUFFERED_ROWS = 1 << 20


def exact(values: F64, quantum: float = QUANTUM) -> F64:
    """Round ``values`` [any shape] to multiples of a quantum (of :data:`QUANTUM`: an error below 5e-10)."""
    return np.rint(values / quantum) * quantum


def added_up(tables: Iterable[pl.DataFrame], keys: Sequence[str] | str) -> pl.DataFrame:
    """One row for each distinct ``keys``, with the sums of all other columns.

    Sums of :func:`exact` values depend neither on the order of the tables nor on the split of the rows
    over them. Memory is bounded by the number of distinct keys.

    Args:
        tables: at least one, with the same columns.
        keys: columns that are not summed; or the name of one of int64. Then all others are int64 or float64,
            no value is null, and it takes half the time.

    Returns:
        The rows sorted by the key if it is the name of one, else in no particular order.
    """
    held: list[pl.DataFrame] = []
    rows, most = 0, _BUFFERED_ROWS
    for table in tables:
        held.append(table)
        rows += table.height
        if rows > most:
            held = [_sums(held, keys)]
            rows = held[0].height
            most = rows + max(_BUFFERED_ROWS, rows // 2)
    return _sums(held, keys)


def _sums(tables: list[pl.DataFrame], keys: Sequence[str] | str) -> pl.DataFrame:
    if isinstance(keys, str):
        return _by_number(tables, keys)
    # joined lazily, so that no table of all rows is made first
    return pl.concat([table.lazy() for table in tables]).group_by(keys).agg(pl.all().sum()).collect()


def _by_number(tables: list[pl.DataFrame], key: str) -> pl.DataFrame:
    found, places = numbered([table[key].to_numpy() for table in tables])
    columns: dict[str, F64 | I64] = {key: found}
    for name, dtype in tables[0].schema.items():
        if name != key:
            sums: F64 | I64 = np.zeros_like(found) if dtype.is_integer() else np.zeros(len(found))
            for table, place in zip(tables, places, strict=True):
                _add(sums, place, table[name].to_numpy())
            columns[name] = sums
    return pl.DataFrame({name: columns[name] for name in tables[0].columns})


def numbered(numbers: list[I64]) -> tuple[I64, list[I32]]:
    """The distinct numbers, sorted, and the place of each number among them."""
    rows = sum(map(len, numbers))
    bits = 1 + rows.bit_length()  # at most half full
    slots = np.full(1 << bits, -1, dtype=np.int32)
    found, count = np.empty(rows, dtype=np.int64), 0
    places: list[I32] = []
    for each in numbers:
        places.append(np.empty(len(each), dtype=np.int32))
        count = _look_up(each, slots, 64 - bits, found, count, places[-1])
    found = found[:count]
    order = np.argsort(found)
    rank = np.empty(count, dtype=np.int32)
    rank[order] = np.arange(count, dtype=np.int32)
    return found[order], [rank[place] for place in places]


@njit(cache=True, nogil=True)
def _look_up(numbers: I64, slots: I32, shift: int, found: I64, count: int, places: I32) -> int:
    """Write the place of each number in ``found``, where new ones are put at the end; their count."""
    for i in range(len(numbers)):
        # Fibonacci hashing (Knuth, The Art of Computer Programming, volume 3, section 6.4)
        slot = np.int64((np.uint64(numbers[i]) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(shift))
        while slots[slot] >= 0 and found[slots[slot]] != numbers[i]:
            slot = (slot + 1) & (len(slots) - 1)
        if slots[slot] < 0:
            slots[slot] = count
            found[count] = numbers[i]
            count += 1
        places[i] = slots[slot]
    return count


@njit(cache=True, nogil=True)
def _add(sums: F64 | I64, places: I32, values: F64 | I64) -> None:
    for i in range(len(places)):
        sums[places[i]] += values[i]
