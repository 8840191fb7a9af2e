"""Plots of seasons, game by game: the paper's Table 3 and Figures 8 to 10, and our own settings.

Every table of curves has the columns what, settings, opponent, game, seasons, mean, low and high
(``pipeline.report.summary.curves``); Figures 8 and 9 have role, too. A line is the mean over the
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
from pitchlore.pipeline.views.plots.style import COLOURS, Dashes, plain
from pitchlore.schemas import ROLES, called
from pitchlore.schemas.seasons import PERSON

#: Colour and line of the settings that are varied, and of their ablations.
_BASE: tuple[str, Dashes] = ("0.35", (0, (5, 2)))
_VARIED: tuple[str, Dashes] = (COLOURS[0], "solid")

#: Inches: width of a figure, height of a row of panels, and of a row if there are many.
_WIDTH, _HEIGHT, _LOW = 10.0, 3.1, 2.1
#: Ablations in one row.
_ABREAST = 4


class _Panel(NamedTuple):
    """One pair of axes: titles, and curves told apart by the column ``of``, opponent or settings."""

    title: str
    label: str
    rows: pl.DataFrame
    of: str = "opponent"
    base: str = ""  # settings that the others vary


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
    return _keyed(figure, columns=2)


def states(curves: pl.DataFrame) -> Figure:
    """Figure 8: known states of each role, from curves of ``states``."""
    return _keyed(_drawn(_by_role(curves, {"states": "states"}), 3))


def actions(curves: pl.DataFrame) -> Figure:
    """Figure 9: known behaviours of each role, and pairs of state and behaviour, from curves of both."""
    labels = {"behaviours": "distinct behaviours", "pairs": "(state, behaviour) pairs"}
    return _keyed(_drawn(_by_role(curves, labels), 3))


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
    return _keyed(figure)


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
    return _keyed(figure)


def ablations(curves: pl.DataFrame, base: str, change: int | None) -> Figure:
    """Goal difference and time in learned behaviours of each ablation, in a column of its own, with its base.

    Args:
        curves: curves of ``difference`` and ``other``, against one opponent.
        base: settings that the others vary, drawn in grey in all panels.
        change: first game with the changed score; None if the settings do not change it.
    """
    names = sorted(set(curves["settings"]) - {base})
    columns = math.ceil(len(names) / math.ceil(len(names) / _ABREAST))
    panels: list[_Panel | None] = []
    for first in range(0, len(names), columns):
        row = names[first:first + columns]
        for what, label in (("difference", "goal difference a game"), ("other", "learned, % of time")):
            for name in row:
                drawn = curves.filter((pl.col("what") == what) & pl.col("settings").is_in([base, name]))
                title = f"{name} ({_seasons(drawn.filter(pl.col('settings') == name))})"
                panels.append(_Panel(title if what == "difference" else "", label if name == row[0] else "",
                                     drawn, "settings", base))
            panels += [None] * (columns - len(row))
    figure = _drawn(panels, columns, height=_LOW, size=8.5)
    for kind, what in enumerate(("difference", "other")):
        alike = [axes for place, axes in enumerate(figure.axes) if place // columns % 2 == kind]
        limits = _limits(curves.filter(pl.col("what") == what), base)
        for axes in alike:
            axes.set_ylim(limits)
            if kind == 0:
                axes.axhline(0, color="0.6", linewidth=0.8, zorder=1)
            if change is not None:
                axes.axvline(change - 0.5, color="0.6", linewidth=0.9, linestyle=(0, (3, 3)), zorder=1)
    return _keyed(figure)


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


def _drawn(
    panels: Sequence[_Panel | None], columns: int, *, shared: bool = False, height: float = _HEIGHT,
    size: float = 10.0,
) -> Figure:
    """Figure of all panels, without legends; None leaves a place empty, ``size`` is that of the titles.

    Raises:
        NotFound: if there is no curve at all.
    """
    if not any(panel and panel.rows.height for panel in panels):
        raise NotFound("there are no games to draw", where="plots of seasons",
                       next_step="Play seasons with `pitchlore season`")
    lines = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(_WIDTH, 0.5 + height * lines), layout="constrained")
    grid = figure.subplots(lines, columns, sharex=True, sharey=shared, squeeze=False)
    for place, (axes, panel) in enumerate(zip(grid.flat, panels, strict=True)):
        if panel is None:
            axes.set_visible(False)
            continue
        for (name,), curve in panel.rows.partition_by(panel.of, as_dict=True).items():
            _draw(axes, curve, *_look(panel, str(name), _seasons(curve)))
        axes.set_title(panel.title, loc="left", fontsize=size)
        axes.set_ylabel(panel.label)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
        if place + columns >= len(panels) or panels[place + columns] is None:
            axes.set_xlabel("game")
            axes.xaxis.set_tick_params(labelbottom=True)
        plain(axes, "y")
    return figure


def _look(panel: _Panel, name: str, seasons: str) -> tuple[str, str, Dashes]:
    """Label, colour and line of a curve."""
    if panel.of == "opponent":
        team = TEAMS["human" if name == PERSON else name]
        return f"against {_named(name)} ({seasons})", team.colour, team.dashes
    return (f"{name} ({seasons})", *_BASE) if name == panel.base else ("with the change", *_VARIED)


def _named(opponent: str) -> str:
    """An opponent in a legend."""
    return "people" if opponent == PERSON else called(opponent).replace(" (", ", ").rstrip(")")


def _seasons(curve: pl.DataFrame) -> str:
    """Number of seasons of a curve in words, the greatest over its games."""
    seasons = int(curve["seasons"].max() or 0)  # type: ignore[arg-type]
    return f"{seasons} season{'s' if seasons > 1 else ''}"


def _draw(axes: Axes, curve: pl.DataFrame, label: str, colour: str, line: Dashes) -> None:
    """Draw one curve with its band."""
    rows = curve.sort("game")
    low, high = (rows[end].fill_null(math.nan).to_numpy() for end in ("low", "high"))
    axes.fill_between(rows["game"], low, high, color=colour, alpha=0.16, linewidth=0, zorder=3)
    axes.plot(rows["game"], rows["mean"], color=colour, linestyle=line, linewidth=1.8, zorder=4,
              marker="o" if rows.height == 1 else "", label=label)


def _keyed(figure: Figure, columns: int = 3) -> Figure:
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
