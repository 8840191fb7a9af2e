"""Rows of a table in groups: sums, spreads, and what came before."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.numbers.arrays import F64, I64, Bools


class Groups(NamedTuple):
    """Rows grouped by a key, groups in rising order of it.

    Attributes:
        order: int64 [N], the rows in the order of their groups; all other functions want rows in this order.
        key: int64 [G], of each group.
        first: int64 [G + 1], where each group begins among the ordered rows.
        of_row: int64 [N], group of each ordered row.
    """

    order: I64
    key: I64
    first: I64
    of_row: I64

    @classmethod
    def of(cls, keys: I64) -> Groups:
        """Groups of rows by their keys, int64 [N]; rows of one group keep their order."""
        order = np.argsort(keys, kind="stable")
        key, first = np.unique(keys[order], return_index=True)
        first = np.append(first, len(keys)).astype(np.int64)
        return cls(order, key, first, np.repeat(np.arange(len(key)), np.diff(first)))

    def sums(self, values: F64 | Bools) -> F64:
        """Sum of each group, float64 [G]."""
        if not len(self.key):
            return np.empty(0)
        sums: F64 = np.add.reduceat(values.astype(np.float64), self.first[:-1])
        return sums

    def spread(self, x: F64, y: F64) -> F64:
        """Diagonal of the rectangle that holds each group, float64 [G]."""
        if not len(self.key):
            return np.empty(0)
        first = self.first[:-1]
        sides = [np.maximum.reduceat(v, first) - np.minimum.reduceat(v, first) for v in (x, y)]
        spread: F64 = np.hypot(sides[0], sides[1])
        return spread

    def before(self, kind: I64) -> I64:
        """The group of the same kind before each, by the kinds int64 [G]; -1 where there is none."""
        order = np.argsort(kind, kind="stable")
        same = kind[order][1:] == kind[order][:-1]
        before = np.full(len(kind), -1, dtype=np.int64)
        before[order[1:][same]] = order[:-1][same]
        return before


def previous(key: I64, rows: F64, remembered: F64) -> F64:
    """For each row the last one of the same key before it.

    Args:
        key: int64 [N], of each row.
        rows: float64 [N, C].
        remembered: float64 [K, C], for each key the row before these; it becomes the last one of them.
    """
    before = remembered[key]
    order = np.argsort(key, kind="stable")
    same = key[order][1:] == key[order][:-1]
    before[order[1:][same]] = rows[order[:-1][same]]
    remembered[key] = rows  # of equal keys the last one stays
    return before


def expanded(counts: I64) -> tuple[I64, I64]:
    """Index of each item, repeated by its count, and the numbers from 0 of its repetitions."""
    item = np.repeat(np.arange(len(counts)), counts)
    return item, np.arange(len(item)) - np.repeat(np.cumsum(counts) - counts, counts)
