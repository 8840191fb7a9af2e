"""Plots of the report on seasons, by their names on its page."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.report.claims import BEST, LEARNED, PAPER, STATIC
from pitchlore.pipeline.report.measures import DIFFERENCE, EFFECTIVE, OTHER, OTHER_TIME, Pooling
from pitchlore.pipeline.report.sensitivity import varied
from pitchlore.pipeline.report.summary import beside_table_3, curves
from pitchlore.pipeline.report.table3 import CHANGE
from pitchlore.pipeline.views.plots import seasons as plots
from pitchlore.pipeline.views.plots.style import png

#: Pooling of values that cannot be below 0 (a percentage: above 100): their bands end there.
_WITHIN: dict[str, Pooling] = {
    "other": "percent",
    **dict.fromkeys(("states", "behaviours", "pairs", "effective", "cumulative"), "count"),
}


def pictures(games: pl.DataFrame, growth: pl.DataFrame) -> dict[str, bytes]:
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
        found["table-3"] = plots.table_3(curves(paper, {"other": OTHER}, poolings=_WITHIN), printed, CHANGE)
        states = {"states": pl.col("states")}
        found["figure-8"] = plots.states(curves(known, states, ["role"], poolings=_WITHIN))
        found["figure-9"] = plots.actions(curves(known, actions, ["role"], poolings=_WITHIN))
        found["figure-10"] = plots.goals(curves(paper, goals, poolings=_WITHIN))
    both = {"difference": DIFFERENCE, "other": OTHER_TIME}
    best = games.filter(pl.col("settings") == BEST)
    if best.height:
        found["best"] = plots.progress(curves(best, both, poolings=_WITHIN), LEARNED)
    for base in (PAPER, BEST):
        mine = (pl.col("settings") == base) | pl.col("settings").str.starts_with(f"{base}-")
        variants = games.filter(mine & ~varied() & (pl.col("opponent") == STATIC))
        if variants["settings"].n_unique() > 1 and base in variants["settings"]:
            found[f"ablations-{base}"] = plots.ablations(
                curves(variants, both, poolings=_WITHIN), base, CHANGE if base == PAPER else None)
    return {name: png(figure) for name, figure in found.items()}
