"""Runs of consecutive situations of one robot, and the instances of patterns in them.

Situations are rows of schema Situations of one match, in the schema's order. A run never
crosses robots, segments, holes, or a situation that is already used up (paper section
3.2.2: "It can not be formed groups of situations separated by some other situation").
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl

from pipeline.arrays import F64, I16, I64, Bools
from pipeline.errors import SchemaMismatch
from schemas import ROLES, SIDES

#: Longest gram: four codes of eight bits, below the role, in one key.
LONGEST = 4
_CODE_BITS = 8
_ROLE_SHIFT = _CODE_BITS * LONGEST
_CODES_MASK = (1 << _ROLE_SHIFT) - 1
#: What a key of the away side is greater by, where sides are told apart.
_SIDE = len(ROLES) << _ROLE_SHIFT

#: Values are rounded to multiples of this. Their float64 sums below 2**23 are then exact, so they are
#: the same in any order and for any split of the work.
QUANTUM = 2.0**-30

#: Rows that :func:`added_up` holds back before it adds them up; this bounds its memory.
_BUFFERED_ROWS = 1 << 20


class Windows(NamedTuple):
    """Runs of n consecutive situations.

    Attributes:
        first: int64 [W], row of each run's first situation, increasing.
        key: int64 [W], role of the first situation and the n codes, see :func:`keys_of`.
    """

    first: I64
    key: I64


class Instances(NamedTuple):
    """Instances of the patterns of one length.

    Attributes:
        n: the length.
        first: int64 [I], row of each instance's first situation, increasing; they may overlap.
        pattern: int64 [I], row of the pattern in the table of patterns.
    """

    n: int
    first: I64
    pattern: I64


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


def keys_of(role: npt.NDArray[np.integer], codes: npt.NDArray[np.integer]) -> I64:
    """One integer per gram: the role's index above the codes, the first code most significant.

    Args:
        role: [W], index in ``schemas.ROLES``.
        codes: [W, n], 1 to 194, n at most 4.

    Returns:
        int64 [W]; keys of one n sort like (role, codes).
    """
    packed = np.zeros(len(codes), dtype=np.int64)
    for column in codes.T:
        packed = (packed << _CODE_BITS) | column.astype(np.int64)
    return (role.astype(np.int64) << _ROLE_SHIFT) | packed


def role_of(key: I64) -> I64:
    """Index of the role in ``schemas.ROLES``, int64 [W]."""
    return key >> _ROLE_SHIFT


def codes_of(key: I64, n: int) -> I16:
    """The n codes of each key, int16 [W, n]."""
    packed = key & _CODES_MASK
    shifts = _CODE_BITS * np.arange(n - 1, -1, -1)
    return ((packed[:, None] >> shifts) & ((1 << _CODE_BITS) - 1)).astype(np.int16)


def _sides(column: pl.Series) -> I64:
    """Index of each side in ``schemas.SIDES``."""
    return column.cast(pl.Enum(SIDES)).to_physical().to_numpy().astype(np.int64)


def links(situations: pl.DataFrame, gap_s: float) -> Bools:
    """Whether each situation is followed by the next row without a break, bool [S - 1].

    Linked rows have the same robot and segment, and lie less than ``gap_s`` seconds apart.

    Raises:
        SchemaMismatch: if situations of one robot overlap or are not in order of time.
    """
    same = np.ones(max(situations.height - 1, 0), dtype=np.bool_)
    for name in ("team", "robot"):
        column = situations[name].to_physical().to_numpy()
        same &= column[1:] == column[:-1]
    gap = situations["start_ns"].to_numpy()[1:] - situations["end_ns"].to_numpy()[:-1]
    if (same & (gap < 0)).any():
        raise SchemaMismatch(
            "situations of one robot overlap or are out of order",
            where=f"situations, row {int(np.flatnonzero(same & (gap < 0))[0]) + 1}",
            next_step="Recognise them again",
        )
    segment = situations["segment"].to_numpy()
    linked: Bools = same & (segment[1:] == segment[:-1]) & (gap < gap_s * 1e9)
    return linked


def windows(situations: pl.DataFrame, n: int, taken: Bools | None, gap_s: float) -> Windows:
    """Runs of ``n`` consecutive situations, none of them taken.

    Args:
        situations: rows of schema Situations of one match [S].
        n: 1 to 4.
        taken: bool [S], situations that are used up; None for none.
        gap_s: two situations at least so far apart are not consecutive, seconds.
    """
    usable = np.ones(situations.height, dtype=np.bool_) if taken is None else ~taken
    linked = links(situations, gap_s)
    starts = max(situations.height - n + 1, 0)
    whole = np.ones(starts, dtype=np.bool_)
    for i in range(n):
        whole &= usable[i : starts + i]
    for i in range(n - 1):
        whole &= linked[i : starts + i]
    first = np.flatnonzero(whole)
    codes = situations["code"].to_numpy()
    role = situations["role"].cast(pl.Enum(ROLES)).to_physical().to_numpy()
    return Windows(first, keys_of(role[first], codes[first[:, None] + np.arange(n)]))


def mark(first: I64, n: int, taken: Bools) -> None:
    """Set ``taken`` [S] in place for the ``n`` situations of each run that starts at ``first``."""
    taken[first[:, None] + np.arange(n)] = True


def instances(situations: pl.DataFrame, patterns: pl.DataFrame, gap_s: float) -> Iterator[Instances]:
    """Instances of patterns, the longest first; a shorter one uses no situation of a longer one.

    Args:
        situations: rows of schema Situations of one match.
        patterns: columns role and codes (schema Patterns), of any lengths, none twice. With a column side,
            a pattern has instances of that side only.
        gap_s: as for :func:`windows`.

    Yields:
        One :class:`Instances` for each length among the patterns.
    """
    taken = np.zeros(situations.height, dtype=np.bool_)
    role = patterns["role"].cast(pl.Enum(ROLES)).to_physical().to_numpy()
    apart = "side" in patterns.columns
    side = _sides(patterns["side"]) if apart else np.zeros(patterns.height, dtype=np.int64)
    played = _sides(situations["team"]) if apart else np.zeros(situations.height, dtype=np.int64)
    length = patterns["codes"].list.len().to_numpy()
    for n in sorted(set(length.tolist()), reverse=True):
        rows = np.flatnonzero(length == n)
        key = keys_of(role[rows], patterns["codes"][rows].list.to_array(n).to_numpy()) + side[rows] * _SIDE
        order = np.argsort(key)
        rows, key = rows[order], key[order]
        runs = windows(situations, n, taken, gap_s)
        seen = runs.key + played[runs.first] * _SIDE
        at = np.minimum(np.searchsorted(key, seen), len(rows) - 1)
        found = key[at] == seen
        mark(runs.first[found], n, taken)
        yield Instances(n, runs.first[found], rows[at[found]])
