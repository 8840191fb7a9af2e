"""Numbers of football's players: those on their shirts, and places for players whom nobody named."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.numbers.arrays import I64

#: First number of a player without a number on the shirt, above those of shirts.
UNNUMBERED = 100
#: Time for which a place stays empty before another track has it, ns: a body that is away so long is another.
_APART_NS = 1_000_000_000


class Stay(NamedTuple):
    """A player or a track: the shirt's number (None if unknown), first and last time seen, ns."""

    shirt: int | None
    first_ns: int
    last_ns: int


def shirt_numbers(stays: Sequence[Stay]) -> I64:
    """The number of each player of one team, int64 [n].

    A shirt's number that one player has is kept. All others are tracks: each gets a *place* from
    ``UNNUMBERED`` on, the one that has been empty for longest, if it has been so for a second. A camera that
    loses and finds nameless players so gives a team of some twenty places and not of a thousand players.
    """
    worn = Counter(stay.shirt for stay in stays)
    out = np.array([
        stay.shirt if stay.shirt is not None and worn[stay.shirt] == 1 and stay.shirt < UNNUMBERED else -1
        for stay in stays
    ], dtype=np.int64)
    free: list[tuple[int, int]] = []  # last time seen, place
    places = 0
    for i in sorted(np.flatnonzero(out < 0).tolist(), key=lambda i: (stays[i].first_ns, i)):
        if free and free[0][0] + _APART_NS <= stays[i].first_ns:
            _, place = heapq.heappop(free)
        else:
            place, places = places, places + 1
        out[i] = UNNUMBERED + place
        heapq.heappush(free, (stays[i].last_ns, place))
    return out
