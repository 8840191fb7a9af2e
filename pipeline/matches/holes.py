"""Holes in numbers that count up: what is missing, and when."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.numbers.arrays import I64


class Holes(NamedTuple):
    """Holes in numbers: how many there are, how many numbers are missing, and times around them, ns."""

    holes: int
    missing: int
    start_ns: int
    end_ns: int


def holes_in(numbers: I64, t_ns: I64) -> Holes | None:
    """Holes in numbers that count up by their usual step; None if there is none.

    Numbers of which more are missing than there are do not count up (they are all 0, or times): these have
    no holes.

    Args:
        numbers: int64 [K], in any order.
        t_ns: int64 [K], their times.
    """
    values, places = np.unique(numbers, return_index=True)
    steps = np.diff(values)
    if not len(steps):
        return None
    missing = steps // max(int(np.median(steps)), 1) - 1
    wide = np.flatnonzero(missing > 0)
    if not len(wide) or int(missing.sum()) > len(values):
        return None
    around = t_ns[places[np.concatenate((wide, wide + 1))]]
    return Holes(len(wide), int(missing[wide].sum()), int(around.min()), int(around.max()) + 1)
