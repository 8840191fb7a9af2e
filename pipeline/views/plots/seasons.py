"""Plots of seasons, game by game: the paper's Table 3 and Figures 8 to 10, and our best settings.

Every table of curves has the columns what, settings, opponent, game, seasons, mean, low and high
(``pipeline.stages.report.summary.mean_curves``); Figures 8 and 9 have role, too. A line is the mean over the
seasons; its band is the 95 % interval.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from pitchlore.pipeline.arena.teams.table import TEAMS
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.views.plots.style import Dashes, plain
from pitchlore.schemas import ROLES, called
from pitchlore.schemas.seasons import PERSON

#: Inches: width of a figure, and height of a row of panels.
_WIDTH, _HEIGHT = 10.0, 3.1


class _Panel(NamedTuple):
    """One pair of axes: titles, and a curve for each opponent."""

    title: str
    label: str
    rows: pl.DataFrame


def table_3(curves: pl.DataFrame, printed: pl.DataFrame, change: int) -> Figure:
    """Share of other actions, game by game, beside the paper's.

    Args:
        curves: curves of ``other``, %.
        printed: the paper's numbers beside our opponents': columns opponent, game and paper_pct.
        change: first game with the changed score against the static team.
    """
    titles = {name: f"against {_named(name)}" for name in sorted(set(printed["opponent"]) - {"static"})}
    titles["static"] = "against the static team"
    panels = [_Panel(title, "other actions, % of all", curves.filter(pl.col("opponent") == name))
              for name, title in titles.items()]
    figure = _drawn(panels, 2, shared=True)
    for axes, name in zip(figure.axes, titles, strict=True):
        dots = printed.filter((pl.col("opponent") == name) & pl.col("paper_pct").is_not_null())
        axes.plot(dots["game"], dots["paper_pct"], linestyle="", marker="o", markersize=4, color="0.25",
                  markerfacecolor="white", zorder=2,
                  label=f"the paper, against {'Yamamoto' if name == 'static' else 'humans'}")
        if name == "static":
            axes.axvline(change - 0.5, color="0.6", linewidth=0.9, linestyle=(0, (3, 3)))
            axes.annotate("score changed", (change - 0.3, 1), xycoords=("data", "axes fraction"), fontsize=8,
                          color="0.35", va="top")
    return keyed(figure, columns=2)


def states(curves: pl.DataFrame) -> Figure:
    """Figure 8: known states of each role, from curves of ``states``."""
    return keyed(_drawn(_by_role(curves, {"states": "states"}), 3))


def plot_known(curves: pl.DataFrame) -> Figure:
    """Figure 9: known behaviours of each role, and pairs of state and behaviour, from curves of both."""
    labels = {"behaviours": "distinct behaviours", "pairs": "(state, behaviour) pairs"}
    return keyed(_drawn(_by_role(curves, labels), 3))


def goals(curves: pl.DataFrame) -> Figure:
    """Figure 10: goals effectively made, per game and added up, and the difference of all goals.

    Args:
        curves: curves of ``effective``, ``cumulative`` and ``difference``.
    """
    panels = _by_measure(curves, {
        "effective": ("(a) direct or indirect action", "goals a game"),
        "cumulative": ("(b) the same, added up", "goals since game 1"),
        "difference": ("(c) all goals, for less against", "goal difference a game")})
    figure = _drawn(panels, 3)
    figure.axes[2].axhline(0, color="0.6", linewidth=0.8, zorder=1)
    return keyed(figure)


def progress(curves: pl.DataFrame, aim: float) -> Figure:
    """Progress of our own settings: goal difference and share of time in learned behaviours.

    Args:
        curves: curves of ``difference`` and ``other`` (% of time).
        aim: share of time in learned behaviours that we aim at, %.
    """
    panels = _by_measure(curves, {
        "difference": ("(a) goals, for less against", "goal difference a game"),
        "other": ("(b) learned behaviours", "% of time")})
    figure = _drawn(panels, 2)
    figure.axes[0].axhline(0, color="0.6", linewidth=0.8, zorder=1)
    figure.axes[1].axhline(aim, color="0.6", linewidth=0.8, linestyle=(0, (3, 3)), zorder=1)
    figure.axes[1].annotate(f"aim: {aim:g} %", (1, aim), xycoords=("axes fraction", "data"), xytext=(-4, -3),
                            textcoords="offset points", fontsize=8, color="0.35", ha="right", va="top")
    figure.axes[1].set_ylim(-2, 102)
    return keyed(figure)


def _by_measure(curves: pl.DataFrame, titles: dict[str, tuple[str, str]]) -> list[_Panel]:
    """A panel for each measure."""
    return [_Panel(*names, curves.filter(what=measure)) for measure, names in titles.items()]


def _by_role(curves: pl.DataFrame, labels: dict[str, str]) -> list[_Panel]:
    """Panels: a row for each value, a panel for each role."""
    return [
        _Panel(f"({'abc'[place]}) {role}", label if place == 0 else "",
               curves.filter((pl.col("what") == what) & (pl.col("role") == role)))
        for what, label in labels.items() for place, role in enumerate(ROLES)
    ]


def _drawn(panels: Sequence[_Panel], columns: int, *, shared: bool = False) -> Figure:
    """Figure of all panels, without legends.

    Raises:
        NotFound: if there is no curve at all.
    """
    if not any(panel.rows.height for panel in panels):
        raise NotFound("there are no games to draw", where="plots of seasons",
                       next_step="Play seasons with `pitchlore season`")
    lines = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(_WIDTH, 0.5 + _HEIGHT * lines), layout="constrained")
    grid = figure.subplots(lines, columns, sharex=True, sharey=shared, squeeze=False)
    for place, (axes, panel) in enumerate(zip(grid.flat, panels, strict=True)):
        for (name,), curve in panel.rows.partition_by("opponent", as_dict=True).items():
            team = TEAMS.get("human" if name == PERSON else str(name), TEAMS["learned"])
            draw(axes, curve, f"against {_named(str(name))} ({seasons(curve)})", team.colour, team.dashes)
        axes.set_title(panel.title, loc="left", fontsize=10.0)
        axes.set_ylabel(panel.label)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
        if place + columns >= len(panels):
            axes.set_xlabel("game")
        plain(axes, "y")
    return figure


def _named(opponent: str) -> str:
    """An opponent in a legend."""
    return "people" if opponent == PERSON else called(opponent).replace(" (", ", ").rstrip(")")


def seasons(curve: pl.DataFrame) -> str:
    """Number of seasons of a curve in words, the greatest over its games."""
    count = int(curve["seasons"].max() or 0)  # type: ignore[arg-type]
    return f"{count} season{'s' if count > 1 else ''}"


def draw(axes: Axes, curve: pl.DataFrame, label: str, colour: str, line: Dashes) -> None:
    """Draw one curve with its band."""
    rows = curve.sort("game")
    low, high = (rows[end].fill_null(math.nan).to_numpy() for end in ("low", "high"))
    axes.fill_between(rows["game"], low, high, color=colour, alpha=0.16, linewidth=0, zorder=3)
    axes.plot(rows["game"], rows["mean"], color=colour, linestyle=line, linewidth=1.8, zorder=4,
              marker="o" if rows.height == 1 else "", label=label)


def keyed(figure: Figure, columns: int = 3) -> Figure:
    """The figure with one legend below all panels, each label once."""
    handles: dict[str, Line2D] = {}
    for axes in figure.axes:
        for handle in axes.get_lines():
            label = str(handle.get_label())
            if not label.startswith("_"):
                handles.setdefault(label, handle)
    figure.legend(handles=list(handles.values()), loc="outside lower left", frameon=False, fontsize=8.5,
                  handlelength=4, ncols=min(columns, len(handles)))
    return figure
