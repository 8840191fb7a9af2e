"""Quantities of the paper's Figures 4 to 7: leads, falls and best points of curves, each with its interval.

A measure is made from names of learners and takes their curves. It gives None if points that it needs are
missing, and UNDEFINED if they are there without a value or an interval. Sums take points to be independent:
each point needs a stream of random numbers of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import polars as pl

from pitchlore.pipeline.numbers.claims import Evidence
from pitchlore.pipeline.numbers.statistics import (
    UNDEFINED,
    Estimate,
    difference,
    greatest,
    least,
    magnitude,
    mean,
    wilson,
)

#: The reading that the other learners are taken in if they lack the one looked at.
PRINTED = "printed"

#: "Values of k near to zero": penalties up to half the optimum's 10.
NEAR_ZERO = -5.0

#: Estimates of one learner at one decay, by k (None in a game without penalties).
ByPenalty = dict[float | None, Estimate]

#: Estimates by learner, decay and k.
Curves = dict[str, dict[float, ByPenalty]]

#: A row of schema Paradigms.
Row = dict[str, Any]

#: Choice of the k that a quantity looks at; None is the one point of a game without k.
Where = Callable[[float | None], bool]

#: Quantity of some curves; None if points that it needs are missing.
Measure = Callable[[Curves], Estimate | None]


def near_zero(k: float | None) -> bool:
    """Choose ``NEAR_ZERO <= k < 0``."""
    return k is not None and NEAR_ZERO <= k < 0


def _gaps(one: ByPenalty, other: ByPenalty, where: Where = lambda _: True) -> list[Estimate]:
    """Differences ``one - other`` at every k that both have."""
    return [difference(one[k], other[k]) for k in one if k in other and where(k)]


def _only(curves: Curves, learner: str) -> ByPenalty:
    """Points of the learner in a panel; empty if it has none."""
    return next(iter(curves[learner].values()), {})


def at(learner: str, k: float) -> Measure:
    """Measure: the learner's point at k, in a panel."""
    return lambda curves: _only(curves, learner).get(k)


def fall(learner: str) -> Measure:
    """Measure: the point nearest k = 0 minus the one farthest from it, in a panel."""

    def measure(curves: Curves) -> Estimate | None:
        curve = {k: point for k, point in _only(curves, learner).items() if k is not None}
        if len(curve) < 2:
            return None
        return difference(curve[min(curve, key=abs)], curve[max(curve, key=abs)])

    return measure


def lead(
    learner: str, others: Sequence[str], where: Where = lambda _: True,
    of: Callable[[Sequence[Estimate]], Estimate] = least,
) -> Measure:
    """Measure: the least of the learner's leads over the others; a lead is a mean difference over k.

    With ``of=greatest`` it is the greatest lead: below 0 the learner lies under all the others.
    """

    def measure(curves: Curves) -> Estimate | None:
        own = _only(curves, learner)
        leads = [_gaps(own, _only(curves, other), where) for other in others]
        return of([mean(gaps) for gaps in leads]) if all(leads) else None

    return measure


def widest_gap(one: str, other: str) -> Measure:
    """Measure: the greatest distance of two curves over all k, in a panel."""

    def measure(curves: Curves) -> Estimate | None:
        gaps = _gaps(_only(curves, one), _only(curves, other))
        return greatest([magnitude(gap) for gap in gaps]) if gaps else None

    return measure


def change_over_decays(learner: str) -> Measure:
    """Measure: the curve at the slowest decay (most exploration) minus that at the fastest, mean over k."""

    def measure(curves: Curves) -> Estimate | None:
        decays = curves[learner]
        gaps = _gaps(decays[max(decays)], decays[min(decays)]) if len(decays) > 1 else []
        return mean(gaps) if gaps else None

    return measure


def _over_decays(curves: Curves, learner: str) -> dict[float, Estimate]:
    """Points of a learner in a game without k, by decay."""
    return {decay: curve[None] for decay, curve in curves[learner].items() if None in curve}


def best(learner: str) -> Measure:
    """Measure: the greatest point over the decays."""

    def measure(curves: Curves) -> Estimate | None:
        points = _over_decays(curves, learner)
        return greatest(list(points.values())) if points else None

    return measure


def lead_of_the_best(learner: str, others: Sequence[str]) -> Measure:
    """Measure: the learner at its best decay minus each other at its own; the least of these leads."""

    def measure(curves: Curves) -> Estimate | None:
        own, *rest = (greatest(list(_over_decays(curves, name).values())) for name in (learner, *others))
        return least([difference(own, other) for other in rest])

    return measure


def at_decay(learner: str, decay: float) -> Measure:
    """Measure: the point at a decay."""
    return lambda curves: _over_decays(curves, learner).get(decay)


def best_decay(learner: str, around: float) -> Measure:
    """Measure: the decay of the greatest point; its interval spans the decays not surely worse.

    It is None unless the decays include ``around`` and some on either side, or ``around`` could not be best.
    """

    def measure(curves: Curves) -> Estimate | None:
        points = _over_decays(curves, learner)
        if around not in points or not min(points) < around < max(points):
            return None
        top = max(points, key=lambda decay: points[decay].value)
        rivals = [decay for decay in points if difference(points[top], points[decay]).low <= 0]
        return Estimate(top, min(rivals), max(rivals))

    return measure


