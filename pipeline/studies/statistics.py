"""95 % intervals of proportions, of means, of what is made of several of them, and claims about them.

The unit of all of them is the training: a run of section 5's games, or a season. The thousand tests of
one training share what it learned, so they are one observation with a value in [0, 1], not a thousand.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import ge, gt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

F64 = npt.NDArray[np.float64]

#: The normal distribution's 97.5 % point: 95 % lie within so many standard deviations.
Z = 1.959963984540054


def wilson(successes: npt.ArrayLike, n: npt.ArrayLike, z: float = Z) -> tuple[F64, F64]:
    """Wilson's score interval of a proportion, without continuity correction.

    Successes may be fractional: the sum of n trainings' shares of successful tests. Of all
    distributions on [0, 1] with a given mean that of yes and no has the greatest variance, so the
    interval is then too wide rather than too narrow.

    Source: Wilson, *Journal of the American Statistical Association* 22 (1927) 209-212.

    Args:
        successes: in [0, n], any shape.
        n: independent trainings, at least 1, of a shape that broadcasts.
        z: half width in standard deviations.

    Returns:
        Low and high, float64 of the common shape, both ends in [0, 1] and included.
    """
    trials = np.asarray(n, dtype=np.float64)
    p = np.asarray(successes, dtype=np.float64) / trials
    spread = z * np.sqrt(p * (1 - p) / trials + z * z / (4 * trials * trials))
    scale = 1 + z * z / trials
    low = (p + z * z / (2 * trials) - spread) / scale
    high = (p + z * z / (2 * trials) + spread) / scale
    # exactly so at the ends, where rounding leaves 1e-17
    return np.where(p <= 0, 0.0, np.clip(low, 0, 1)), np.where(p >= 1, 1.0, np.clip(high, 0, 1))


def mean_interval(values: npt.ArrayLike) -> tuple[float, float] | None:
    """Student's 95 % interval of a mean, both ends included; None below two values.

    Args:
        values: float64 [R], one a training; NaN where a training has none.
    """
    seen = np.asarray(values, dtype=np.float64)
    seen = seen[~np.isnan(seen)]
    if len(seen) < 2:
        return None
    half = float(stdtrit(len(seen) - 1, 0.975)) * float(seen.std(ddof=1)) / math.sqrt(len(seen))
    centre = float(seen.mean())
    return centre - half, centre + half


def welch(one: npt.ArrayLike, other: npt.ArrayLike) -> tuple[float, float] | None:
    """Welch's 95 % interval of the difference of two means, both ends included; None below two values.

    The variances may differ; the degrees of freedom are Satterthwaite's. Values that never vary on
    either side give an interval without width.

    Source: Welch, *Biometrika* 34 (1947) 28-35.

    Args:
        one: float64 [R], one a training; NaN where a training has none.
        other: float64 [S], likewise, of trainings that are independent of these.
    """
    a, b = (values[~np.isnan(values)] for values in (np.asarray(x, dtype=np.float64) for x in (one, other)))
    if min(len(a), len(b)) < 2:
        return None
    u, v = float(a.var(ddof=1)) / len(a), float(b.var(ddof=1)) / len(b)
    half = 0.0
    if u + v > 0:
        freedom = (u + v) ** 2 / (u * u / (len(a) - 1) + v * v / (len(b) - 1))
        half = float(stdtrit(freedom, 0.975)) * math.sqrt(u + v)
    apart = float(a.mean() - b.mean())
    return apart - half, apart + half


def combined(
    weights: npt.ArrayLike, values: npt.ArrayLike, lows: npt.ArrayLike, highs: npt.ArrayLike
) -> tuple[float, float]:
    """The interval of a weighted sum of independent estimates, from their own intervals.

    The method of variance estimates recovery: an estimate's distance to the end of its interval is
    what its standard error would be there, so squared distances add up as variances do; a negative
    weight swaps the ends. It keeps the skewness that intervals of proportions near 0 and 1 have. With
    weights 1 and -1 and Wilson's intervals it is :func:`difference`; with 1/K each it is the mean of
    a curve over K points.

    Source: Zou and Donner, *Statistics in Medicine* 27 (2008) 1693-1702.

    Args:
        weights: float64 [K].
        values: float64 [K], the estimates.
        lows: float64 [K], lower ends, at most the estimates.
        highs: float64 [K], upper ends, at least the estimates.

    Returns:
        Low and high, both included.
    """
    w, x, low, high = (np.asarray(a, dtype=np.float64) for a in (weights, values, lows, highs))
    total = float(w @ x)
    down = np.where(w >= 0, x - low, high - x) * w
    up = np.where(w >= 0, high - x, x - low) * w
    return total - math.sqrt(float(down @ down)), total + math.sqrt(float(up @ up))


def difference(p1: float, n1: float, p2: float, n2: float) -> tuple[float, float]:
    """Newcombe's hybrid score interval of p1 - p2 for two independent proportions, both ends included.

    Source: Newcombe, *Statistics in Medicine* 17 (1998) 873-890, method 10.

    Args:
        p1: first proportion, in [0, 1].
        n1: trainings it was found in, at least 1.
        p2: second proportion.
        n2: trainings it was found in.
    """
    p, n = np.array([p1, p2]), np.array([n1, n2])
    return combined([1.0, -1.0], p, *wilson(p * n, n))


class Estimate(NamedTuple):
    """A quantity with its 95 % interval, both ends included; all NaN where it is not defined."""

    value: float
    low: float
    high: float

    @property
    def defined(self) -> bool:
        """Whether there is a value with an interval."""
        return not math.isnan(self.low)


UNDEFINED = Estimate(math.nan, math.nan, math.nan)


def weighted_sum(weights: Sequence[float], estimates: Sequence[Estimate]) -> Estimate:
    """A weighted sum of independent estimates, by :func:`combined`; UNDEFINED if one of them is."""
    values, lows, highs = zip(*estimates, strict=True)
    total = math.fsum(w * x for w, x in zip(weights, values, strict=True))
    return Estimate(total, *combined(weights, values, lows, highs))


def mean(estimates: Sequence[Estimate]) -> Estimate:
    """The mean of those that are defined, of independent estimates; UNDEFINED if none is."""
    known = [estimate for estimate in estimates if estimate.defined]
    return weighted_sum([1 / len(known)] * len(known), known) if known else UNDEFINED


def greatest(estimates: Sequence[Estimate]) -> Estimate:
    """The greatest of those that are defined; UNDEFINED if none is.

    Its interval goes from the greatest lower to the greatest upper end, which contains it whenever
    each interval contains its own. (Above a bound it is as soon as one is: of many noisy estimates one
    will be.)
    """
    known = [estimate for estimate in estimates if estimate.defined]
    return Estimate(*(max(ends) for ends in zip(*known, strict=True))) if known else UNDEFINED


def least(estimates: Sequence[Estimate]) -> Estimate:
    """The least of those that are defined, likewise."""
    known = [estimate for estimate in estimates if estimate.defined]
    return Estimate(*(min(ends) for ends in zip(*known, strict=True))) if known else UNDEFINED


def magnitude(estimate: Estimate) -> Estimate:
    """The absolute value."""
    value, low, high = estimate
    return Estimate(abs(value), max(0.0, low, -high), max(abs(low), abs(high)))


@dataclass(frozen=True, slots=True)
class Range:
    """What a claim states of a quantity.

    Attributes:
        text: in words.
        low: lower end, included unless ``strict``.
        high: upper end, likewise.
        strict: the ends do not belong to it: an interval that touches one from within is not inside, and
            one that comes to it from without is outside.
    """

    text: str
    low: float = -math.inf
    high: float = math.inf
    strict: bool = False

    def verdict(self, estimate: Estimate) -> str:
        """One of ``schemas.paradigms.VERDICTS``; "not reproduced" where the estimate is not defined."""
        _, low, high = estimate
        within, beyond = (gt, ge) if self.strict else (ge, gt)
        if beyond(low, self.high) or beyond(self.low, high):
            return "contradicted"
        return "reproduced" if within(low, self.low) and within(self.high, high) else "not reproduced"

    def holds(self, value: float) -> bool:
        """Whether a value without an interval lies in it."""
        return self.verdict(Estimate(value, value, value)) == "reproduced"
