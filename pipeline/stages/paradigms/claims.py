"""The paper's claims about Figures 4 to 7.

The measures are in :mod:`pipeline.stages.paradigms.measures`, the verdicts' rule in
:mod:`pipeline.numbers.claims`. A probability that the paper found in 100 runs stands for Wilson's interval of
100 runs: "never" allows what 0 of 100 allow, "with probability one" what 100 of 100 allow, and "sometimes"
is more than "never". For "almost the same" and "the best of them nevertheless" a tenth of the best possible
value is allowed: 0.1 of a probability, 0.4 of a path's four steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.numbers.claims import ABOVE, BELOW, Claim, Range, findings
from pitchlore.pipeline.numbers.statistics import Estimate, greatest, wilson
from pitchlore.pipeline.stages.paradigms.measures import (
    NEAR_ZERO,
    Measure,
    Row,
    at,
    at_decay,
    best,
    best_decay,
    change_over_decays,
    compared,
    fall,
    lead,
    lead_of_the_best,
    near_zero,
    p_optimal,
    p_other_equilibrium,
    path_length,
    widest_gap,
)
from pitchlore.schemas.paradigms import Verdicts

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


#: Figure 5: IVQ's "near to 0.7" at 0.9997, with the interval of 100 runs.
PEAK = Peak(0.9997, 0.7, *wilson(70, PAPER_RUNS))

_, _RARELY = wilson(0, PAPER_RUNS)
_NEARLY_ALWAYS, _ = wilson(PAPER_RUNS, PAPER_RUNS)
NEVER = Range(f"0 (100 runs: at most {_RARELY:.3f})", high=_RARELY)
SOMETIMES = Range(f"above 0 (100 runs: more than {_RARELY:.3f})", low=_RARELY)
ALWAYS = Range(f"1 (100 runs: at least {_NEARLY_ALWAYS:.3f})", low=_NEARLY_ALWAYS)
NEAR_PEAK = Range(f"near 0.7 (100 runs: {PEAK.low:.3f} to {PEAK.high:.3f})", PEAK.low, PEAK.high)
AT_PEAK = Range(f"{PEAK.decay} (as rounded)", PEAK.decay - 5e-5, PEAK.decay + 5e-5)
SAME = Range("within 0.1 of 0", low=-0.1, high=0.1)
ALMOST = Range("at most 0.1", high=0.1)
NOT_LESS_LIKELY = Range("at least -0.1 (not worse)", low=-0.1)
NOT_LONGER = Range("at most 0.4 steps (not worse)", high=0.4)


def _claim(
    figure: int, text: str, learners: tuple[str, ...], quantity: str, measure: Measure, stated: Range, *,
    by_panel: bool = False, of: Callable[[Row], Estimate] = p_optimal,
) -> Claim[pl.DataFrame]:
    """Claim about a figure; see :func:`pipeline.stages.paradigms.measures.compared` for the arguments."""
    return Claim(f"Figure {figure}", text, quantity, stated, compared(
        figure, GAMES[figure], learners, measure, by_panel=by_panel, of=of))


CLAIMS: tuple[Claim[pl.DataFrame], ...] = (
    *(_claim(4, f"Without penalty {name} converges to the optimum with probability one", (name,),
            "P(optimal) at k = 0", at(name, 0.0), ALWAYS, by_panel=True) for name in MATRIX),
    *(_claim(4, f"{name}'s probability falls as k falls", (name,),
            "P(optimal), k nearest 0 - lowest k", fall(name), ABOVE, by_panel=True) for name in MATRIX),
    _claim(4, "JAQ performs best over all", MATRIX, "P(optimal), mean over k: JAQ - best of the others",
          lead("JAQ", ("IQ", "IVQ")), ABOVE, by_panel=True),
    *(_claim(4, f"{name} is better than JAQ with k near zero", (name, "JAQ"),
            f"P(optimal), mean over {NEAR_ZERO:g} <= k < 0: {name} - JAQ",
            lead(name, ("JAQ",), near_zero), ABOVE, by_panel=True) for name in ("IQ", "IVQ")),
    _claim(4, "IVQ is best with k near zero", MATRIX,
          f"P(optimal), mean over {NEAR_ZERO:g} <= k < 0: IVQ - best of the others",
          lead("IVQ", ("IQ", "JAQ"), near_zero), ABOVE, by_panel=True),

    *(_claim(5, f"{name} never converges to the optimum", (name,), "P(optimal), greatest over the decays",
            best(name), NEVER) for name in ("IQ", "JAQ")),
    *(_claim(5, f"{name} converges at best to (a1, b1)", (name,), "P(a1, b1), greatest over the decays",
            best(name), SOMETIMES, of=p_other_equilibrium) for name in ("IQ", "JAQ")),
    _claim(5, "IVQ sometimes converges to the optimum", ("IVQ",), "P(optimal), greatest over the decays",
          best("IVQ"), SOMETIMES),
    _claim(5, "IVQ alone converges to the optimum", MATRIX,
          "P(optimal), each at its best decay: IVQ - best of the others",
          lead_of_the_best("IVQ", ("IQ", "JAQ")), SOMETIMES),
    _claim(5, f"IVQ's best decay is {PEAK.decay}", ("IVQ",),
          "decay of the greatest P(optimal); its interval spans decays not surely worse",
          best_decay("IVQ", PEAK.decay), AT_PEAK),
    _claim(5, f"At {PEAK.decay} IVQ's probability is near {PEAK.p}", ("IVQ",), f"P(optimal) at {PEAK.decay}",
          at_decay("IVQ", PEAK.decay), NEAR_PEAK),

    _claim(6, "JAQ has the smallest probability", GRID, "P(optimal), mean over k: JAQ - worst of the others",
          lead("JAQ", ("IL-A", "IL-B", "IVQ"), of=greatest), BELOW, by_panel=True),
    _claim(6, "IL-B and IVQ behave almost the same", ("IL-B", "IVQ"),
          "P(optimal), mean over k: IVQ - IL-B", lead("IVQ", ("IL-B",)), SAME, by_panel=True),
    _claim(6, "IL-B and IVQ behave almost the same", ("IL-B", "IVQ"),
          "P(optimal), greatest distance over k of IVQ and IL-B", widest_gap("IVQ", "IL-B"), ALMOST,
          by_panel=True),
    *(_claim(6, f"With more exploration {name}'s probability falls", (name,),
            "P(optimal), mean over k: slowest - fastest decay", change_over_decays(name), BELOW)
      for name in ("IL-A", "IL-B")),
    _claim(6, "With more exploration IVQ's probability rises", ("IVQ",),
          "P(optimal), mean over k: slowest - fastest decay", change_over_decays("IVQ"), ABOVE),

    *(_claim(7, f"With more exploration {name}'s path is shorter", (name,),
            "steps to the optimum, mean over k: slowest - fastest decay", change_over_decays(name), BELOW,
            of=path_length) for name in GRID),
    # of the independent learners the paper says the opposite beside Figure 6
    *(_claim(7, f"With more exploration {name}'s probability rises (said of all learners)", (name,),
            "P(optimal), mean over k: slowest - fastest decay", change_over_decays(name), ABOVE)
      for name in GRID),
    _claim(7, "IVQ is best in probability and path length joined", GRID,
          "P(optimal), mean over k: IVQ - best of the others",
          lead("IVQ", ("IL-A", "IL-B", "JAQ")), NOT_LESS_LIKELY, by_panel=True),
    _claim(7, "IVQ is best in probability and path length joined", GRID,
          "steps to the optimum, mean over k: IVQ - shortest of the others",
          lead("IVQ", ("IL-A", "IL-B", "JAQ"), of=greatest), NOT_LONGER, by_panel=True, of=path_length),
)


def verdicts(points: pl.DataFrame) -> pl.DataFrame:
    """Schema Verdicts: every claim, in their order, for every reading, panel and number of runs.

    Of the points (schema Paradigms), those of the study ``figure`` are looked at. A claim without points has
    no row.

    Raises:
        SchemaMismatch: if a point is there twice, as of two seeds.
    """
    points = points.filter(pl.col("study") == "figure")
    key = ["figure", "game", "learner", "reading", "decay", "k", "runs"]
    twice = points.filter(points.select(key).is_duplicated())
    if len(twice):
        learner, decay = twice.select("learner", "decay").row(0)
        raise SchemaMismatch(f"{len(twice)} points are there more than once, the first of {learner} at decay "
                             f"{decay}", where="claims", next_step="Pass the points of one seed")
    rows = [row | {"paper": row["stated"]} for row in findings(CLAIMS, points)]
    return Verdicts.validate(pl.DataFrame(rows, schema=Verdicts.dtypes()), cast=True)