def fresh_leads(points: pl.DataFrame, learner: str, other: str) -> Iterator[dict[str, Any]]:
    """How much likelier a learner reaches the optimum than another on fresh seeds, both printed.

    Args:
        points: schema Paradigms; those of the studies ``confirmation`` and ``comparison`` are looked at.
        learner: name of the learner.
        other: name of the other.

    Yields:
        For each study: study, game, decay, runs (of each), seed, learner, other, difference, low and high
        (Newcombe's 95 % interval).
    """
    for study in ("confirmation", "comparison"):
        rows = {row["learner"]: row for row in points.filter(
            (pl.col("study") == study) & (pl.col("reading") == PRINTED)).iter_rows(named=True)}
        if {learner, other} <= rows.keys():
            one = rows[learner]
            lead = difference(p_optimal(one), p_optimal(rows[other]))
            yield {"study": study, **{name: one[name] for name in ("game", "decay", "runs", "seed")},
                   "learner": learner, "other": other, "difference": lead.value, "low": lead.low,
                   "high": lead.high}


def p_optimal(row: Row) -> Estimate:
    """Probability of the optimum."""
    return Estimate(row["p_optimal"], row["p_low"], row["p_high"])


def path_length(row: Row) -> Estimate:
    """Steps to the optimum; UNDEFINED if fewer than two runs reached it."""
    path = (row["path_length"], row["path_low"], row["path_high"])
    return UNDEFINED if None in path else Estimate(*path)


def p_other_equilibrium(row: Row) -> Estimate:
    """Probability of a pure Nash equilibrium that is not optimal."""
    if row["p_equilibrium"] is None:
        return UNDEFINED
    p = max(0.0, row["p_equilibrium"] - row["p_optimal"])
    return Estimate(p, *wilson(p * row["runs"], row["runs"]))


def curves_of(points: pl.DataFrame, readings: Mapping[str, str], of: Callable[[Row], Estimate]) -> Curves:
    """Curves of the learners, each in its reading; points are of one game and one number of runs."""
    curves: Curves = {learner: {} for learner in readings}
    for row in points.iter_rows(named=True):
        if readings.get(row["learner"]) == row["reading"]:
            curves[row["learner"]].setdefault(row["decay"], {})[row["k"]] = of(row)
    return curves


def compared(
    figure: int, game: str, learners: Sequence[str], measure: Measure, *, by_panel: bool,
    of: Callable[[Row], Estimate],
) -> Callable[[pl.DataFrame], Iterator[Evidence]]:
    """Evidence from points: one estimate for every reading, decay (if by panel) and number of runs.

    A quantity of several learners is estimated once for every reading that any of them has. The others are
    then in the reading of the same name, else in the printed one, else in their first. So every reading is
    looked at, and no two line-ups differ by more than they must. Points of Figure 7 are filed under Figure 6.
    """
    def evidence(points: pl.DataFrame) -> Iterator[Evidence]:
        mine = points.filter(
            (pl.col("figure") == min(figure, 6)) & (pl.col("game") == game)
            & pl.col("learner").is_in(learners))
        found = []
        for (runs,), group in mine.partition_by("runs", as_dict=True).items():
            panels = group.partition_by("decay", as_dict=True) if by_panel else {(None,): group}
            for readings in _line_ups(group, learners):
                for (decay,), panel in panels.items():
                    estimate = measure(curves_of(panel, readings, of))
                    if estimate is not None:
                        about = {"figure": figure, "reading": _named(readings), "decay": decay, "runs": runs}
                        found.append(Evidence(estimate, runs, about))
        yield from sorted(found, key=lambda each: (
            each.about["reading"], each.about["decay"] or 0.0, each.observations))

    return evidence


def _line_ups(points: pl.DataFrame, learners: Sequence[str]) -> Iterator[dict[str, str]]:
    """Reading of each learner, once for every reading; nothing if a learner has no points."""
    known = {name: sorted(points.filter(pl.col("learner") == name)["reading"].unique()) for name in learners}
    if not all(known.values()):
        return
    usual = {name: PRINTED if PRINTED in readings else readings[0] for name, readings in known.items()}
    every = sorted({reading for readings in known.values() for reading in readings})
    line_ups = [{name: r if r in known[name] else usual[name] for name in learners} for r in every]
    yield from (line_up for i, line_up in enumerate(line_ups) if line_up not in line_ups[:i])


def _named(readings: dict[str, str]) -> str:
    """Line-up in words: ``IQ, JAQ printed; IVQ unbracketed``."""
    sharing: dict[str, list[str]] = {}
    for learner, reading in readings.items():
        sharing.setdefault(reading, []).append(learner)
    return "; ".join(f"{', '.join(learners)} {reading}" for reading, learners in sharing.items())
