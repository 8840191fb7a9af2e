"""Plots of matches: the fuzzy terms of situations, and the behaviours found."""

from __future__ import annotations

import polars as pl
from matplotlib.figure import Figure

from pitchlore.pipeline.views.plots.style import COLOURS


def memberships(terms: pl.DataFrame) -> Figure:
    """The paper's Figure 1, reconstructed: membership over each of the five fuzzy variables.

    Args:
        terms: columns variable, unit, term and the trapezoid's corners a, b, c, d.
    """
    variables = terms["variable"].unique(maintain_order=True).to_list()
    figure = Figure(figsize=(9, 2 * len(variables)), layout="constrained")
    for axes, variable in zip(figure.subplots(len(variables), 1), variables, strict=True):
        rows = terms.filter(pl.col("variable") == variable)
        corners = [row[corner] for row in rows.iter_rows(named=True) for corner in "abcd"
                   if row[corner] is not None]
        low, high = min(corners), max(corners)
        margin = 0.15 * (high - low)
        for index, row in enumerate(rows.iter_rows(named=True)):
            a, b, c, d = (row[corner] for corner in "abcd")
            left = [(low - margin, 1.0)] if a is None or b is None else [(a, float(a == b)), (b, 1.0)]
            right = [(high + margin, 1.0)] if c is None or d is None else [(c, 1.0), (d, float(c == d))]
            x, y = zip(*left, *right, strict=True)
            axes.plot(x, y, color=COLOURS[index % len(COLOURS)], label=row["term"].lower())
        axes.set_xlabel(f"{variable} [{rows['unit'][0]}]")
        axes.set_ylabel("membership")
        axes.set_ylim(-0.05, 1.05)
        axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
    return figure


def plot_behaviours(known: pl.DataFrame) -> Figure:
    """Value against support of every behaviour of a version, by length.

    Args:
        known: schema Behaviours.
    """
    figure = Figure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots()
    for index, n in enumerate(sorted(known["n"].unique(), reverse=True)):
        rows = known.filter(pl.col("n") == n)
        axes.scatter(rows["support"], rows["value"], s=14, color=COLOURS[index], alpha=0.7,
                     label=f"{n} situation{'s' if n > 1 else ''}")
    axes.set_xscale("log")
    axes.set_xlabel("support (instances)")
    axes.set_ylabel("value (mean over instances)")
    axes.axhline(0, color="0.7", linewidth=0.8)
    axes.legend(frameon=False)
    return figure
