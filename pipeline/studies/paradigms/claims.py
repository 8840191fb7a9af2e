"""What the paper claims of Figures 4 to 7, and whether the measured points bear it out.

A claim says that a quantity lies in a range. One rule judges all of them: *reproduced* if the
quantity's 95 % interval lies wholly inside the range, *contradicted* if wholly outside, else *not
reproduced*: neither shown nor refuted. What is too noisy to tell is so never counted as reproduced.

The ranges are declared below, the quantities in :mod:`pipeline.studies.paradigms.quantities`. A probability
that the paper found in 100 runs stands for Wilson's interval of those: "never" leaves open what 0 of
100 leave open, "with probability one" what 100 of 100 do, and "sometimes" is more than "never". Where
the paper says that two learners do "almost the same", or that one is the best of them nevertheless, a
tenth of the best possible value is allowed: 0.1 of a probability, 0.4 of a path's four steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import polars as pl

from pipeline.errors import SchemaMismatch
from pipeline.studies.paradigms.quantities import (
    NEAR_ZERO,
    Measure,
    Row,
    at,
    at_decay,
    best,
    best_decay,
    change,
    curves_of,
    fall,
    lead,
    lead_of_the_best,
    near_zero,
    p_optimal,
    p_other_equilibrium,
    panels,
    path_length,
    widest_gap,
)
from pipeline.studies.statistics import Estimate, Range, greatest, wilson
from schemas.paradigms import Verdicts

#: The reading that other learners are taken in where they lack the one looked at.
PRINTED = "printed"

#: Runs a point in the paper's matrix games.
PAPER_RUNS = 100

GAMES = {4: "penalty", 5: "climbing", 6: "grid", 7: "grid"}
MATRIX = ("IQ", "JAQ", "IVQ")
GRID = ("IL-A", "IL-B", "JAQ", "IVQ")


class Peak(NamedTuple):
    """The one point of Figures 4 to 7 that the text gives as a number."""

    decay: float
    p: float
    low: float
    high: float


def _of_100(successes: float) -> tuple[float, float]:
    low, high = wilson(successes, PAPER_RUNS)
    return float(low), float(high)


#: Figure 5: IVQ's "near to 0.7" at 0.9997, with the interval of 100 runs.
PEAK = Peak(0.9997, 0.7, *_of_100(70))


NEVER = Range(f"0 (100 runs: at most {_of_100(0)[1]:.3f})", high=_of_100(0)[1])
SOMETIMES = Range(f"above 0 (100 runs: more than {_of_100(0)[1]:.3f})", low=_of_100(0)[1])
ALWAYS = Range(f"1 (100 runs: at least {_of_100(100)[0]:.3f})", low=_of_100(100)[0])
NEAR_PEAK = Range(f"near 0.7 (100 runs: {PEAK.low:.3f} to {PEAK.high:.3f})", PEAK.low, PEAK.high)
AT_PEAK = Range(f"{PEAK.decay} (as rounded)", PEAK.decay - 5e-5, PEAK.decay + 5e-5)
ABOVE = Range("above 0", low=0.0, strict=True)
BELOW = Range("below 0", high=0.0, strict=True)
SAME = Range("within 0.1 of 0", low=-0.1, high=0.1)
ALMOST = Range("at most 0.1", high=0.1)
NOT_LESS_LIKELY = Range("at least -0.1 (not worse)", low=-0.1)
NOT_LONGER = Range("at most 0.4 steps (not worse)", high=0.4)


@dataclass(frozen=True, slots=True)
class Claim:
    """One thing that the paper says of a figure.

    Attributes:
        figure: of the paper.
        text: what it says, shortly.
        learners: those that the quantity is made of.
        quantity: what is measured.
        measure: how, from the curves of these learners.
        states: where the quantity lies, if the claim holds.
        panels: whether the claim is checked at each decay (else over all of them).
        of: what is read off a row of schema Paradigms.
    """

    figure: int
    text: str
    learners: tuple[str, ...]
    quantity: str
    measure: Measure
    states: Range
    panels: bool = False
    of: Callable[[Row], Estimate] = p_optimal


CLAIMS: tuple[Claim, ...] = (
    *(Claim(4, f"Without penalty {name} converges to the optimum with probability one", (name,),
            "P(optimal) at k = 0", at(name, 0.0), ALWAYS, panels=True) for name in MATRIX),
    *(Claim(4, f"{name}'s probability falls as k falls", (name,),
            "P(optimal), k nearest 0 - lowest k", fall(name), ABOVE, panels=True) for name in MATRIX),
    Claim(4, "JAQ performs best over all", MATRIX, "P(optimal), mean over k: JAQ - best of the others",
          lead("JAQ", ("IQ", "IVQ")), ABOVE, panels=True),
    *(Claim(4, f"{name} is better than JAQ with k near zero", (name, "JAQ"),
            f"P(optimal), mean over {NEAR_ZERO:g} <= k < 0: {name} - JAQ",
            lead(name, ("JAQ",), near_zero), ABOVE, panels=True) for name in ("IQ", "IVQ")),
    Claim(4, "IVQ is best with k near zero", MATRIX,
          f"P(optimal), mean over {NEAR_ZERO:g} <= k < 0: IVQ - best of the others",
          lead("IVQ", ("IQ", "JAQ"), near_zero), ABOVE, panels=True),

    *(Claim(5, f"{name} never converges to the optimum", (name,), "P(optimal), greatest over the decays",
            best(name), NEVER) for name in ("IQ", "JAQ")),
    *(Claim(5, f"{name} converges at best to (a1, b1)", (name,), "P(a1, b1), greatest over the decays",
            best(name), SOMETIMES, of=p_other_equilibrium) for name in ("IQ", "JAQ")),
    Claim(5, "IVQ sometimes converges to the optimum", ("IVQ",), "P(optimal), greatest over the decays",
          best("IVQ"), SOMETIMES),
    Claim(5, "IVQ alone converges to the optimum", MATRIX,
          "P(optimal), each at its best decay: IVQ - best of the others",
          lead_of_the_best("IVQ", ("IQ", "JAQ")), SOMETIMES),
    Claim(5, f"IVQ's best decay is {PEAK.decay}", ("IVQ",),
          "decay of the greatest P(optimal); its interval spans decays not surely worse",
          best_decay("IVQ", PEAK.decay), AT_PEAK),
    Claim(5, f"At {PEAK.decay} IVQ's probability is near {PEAK.p}", ("IVQ",), f"P(optimal) at {PEAK.decay}",
          at_decay("IVQ", PEAK.decay), NEAR_PEAK),

    Claim(6, "JAQ has the smallest probability", GRID, "P(optimal), mean over k: JAQ - worst of the others",
          lead("JAQ", ("IL-A", "IL-B", "IVQ"), of=greatest), BELOW, panels=True),
    Claim(6, "IL-B and IVQ behave almost the same", ("IL-B", "IVQ"),
          "P(optimal), mean over k: IVQ - IL-B", lead("IVQ", ("IL-B",)), SAME, panels=True),
    Claim(6, "IL-B and IVQ behave almost the same", ("IL-B", "IVQ"),
          "P(optimal), greatest distance over k of IVQ and IL-B", widest_gap("IVQ", "IL-B"), ALMOST,
          panels=True),
    *(Claim(6, f"With more exploration {name}'s probability falls", (name,),
            "P(optimal), mean over k: slowest - fastest decay", change(name), BELOW)
      for name in ("IL-A", "IL-B")),
    Claim(6, "With more exploration IVQ's probability rises", ("IVQ",),
          "P(optimal), mean over k: slowest - fastest decay", change("IVQ"), ABOVE),

    *(Claim(7, f"With more exploration {name}'s path is shorter", (name,),
            "steps to the optimum, mean over k: slowest - fastest decay", change(name), BELOW,
            of=path_length) for name in GRID),
    # of the independent learners the paper says the opposite beside Figure 6
    *(Claim(7, f"With more exploration {name}'s probability rises (said of all learners)", (name,),
            "P(optimal), mean over k: slowest - fastest decay", change(name), ABOVE) for name in GRID),
    Claim(7, "IVQ is best in probability and path length joined", GRID,
          "P(optimal), mean over k: IVQ - best of the others",
          lead("IVQ", ("IL-A", "IL-B", "JAQ")), NOT_LESS_LIKELY, panels=True),
    Claim(7, "IVQ is best in probability and path length joined", GRID,
          "steps to the optimum, mean over k: IVQ - shortest of the others",
          lead("IVQ", ("IL-A", "IL-B", "JAQ"), of=greatest), NOT_LONGER, panels=True, of=path_length),
)


def verdicts(points: pl.DataFrame) -> pl.DataFrame:
    """Every claim whose points are there, once for every reading, decay (of a panel) and number of runs.

    A claim over several learners is checked once for every reading that any of them has, with the
    others in the reading of the same name if they have it, else in the printed one, else in their
    first. So every reading is looked at, and no two differ by more than they must.

    Args:
        points: schema Paradigms; those of the study ``figure`` are looked at.

    Returns:
        Schema Verdicts, in its order; a claim whose points are missing has no row. ``measured``, ``low``
        and ``high`` are null where the quantity is not defined: there is then no verdict but "not
        reproduced".

    Raises:
        SchemaMismatch: if a point is there twice, as of two seeds.
    """
    points = points.filter(pl.col("study") == "figure")
    key = ["figure", "game", "learner", "reading", "decay", "k", "runs"]
    twice = points.filter(points.select(key).is_duplicated())
    if len(twice):
        learner, decay = twice.row(0, named=True)["learner"], twice.row(0, named=True)["decay"]
        raise SchemaMismatch(f"{len(twice)} points are there more than once, the first of {learner} at decay "
                             f"{decay}", where="claims", next_step="Pass the points of one seed")
    return Verdicts.validate(pl.DataFrame(list(_rows(points)), schema=Verdicts.dtypes()), cast=True)


def _rows(points: pl.DataFrame) -> Iterator[dict[str, object]]:
    """The rows of schema Verdicts, in its order."""
    for claim in CLAIMS:
        mine = points.filter(
            (pl.col("figure") == min(claim.figure, 6)) & (pl.col("game") == GAMES[claim.figure])
            & pl.col("learner").is_in(claim.learners)
        )
        found = []
        for (runs,), group in mine.partition_by("runs", as_dict=True).items():
            for readings in _line_ups(group, claim.learners):
                curves = curves_of(group, readings, claim.of)
                for decay, panel in panels(curves) if claim.panels else [(None, curves)]:
                    quantity = claim.measure(panel)
                    if quantity is not None:
                        order = (_named(readings), decay or 0.0, runs)
                        found.append((order, _row(claim, readings, decay, runs, quantity)))
        yield from (row for _, row in sorted(found, key=lambda each: each[0]))


def _row(
    claim: Claim, readings: dict[str, str], decay: float | None, runs: int, quantity: Estimate
) -> dict[str, object]:
    value, low, high = quantity if quantity.defined else (None, None, None)
    return {
        "figure": claim.figure, "claim": claim.text, "reading": _named(readings), "decay": decay,
        "quantity": claim.quantity, "paper": claim.states.text, "measured": value, "low": low, "high": high,
        "runs": runs, "verdict": claim.states.verdict(quantity),
    }


def _line_ups(points: pl.DataFrame, learners: Sequence[str]) -> Iterator[dict[str, str]]:
    """Learner to reading, once for every reading; none where a learner has no points."""
    known = {name: sorted(points.filter(pl.col("learner") == name)["reading"].unique()) for name in learners}
    if not all(known.values()):
        return
    usual = {name: PRINTED if PRINTED in readings else readings[0] for name, readings in known.items()}
    every = sorted({reading for readings in known.values() for reading in readings})
    line_ups = [{name: r if r in known[name] else usual[name] for name in learners} for r in every]
    yield from (line_up for i, line_up in enumerate(line_ups) if line_up not in line_ups[:i])


def _named(readings: dict[str, str]) -> str:
    """``IQ, JAQ printed; IVQ unbracketed``."""
    sharing: dict[str, list[str]] = {}
    for learner, reading in readings.items():
        sharing.setdefault(reading, []).append(learner)
    return "; ".join(f"{', '.join(learners)} {reading}" for reading, learners in sharing.items())
