"""Estimates with 95 % intervals: proportions, means, differences, sums and extremes.

The independent observation is one training: a run of section 5's games, or a season. The tests of one
training share what it learned. They are one observation with a value in [0, 1], however many they are.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy  # loads scipy.stats (about a second) at the first interval

from pitchlore.pipeline.numbers.arrays import F64

#: The normal distribution's 97.5 % point: 95 % lie within so many standard deviations.
Z = 1.959963984540054


def wilson(successes: float, n: int) -> tuple[float, float]:
    """Wilson's 95 % score interval of a proportion, without continuity correction.

    Successes may be fractional: the sum of n trainings' shares of successful tests. Among all distributions
    on [0, 1] with a given mean, the one of 0 and 1 alone has the greatest variance. The interval of shares is
    therefore too wide rather than too narrow. (scipy's takes whole successes only.)

    Source: Wilson, *Journal of the American Statistical Association* 22 (1927) 209-212.

    Args:
        successes: in [0, n].
        n: independent trainings, at least 1.

    Returns:
        Low and high, both in [0, 1] and included.
    """
    p = successes / n
    spread = Z * math.sqrt(p * (1 - p) / n + Z * Z / (4 * n * n))
    scale = 1 + Z * Z / n
    low = (p + Z * Z / (2 * n) - spread) / scale
    high = (p + Z * Z / (2 * n) + spread) / scale
    # rounding leaves 1e-17 at the ends
    return max(low, 0.0) if p > 0 else 0.0, min(high, 1.0) if p < 1 else 1.0


def mean_interval(values: npt.ArrayLike) -> tuple[float, float] | None:
    """Student's 95 % interval of a mean, both ends included; None below two values.

    Equal values give an interval without width.

    Args:
        values: float64 [R], one for each training; NaN if a training has none.
    """
    seen = _known(values)
    if len(seen) < 2:
        return None
    quantile = float(scipy.stats.t.ppf(0.975, len(seen) - 1))
    half, centre = quantile * float(seen.std(ddof=1)) / math.sqrt(len(seen)), float(seen.mean())
    return centre - half, centre + half


def welch(one: npt.ArrayLike, other: npt.ArrayLike) -> tuple[float, float] | None:
    """Welch's 95 % interval of the difference of two means, both ends included; None below two values.

    The variances may differ. Equal values on both sides give an interval without width.

    Source: Welch, *Biometrika* 34 (1947) 28-35.

    Args:
        one: float64 [R], one for each training; NaN if a training has none.
        other: float64 [S], likewise, of trainings independent of the first.
    """
    sides = _known(one), _known(other)
    if min(map(len, sides)) < 2:
        return None
    with warnings.catch_warnings():  # of equal values, whose variance is 0 exactly: nothing is lost
        warnings.filterwarnings("ignore", "Precision loss", RuntimeWarning)
        low, high = scipy.stats.ttest_ind(*sides, equal_var=False).confidence_interval(0.95)
    return float(low), float(high)


def false_discovery_rates(value: F64, error: F64) -> F64:
    """Least false discovery rate at which each value differs from 0: scipy's ``false_discovery_control``.

    Here without the second that scipy.stats takes to load (Benjamini and Hochberg 1995, Controlling the false
    discovery rate, JRSS B 57; valid for positively dependent values, too).

    Args:
        value: float64 [N], estimates.
        error: float64 [N], their standard errors.

    Returns:
        float64 [N], in 0 to 1.
    """
    chance = 2 * scipy.special.ndtr(-np.abs(value) / np.maximum(error, 1e-12))
    order = np.argsort(chance)
    rate = np.minimum.accumulate((chance[order] * len(chance) / np.arange(1, len(chance) + 1))[::-1])[::-1]
    found: F64 = np.minimum(rate, 1.0)[np.argsort(order)]
    return found


def welch_of(n: F64, mean: F64, spread: F64) -> tuple[F64, F64]:
    """Welch's 95 % intervals of differences of two means, as :func:`welch`, from counts, means and spreads.

    Args:
        n: float64 [2, K], sizes of the first and of the second sample.
        mean: float64 [2, K], their means.
        spread: float64 [2, K], their standard deviations (n - 1).

    Returns:
        Low and high of first less second, float64 [K] each; NaN where a sample has fewer than two values.
    """
    enough = (n >= 2).all(axis=0)
    share = np.where(enough, spread**2 / np.maximum(n, 1), np.nan)
    total = share.sum(axis=0)
    parts = (share**2 / np.maximum(n - 1, 1)).sum(axis=0)
    # without any spread the interval has no width, whatever the degrees of freedom
    freedom = np.where(parts > 0, total**2 / np.where(parts > 0, parts, 1.0), 1.0)
    # stdtrit is the quantile of Student's t, without the second that scipy.stats takes to load
    half = scipy.special.stdtrit(freedom, 0.975) * np.sqrt(total)
    between = mean[0] - mean[1]
    return between - half, between + half


def _known(values: npt.ArrayLike) -> F64:
    """Values that are not NaN, float64."""
    seen = np.asarray(values, dtype=np.float64)
    return seen[~np.isnan(seen)]


class Estimate(NamedTuple):
    """Value with its 95 % interval, both ends included; NaN if it is not defined."""

    value: float
    low: float
    high: float

    @property
    def defined(self) -> bool:
        """True if there is a value with an interval."""
        return not math.isnan(self.low)


UNDEFINED = Estimate(math.nan, math.nan, math.nan)


def weighted_sum(weights: Sequence[float], estimates: Sequence[Estimate]) -> Estimate:
    """Weighted sum of independent estimates; no interval, or value, if one of them has none.

    The method of variance estimates recovery takes an estimate's distance to an end of its interval for the
    standard error there, times a constant. Squared distances then add up as variances do; a negative weight
    swaps the ends. The method keeps the skewness of intervals of proportions near 0 and 1.

    Source: Zou and Donner, *Statistics in Medicine* 27 (2008) 1693-1702.
    """
    w, (x, low, high) = np.array(weights), np.array(list(zip(*estimates, strict=True)))
    total = float(w @ x)
    down = np.where(w >= 0, x - low, high - x) * w
    up = np.where(w >= 0, high - x, x - low) * w
    return Estimate(math.fsum(w * x), total - math.sqrt(down @ down), total + math.sqrt(up @ up))


def difference(one: Estimate, other: Estimate) -> Estimate:
    """First minus second of two independent estimates; no interval if one of them has none.

    Of proportions with Wilson's intervals it is Newcombe's hybrid score interval: *Statistics in Medicine* 17
    (1998) 873-890, method 10.
    """
    return weighted_sum([1.0, -1.0], [one, other])


def mean(estimates: Sequence[Estimate]) -> Estimate:
    """Mean of those independent estimates that are defined; UNDEFINED if none is."""
    known = [estimate for estimate in estimates if estimate.defined]
    return weighted_sum([1 / len(known)] * len(known), known) if known else UNDEFINED


def greatest(estimates: Sequence[Estimate]) -> Estimate:
    """Greatest of those estimates that are defined; UNDEFINED if none is.

    Its interval goes from the greatest lower to the greatest upper end. It contains the greatest true value
    if each interval contains its own. One estimate above a bound puts it above: among many noisy ones some
    will be.
    """
    known = [estimate for estimate in estimates if estimate.defined]
    return Estimate(*(max(ends) for ends in zip(*known, strict=True))) if known else UNDEFINED


def least(estimates: Sequence[Estimate]) -> Estimate:
    """Least of those estimates that are defined, likewise."""
    known = [estimate for estimate in estimates if estimate.defined]
    return Estimate(*(min(ends) for ends in zip(*known, strict=True))) if known else UNDEFINED


def magnitude(estimate: Estimate) -> Estimate:
    """Absolute value of an estimate."""
    value, low, high = estimate
    return Estimate(abs(value), max(0.0, low, -high), max(abs(low), abs(high)))
