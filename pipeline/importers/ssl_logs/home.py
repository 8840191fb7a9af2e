"""Colour of the home team, which may change in the course of a match."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.numbers.arrays import I64


class HomeColour(NamedTuple):
    """Colour of the home team in the course of a match.

    Attributes:
        first: the colour with which it begins, YELLOW or BLUE.
        switches: numbers of the packets from which on the teams have the other colour, rising.
    """

    first: int
    switches: tuple[int, ...] = ()

    def at(self, order: I64) -> int | I64:
        """The home team's colour at packets, int64 [F]; one number if it stays the same."""
        if not self.switches:
            return self.first
        return (self.first + np.searchsorted(np.array(self.switches), order, side="right")) % 2

    def now(self, order: int) -> int:
        """The home team's colour at a packet."""
        return (self.first + sum(switch <= order for switch in self.switches)) % 2
