"""Runs of consecutive situations of one robot, and the instances of patterns in them.

A sequence is a table of situations with the columns role, code and ``follows``: whether a row follows the one
before without a break (:mod:`pipeline.stages.sequences.follows`). With a column ``who``, an integer from 0,
rows and patterns of several owners (sides, teams) are distinguished. A run never crosses robots, segments,
holes, or a situation that is already used up (paper section 3.2.2: "It can not be formed groups of situations
separated by some other situation").
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.numbers.arrays import I16, I64, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.schemas import ROLES

#: Longest gram: four codes of eight bits, below the role, in one key.
LONGEST = 4
_CODE_BITS = 8
_ROLE_SHIFT = _CODE_BITS * LONGEST
_CODES_MASK = (1 << _ROLE_SHIFT) - 1
#: What a key is greater by for each next owner.
_OWNER = len(ROLES) << _ROLE_SHIFT


class Windows(NamedTuple):
    """Runs of n consecutive situations.

    Attributes:
        first: int64 [W], row of each run's first situation, increasing.
        key: int64 [W], owner and role of the first situation, and the n codes, see :func:`keys_of`.
    """

    first: I64
    key: I64


class Instances(NamedTuple):
    """Instances of the patterns of one length.

    Attributes:
        n: the length.
        first: int64 [I], row of each instance's first situation, increasing; they may overlap.
        key: int64 [I], of the situations, see :func:`keys_of`.
        pattern: int64 [I], row of the pattern in the table of patterns.
    """

    n: int
    first: I64
    key: I64
    pattern: I64


def keys_of(
    role: npt.NDArray[np.integer], codes: npt.NDArray[np.integer], who: I64 | None = None
) -> I64:
    """One integer per gram: the owner above the role's index above the codes, the first most significant.

    Args:
        role: [W], index in ``schemas.ROLES``.
        codes: [W, n], 1 to 194, n at most 4.
        who: [W], the owners, from 0; None: 0.

    Returns:
        int64 [W]; keys of one n sort like (owner, role, codes). Those of different n differ.
    """
    packed = np.zeros(len(codes), dtype=np.int64)
    for column in codes.T:
        packed = (packed << _CODE_BITS) | column.astype(np.int64)
    own = (role.astype(np.int64) << _ROLE_SHIFT) | packed
    return own if who is None else own + who * _OWNER


def owner_of(key: I64) -> I64:
    """The owner of each key, int64 [W]."""
    return key // _OWNER


def role_of(key: I64) -> I64:
    """Index of the role in ``schemas.ROLES``, int64 [W]."""
    return (key % _OWNER) >> _ROLE_SHIFT


def codes_of(key: I64, n: int) -> I16:
    """The n codes of each key, int16 [W, n]."""
    packed = key & _CODES_MASK
    shifts = _CODE_BITS * np.arange(n - 1, -1, -1)
    return ((packed[:, None] >> shifts) & ((1 << _CODE_BITS) - 1)).astype(np.int16)


def windows(sequence: pl.DataFrame, n: int, taken: Bools | None = None) -> Windows:
    """Runs of ``n`` consecutive situations, none of them taken.

    Args:
        sequence: columns role, code and follows, perhaps who [S].
        n: 1 to 4.
        taken: bool [S], situations that are used up; None for none.
    """
    used = np.zeros(sequence.height, dtype=np.bool_) if taken is None else taken
    code, follows = sequence["code"].to_numpy(writable=True), sequence["follows"].to_numpy(writable=True)
    role = sequence["role"].cast(pl.Enum(ROLES)).to_physical().cast(pl.Int64).to_numpy(writable=True)
    if "who" in sequence.columns:
        role += sequence["who"].to_numpy().astype(np.int64) * len(ROLES)
    return Windows(*_runs(code, role, follows, used, n))


@njit(cache=True, nogil=True)
def _runs(code: I16, role: I64, follows: Bools, used: Bools, n: int) -> tuple[I64, I64]:
    """First rows and keys of the runs of n; ``role`` [S] is counted on from owner to owner."""
    first, key = np.empty(len(code), dtype=np.int64), np.empty(len(code), dtype=np.int64)
    length = count = 0
    packed, kept = np.int64(0), np.int64((1 << (_CODE_BITS * n)) - 1)
    for row in range(len(code)):
        if used[row]:
            length = 0
            continue
        length = min(length + 1, n) if follows[row] and length else 1
        packed = ((packed << _CODE_BITS) | code[row]) & kept
        if length == n:
            first[count] = row + 1 - n
            key[count] = (role[row + 1 - n] << _ROLE_SHIFT) | packed
            count += 1
    return first[:count].copy(), key[:count].copy()


def instances(
    sequence: pl.DataFrame, patterns: pl.DataFrame, taken: Bools | None = None
) -> Iterator[Instances]:
    """Instances of patterns, the longest first; a shorter one uses no situation of a longer one.

    Args:
        sequence: columns role, code and follows, perhaps who [S].
        patterns: columns role and codes (schema Patterns), of any lengths, none twice; with a column who, a
            pattern has instances of that owner only; with a column kept, those that are not use up nothing.
        taken: bool [S], situations that are used up before; those of the instances are marked in place. None:
            none are.

    Yields:
        One :class:`Instances` for each length among the patterns.
    """
    taken = np.zeros(sequence.height, dtype=np.bool_) if taken is None else taken
    role = patterns["role"].cast(pl.Enum(ROLES)).to_physical().to_numpy()
    who = patterns["who"].to_numpy().astype(np.int64) if "who" in patterns.columns else None
    length = patterns["codes"].list.len().to_numpy()
    uses = (patterns["kept"].fill_null(value=True).to_numpy() if "kept" in patterns.columns
            else np.ones(len(length), dtype=np.bool_))
    for n in sorted(set(length.tolist()), reverse=True):
        rows = np.flatnonzero(length == n)
        codes = patterns["codes"][rows].list.to_array(n).to_numpy()
        key = keys_of(role[rows], codes, None if who is None else who[rows])
        order = np.argsort(key)
        rows, key = rows[order], key[order]
        runs = windows(sequence, n, taken)
        at = np.minimum(np.searchsorted(key, runs.key), len(rows) - 1)
        found = key[at] == runs.key
        taken[runs.first[found & uses[rows[at]]][:, None] + np.arange(n)] = True
        yield Instances(n, runs.first[found], runs.key[found], rows[at[found]])
