"""Plots of the study: those of ``pitchlore report``, and each ablation beside the settings that it varies."""

from __future__ import annotations

import math

import polars as pl
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pitchlore.pipeline.stages.report.claims import BEST, PAPER, STATIC
from pitchlore.pipeline.stages.report.measures import DIFFERENCE, OTHER_TIME
from pitchlore.pipeline.stages.report.sensitivity import varied_settings
from pitchlore.pipeline.stages.report.summary import mean_curves
from pitchlore.pipeline.stages.report.table3 import CHANGE
from pitchlore.pipeline.views.plots import report
from pitchlore.pipeline.views.plots.seasons import draw, keyed, seasons
from pitchlore.pipeline.views.plots.style import COLOURS, plain, plot_png

#: Measures, a row of panels each, and their labels.
_LABELS = {"difference": "goal difference a game", "other": "learned, % of time"}
#: Ablations in one row, at most.
_ABREAST = 4


def pictures(games: pl.DataFrame, growth: pl.DataFrame) -> dict[str, bytes]:
    """Plots as PNG, by their names on the page; a plot without seasons is left out.

    Args:
        games: schema Games.
        growth: schema Growth.
    """
    found = report.plots_of_seasons(games, growth)
    for base in (PAPER, BEST):
        mine = (pl.col("settings") == base) | pl.col("settings").str.starts_with(f"{base}-")
        variants = games.filter(mine & ~varied_settings() & (pl.col("opponent") == STATIC))
        if variants["settings"].n_unique() > 1 and base in variants["settings"]:
            both = {"difference": DIFFERENCE, "other": OTHER_TIME}
            drawn = ablations(
                mean_curves(variants, both, poolings=report.WITHIN), base, CHANGE if base == PAPER else None)
            found[f"ablations-{base}"] = plot_png(drawn)
    return found


def ablations(curves: pl.DataFrame, base: str, change: int | None) -> Figure:
    """Goal difference and time in learned behaviours of each ablation, in a column of its own, with its base.

    Args:
        curves: curves of ``difference`` and ``other``, against one opponent.
        base: settings that the others vary, drawn in grey in all panels.
        change: first game with the changed score; None if the settings do not change it.
    """
    names = sorted(set(curves["settings"]) - {base})
    columns = math.ceil(len(names) / math.ceil(len(names) / _ABREAST))
    lines = 2 * math.ceil(len(names) / columns)
    figure = Figure(figsize=(10.0, 0.5 + 2.1 * lines), layout="constrained")
    grid = figure.subplots(lines, columns, sharex=True, squeeze=False)
    limits = {what: _limits(curves.filter(pl.col("what") == what), base) for what in _LABELS}
    for axes in grid.flat:
        axes.set_visible(False)
    for place, name in enumerate(names):
        for row, (what, label) in enumerate(_LABELS.items()):
            axes = grid[2 * (place // columns) + row, place % columns]
            axes.set_visible(True)
            rows = curves.filter(pl.col("what") == what)
            of_base, own = (rows.filter(pl.col("settings") == each) for each in (base, name))
            draw(axes, of_base, f"{base} ({seasons(of_base)})", "0.35", (0, (5, 2)))
            draw(axes, own, "with the change", COLOURS[0], "solid")
            axes.set_title(f"{name} ({seasons(own)})" if row == 0 else "", loc="left", fontsize=8.5)
            axes.set_ylabel(label if place % columns == 0 else "")
            axes.set_ylim(limits[what])
            axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
            plain(axes, "y")
            if row == 0:
                axes.axhline(0, color="0.6", linewidth=0.8, zorder=1)
            elif place + columns >= len(names):
                axes.set_xlabel("game")
                axes.xaxis.set_tick_params(labelbottom=True)
            if change is not None:
                axes.axvline(change - 0.5, color="0.6", linewidth=0.9, linestyle=(0, (3, 3)), zorder=1)
    return keyed(figure)


def _limits(curves: pl.DataFrame, base: str) -> tuple[float, float]:
    """Ends of the vertical axis, with room for all lines and the base's band.

    Bands of few seasons are so wide that they would fill it; the panel cuts them off.
    """
    of_base = pl.col("settings") == base
    low, high = curves.select(
        low=pl.min_horizontal(pl.col("mean").min(), pl.col("low").filter(of_base).min()),
        high=pl.max_horizontal(pl.col("mean").max(), pl.col("high").filter(of_base).max()),
    ).row(0)
    room = 0.05 * (high - low) or 1.0
    return low - room, high + room
