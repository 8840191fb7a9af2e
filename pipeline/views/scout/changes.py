"""Changes from the first to the second half, beside those of chance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

from pitchlore.pipeline.views.commentary.words import with_minus

#: Changes that are reported in words; share of chance's changes that lie within its range.
TOLD, _WITHIN = 3, 0.95


class Change(NamedTuple):
    """A number of the second half less that of the first.

    Attributes:
        first, second: the number in each half.
        low, high: 95 % of the changes that chance gives lie within, ends included; None where not known.
        size: the change less the one that is expected, in standard deviations of chance; 0 without a range.
    """

    first: float
    second: float
    low: int | None = None
    high: int | None = None
    size: float = 0.0

    @property
    def value(self) -> float:
        """Second less first."""
        return self.second - self.first

    @property
    def beyond(self) -> bool:
        """True if it is larger than chance gives."""
        return self.low is not None and self.high is not None and not self.low <= self.value <= self.high


def change(first: float | None, second: float | None) -> Change | None:
    """The change of a number that is no count, of which no chance is known; None where a half has none."""
    return None if first is None or second is None else Change(first, second)


def change_of_count(first: int | None, second: int | None, seconds: tuple[float, float]) -> Change | None:
    """The change of a count, with what chance gives if events come at one rate, independent of one another.

    Two Poisson counts with the same rate, given their sum: the second is binomial, with the second half's
    share of the time (Przyborowski and Wilenski, *Biometrika* 31 (1940) 313-323).

    Args:
        first: the count in the first half; None where it is not known.
        second: the count in the second half.
        seconds: how long each half lasts.
    """
    if first is None or second is None:
        return None
    n, share = first + second, seconds[1] / max(sum(seconds), 1e-9)
    if not n or not 0 < share < 1:
        return Change(first, second)
    k = np.arange(n + 1)
    up_to = scipy.special.bdtr(k, n, share)
    tail = (1 - _WITHIN) / 2
    low, high = (int(np.searchsorted(up_to, at)) for at in (tail, 1 - tail))
    spread = float(np.sqrt(n * share * (1 - share)))
    return Change(first, second, 2 * low - n, 2 * min(high, n) - n, (second - n * share) / spread)


def reported_changes(changes: Sequence[tuple[str, Change | None]]) -> str:
    """The greatest changes of counts in words, or that none is larger than chance gives.

    Args:
        changes: each with what it is of.
    """
    tested = [(name, it) for name, it in changes if it is not None and it.low is not None]
    if not tested:
        return "No count is known in both halves."
    beyond = sorted((each for each in tested if each[1].beyond), key=lambda each: -abs(each[1].size))
    if not beyond:
        return "No count changed by more than chance gives."
    named = "; ".join(
        f"{name} {it.first} to {it.second} "
        + with_minus(f"({it.value:+}; chance gives {it.low:+} to {it.high:+})")
        for name, it in beyond[:TOLD])
    more = f", the {TOLD} greatest of {len(beyond)}" if len(beyond) > TOLD else ""
    return (f"Larger than chance gives{more}: {named}. "
            f"Of {len(tested)} counts chance alone makes about {0.05 * len(tested):.1f} so large.")
