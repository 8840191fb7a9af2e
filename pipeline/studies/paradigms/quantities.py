"""What is read off the curves of the paper's Figures 4 to 7: leads, falls, bests, each with its interval.

A measure is made from the names of learners and takes their curves; it gives None where points that it
needs are not there, and UNDEFINED where they are but have no value or no interval. Sums take points for
independent: they need streams of random numbers of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import polars as pl

from pipeline.studies.statistics import (
    UNDEFINED,
    Estimate,
    greatest,
    least,
    magnitude,
    mean,
    weighted_sum,
    wilson,
)

#: "Values of k near to zero": penalties up to half the optimum's 10.
NEAR_ZERO = -5.0

#: k (null in a game without one) to estimate; of one learner at one decay.
Curve = dict[float | None, Estimate]

#: Learner to decay to curve.
Curves = dict[str, dict[float, Curve]]

#: A row of schema Paradigms.
Row = dict[str, Any]

#: Whether a quantity looks at a k.
Where = Callable[[float | None], bool]

#: The quantity, or None where the points that it needs are not there.
Measure = Callable[[Curves], Estimate | None]


def everywhere(_: float | None) -> bool:
    """All k, and the one point of a game without k."""
    return True


def near_zero(k: float | None) -> bool:
    """``NEAR_ZERO <= k < 0``."""
    return k is not None and NEAR_ZERO <= k < 0


def _minus(one: Estimate, other: Estimate) -> Estimate:
    return weighted_sum([1.0, -1.0], [one, other])


def _gaps(one: Curve, other: Curve, where: Where = everywhere) -> list[Estimate]:
    """``one - other`` at every k that both have."""
    return [_minus(one[k], other[k]) for k in one if k in other and where(k)]


def _only(curves: Curves, learner: str) -> Curve:
    """The learner's curve in a panel; without points if it has none."""
    return next(iter(curves[learner].values()), {})


def at(learner: str, k: float) -> Measure:
    """The point at k of a panel."""
    return lambda curves: _only(curves, learner).get(k)


def fall(learner: str) -> Measure:
    """The point nearest k = 0 less the one farthest from it."""

    def measure(curves: Curves) -> Estimate | None:
        curve = {k: point for k, point in _only(curves, learner).items() if k is not None}
        if len(curve) < 2:
            return None
        return _minus(curve[min(curve, key=abs)], curve[max(curve, key=abs)])

    return measure


def lead(
    learner: str, others: Sequence[str], where: Where = everywhere,
    of: Callable[[Sequence[Estimate]], Estimate] = least,
) -> Measure:
    """By how much the learner's curve lies above each of the others in the mean over k; the least lead.

    With ``of=greatest`` and below 0, the learner lies under all of them.
    """

    def measure(curves: Curves) -> Estimate | None:
        own = _only(curves, learner)
        leads = [_gaps(own, _only(curves, other), where) for other in others]
        return of([mean(gaps) for gaps in leads]) if all(leads) else None

    return measure


def widest_gap(one: str, other: str) -> Measure:
    """The greatest distance of two curves over all k."""

    def measure(curves: Curves) -> Estimate | None:
        gaps = _gaps(_only(curves, one), _only(curves, other))
        return greatest([magnitude(gap) for gap in gaps]) if gaps else None

    return measure


def change(learner: str) -> Measure:
    """The curve at the slowest decay less the one at the fastest, mean over k: slower explores more."""

    def measure(curves: Curves) -> Estimate | None:
        decays = curves[learner]
        gaps = _gaps(decays[max(decays)], decays[min(decays)]) if len(decays) > 1 else []
        return mean(gaps) if gaps else None

    return measure


def _over_decays(curves: Curves, learner: str) -> dict[float, Estimate]:
    """A learner's points in a game without k."""
    return {decay: curve[None] for decay, curve in curves[learner].items() if None in curve}


def best(learner: str) -> Measure:
    """The greatest point over the decays."""

    def measure(curves: Curves) -> Estimate | None:
        points = _over_decays(curves, learner)
        return greatest(list(points.values())) if points else None

    return measure


def lead_of_the_best(learner: str, others: Sequence[str]) -> Measure:
    """The learner at its best decay less each other at its own; the least lead."""

    def measure(curves: Curves) -> Estimate | None:
        own, *rest = (greatest(list(_over_decays(curves, name).values())) for name in (learner, *others))
        return least([_minus(own, other) for other in rest])

    return measure


def at_decay(learner: str, decay: float) -> Measure:
    """The point at a decay."""
    return lambda curves: _over_decays(curves, learner).get(decay)


def best_decay(learner: str, around: float) -> Measure:
    """The decay of the greatest point; its interval spans the decays not surely worse than it.

    None unless the decays include ``around`` and some on either side of it: else it could not be the best.
    """

    def measure(curves: Curves) -> Estimate | None:
        points = _over_decays(curves, learner)
        if around not in points or not min(points) < around < max(points):
            return None
        top = max(points, key=lambda decay: points[decay].value)
        rivals = [decay for decay in points if _minus(points[top], points[decay]).low <= 0]
        return Estimate(top, min(rivals), max(rivals))

    return measure


def p_optimal(row: Row) -> Estimate:
    """The probability of the optimum."""
    return Estimate(row["p_optimal"], row["p_low"], row["p_high"])


def path_length(row: Row) -> Estimate:
    """Steps to the optimum; undefined where fewer than two runs reached it."""
    path = (row["path_length"], row["path_low"], row["path_high"])
    return UNDEFINED if None in path else Estimate(*path)


def p_other_equilibrium(row: Row) -> Estimate:
    """The probability of a pure Nash equilibrium that is not optimal."""
    if row["p_equilibrium"] is None:
        return UNDEFINED
    p = max(0.0, row["p_equilibrium"] - row["p_optimal"])
    low, high = wilson(p * row["runs"], row["runs"])
    return Estimate(p, float(low), float(high))


def curves_of(points: pl.DataFrame, readings: Mapping[str, str], of: Callable[[Row], Estimate]) -> Curves:
    """The curves of some learners, each in one reading.

    Args:
        points: schema Paradigms, of one game and one number of runs.
        readings: learner to reading.
        of: what is read off a point.
    """
    curves: Curves = {learner: {} for learner in readings}
    for row in points.iter_rows(named=True):
        if readings.get(row["learner"]) == row["reading"]:
            curves[row["learner"]].setdefault(row["decay"], {})[row["k"]] = of(row)
    return curves


def panels(curves: Curves) -> Iterator[tuple[float, Curves]]:
    """Each decay, rising, with the curves at this decay only."""
    for decay in sorted({decay for decays in curves.values() for decay in decays}):
        yield decay, {name: {d: curve for d, curve in decays.items() if d == decay}
                      for name, decays in curves.items()}
