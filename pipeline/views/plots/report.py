"""Plots of the report on seasons, by their names on its page."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.stages.report.claims import BEST, LEARNED, PAPER
from pitchlore.pipeline.stages.report.measures import DIFFERENCE, EFFECTIVE, OTHER, OTHER_TIME, Pooling
from pitchlore.pipeline.stages.report.summary import beside_table_3, mean_curves
from pitchlore.pipeline.stages.report.table3 import CHANGE
from pitchlore.pipeline.views.plots import seasons as plots
from pitchlore.pipeline.views.plots.style import plot_png

#: Pooling of values that cannot be below 0 (a percentage: above 100): their bands end there.
WITHIN: dict[str, Pooling] = {
    "other": "percent",
    **dict.fromkeys(("states", "behaviours", "pairs", "effective", "cumulative"), "count"),
}


def plots_of_seasons(games: pl.DataFrame, growth: pl.DataFrame) -> dict[str, bytes]:
    """Plots of seasons as PNG, by their names in the report; a plot without seasons is left out.

    Args:
        games: schema Games.
        growth: schema Growth.
    """
    found = {}
    paper, known = (table.filter(pl.col("settings") == PAPER) for table in (games, growth))
    if paper.height:
        goals = {"effective": EFFECTIVE, "cumulative": EFFECTIVE.cum_sum(), "difference": DIFFERENCE}
        actions = {name: pl.col(name) for name in ("behaviours", "pairs")}
        printed = beside_table_3(games, PAPER)
        found["table-3"] = plots.table_3(
            mean_curves(paper, {"other": OTHER}, poolings=WITHIN), printed, CHANGE)
        states = {"states": pl.col("states")}
        found["figure-8"] = plots.states(mean_curves(known, states, ["role"], poolings=WITHIN))
        found["figure-9"] = plots.plot_known(mean_curves(known, actions, ["role"], poolings=WITHIN))
        found["figure-10"] = plots.goals(mean_curves(paper, goals, poolings=WITHIN))
    best = games.filter(pl.col("settings") == BEST)
    if best.height:
        both = {"difference": DIFFERENCE, "other": OTHER_TIME}
        found["best"] = plots.progress(mean_curves(best, both, poolings=WITHIN), LEARNED)
    return {name: plot_png(figure) for name, figure in found.items()}
