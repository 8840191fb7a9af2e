"""Plots of section 5 of the paper: Figures 4 to 7, and the sensitivity to readings of its text."""

from __future__ import annotations

import math
from itertools import pairwise
from textwrap import fill
from typing import Any, NamedTuple

import polars as pl
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator
from matplotlib.transforms import ScaledTranslation

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.stages.paradigms.claims import PEAK
from pitchlore.pipeline.stages.paradigms.experiments import OTHER_GAMES, FigureNumber
from pitchlore.pipeline.stages.paradigms.readings import informative
from pitchlore.pipeline.views.plots.style import COLOURS, Dashes, plain, plot_png

#: Colour and marker of each learner, the same in all figures. IQ's family is blue. WoLF-PHC's is Okabe and
#: Ito's yellow, darkened for white paper. The markers alone tell all learners apart.
_LEARNERS = {
    "IQ": ("#0072B2", "o"), "IL-A": ("#56B4E9", "^"), "IL-B": ("#0072B2", "v"),
    "JAQ": ("#009E73", "s"), "IVQ": ("#D55E00", "D"),
    "hysteretic": ("#CC79A7", "P"), "FMQ": ("#E69F00", "X"), "lenient": ("#000000", "*"),
    "distributed": ("#7F7F7F", "h"), "WoLF-PHC": ("#A08A00", "<"),
}
_PAPERS = ("IQ", "IL-A", "IL-B", "JAQ", "IVQ")
_STRANGERS = tuple((colour, marker) for marker in (">", "p", "d", "8") for colour in COLOURS)

#: Lines of a learner's readings, in their order; all but the first have hollow markers.
_LINES: tuple[Dashes, ...] = ("solid", (0, (5, 2)), (0, (1.2, 1.2)), (0, (5, 2, 1.2, 2)))
_THIN_LINES: tuple[Dashes, ...] = ((0, (3, 1.5)), (0, (1, 1.5)), (0, (3, 1.5, 1, 1.5)), (0, (8, 2)))


class _Look(NamedTuple):
    """Look of a learner under one reading: label, whether the paper has it, keywords for its line."""

    label: str
    prominent: bool
    line: dict[str, Any]


#: Look of each learner and reading.
_Looks = dict[tuple[str, str], _Look]


def _looks(points: pl.DataFrame) -> _Looks:
    """Look of each learner and reading in a table, the paper's learners first."""
    pairs = sorted(points.select("learner", "reading").unique().iter_rows(), key=_place)
    strangers = [name for name in dict(pairs) if name not in _LEARNERS]
    looks: _Looks = {}
    for learner, reading in pairs:
        rank = sum(known == learner for known, _ in looks)
        colour, marker = _LEARNERS.get(learner) or _STRANGERS[strangers.index(learner) % len(_STRANGERS)]
        prominent = learner in _PAPERS
        lines = _LINES if prominent else _THIN_LINES
        label = fill(f"{learner}, {reading}", 62, subsequent_indent="  ", break_on_hyphens=False)
        looks[learner, reading] = _Look(label, prominent, {
            "color": colour, "marker": marker, "linestyle": lines[rank % len(lines)],
            "linewidth": 1.8 if prominent else 1.0,
            "markersize": (6 if prominent else 4.5) + (1.5 if marker == "*" else 0),
            "markerfacecolor": "white" if rank else colour,
            "markeredgecolor": colour, "markeredgewidth": 1.2 if rank else 0.6,
        })
    return looks


def _place(pair: tuple[str, str]) -> tuple[int, str, bool, str]:
    """Sort key: the paper's learners in its order, then the others; the printed reading first."""
    learner, reading = pair
    known = list(_LEARNERS)
    return known.index(learner) if learner in known else len(known), learner, reading != "printed", reading


class _Figure(NamedTuple):
    """A figure of the paper, in columns of schema Paradigms.

    Attributes:
        points: figure that the points are filed under.
        over: column of the horizontal axis, k or decay; the other one makes the panels.
        of: columns of the vertical axis: the value, and the ends of its interval.
    """

    game: str
    points: int
    over: str
    of: tuple[str, str, str]
    axes: tuple[str, str]


_P = ("p_optimal", "p_low", "p_high")
_PATH = ("path_length", "path_low", "path_high")
_FIGURES = {
    4: _Figure("penalty", 4, "k", _P, ("penalty k", "P(optimal)")),
    5: _Figure("climbing", 5, "decay", _P, ("temperature decay (log scale of 1 − decay)", "P(optimal)")),
    6: _Figure("grid", 6, "k", _P, ("penalty k", "P(reaching (3, 3))")),
    7: _Figure("grid", 6, "k", _PATH, ("penalty k", "steps to (3, 3), at best 4")),
}

#: Inches from the horizontal axis down to the legend, below the labels of k or of decays.
_BELOW = {"k": 0.5, "decay": 0.95}

#: Steps of the shortest path in the grid world.
_SHORTEST = 4


def plots_of_points(points: pl.DataFrame, figure: FigureNumber) -> dict[str, bytes]:
    """Plots of a figure's points as PNG, by name: the figure (6 stands for 6 and 7), other games, readings.

    Args:
        points: schema Paradigms, of one figure.
        figure: figure that the points are filed under.
    """
    drawn = points.filter(pl.col("study") == "figure")
    plots = {f"figure-{number}": plot_curves(drawn, number, paper=PEAK)
             for number in ((6, 7) if figure == 6 else (figure,))}
    for game in sorted(set(drawn["game"]) & set(OTHER_GAMES)):
        plots[f"figure-5-{game.split()[0]}"] = plot_curves(drawn, 5, game=game)
    if points["study"].eq("sensitivity").any():
        plots["sensitivity"] = plot_sensitivity(informative(points))
    return {name: plot_png(plot) for name, plot in plots.items()}


def plot_curves(
    points: pl.DataFrame, figure: int, *, game: str | None = None,
    paper: tuple[float, float, float, float] | None = None,
) -> Figure:
    """The paper's Figure 4, 5, 6 or 7: a curve for each learner and reading, with 95 % intervals.

    The paper's learners are on the left; the others are on the right, with thin broken lines. Figures over k
    have a row of panels for each decay. A learner has the same colour and marker in all figures. A reading
    has the same line in all figures of one table. Points are moved aside a little, so that none hides
    another. Intervals of path lengths are cut off at the frame. Only the points of the most trainings are
    drawn.

    Args:
        points: schema Paradigms; those of the study ``figure`` are drawn.
        figure: 4, 5, 6 or 7.
        game: name of a game other than the paper's, filed under this figure.
        paper: the paper's point of Figure 5 (ignored elsewhere): decay, probability, its interval.

    Raises:
        NotFound: if there is no such point.
    """
    kind = _FIGURES[figure]
    game = game or kind.game
    known = points.filter(pl.col("study") == "figure")
    rows = known.filter((pl.col("figure") == kind.points) & (pl.col("game") == game))
    runs = max(rows["runs"], default=0)
    rows = rows.filter(pl.col("runs") == runs)
    if not len(rows):
        raise NotFound(f"there are no points of the {game} game to draw", where=f"Figure {figure}",
                       next_step=f"Make them with `pitchlore paradigms --figure {figure}`")
    present = set(rows.select("learner", "reading").iter_rows())
    groups = _groups({pair: look for pair, look in _looks(known).items() if pair in present})
    panels = {"": rows} if kind.over == "decay" else {
        f"({chr(ord('a') + index)}) temperature decay {decay:g}": rows.filter(pl.col("decay") == decay)
        for index, decay in enumerate(sorted(rows["decay"].unique()))
    }
    drawn = Figure(figsize=(10, _height(len(panels), groups)), layout="constrained")
    grid = drawn.subplots(len(panels), len(groups), sharex=True, sharey=True, squeeze=False)
    for line, (title, panel) in zip(grid, panels.items(), strict=True):
        for axes, group in zip(line, groups.values(), strict=True):
            _draw_curves(axes, panel, kind, group, width=620 / len(groups))
            axes.set_title(title, loc="left", fontsize=10)
        line[0].set_ylabel(kind.axes[1])
    _scale(grid[0, 0], rows, kind)
    for axes, (title, group) in zip(grid[-1], groups.items(), strict=True):
        axes.set_xlabel(kind.axes[0])
        if kind.over == "decay":
            axes.tick_params(axis="x", rotation=60, labelsize=8)
        handles: list[Any] = [Line2D([], [], label=look.label, **look.line) for look in group.values()]
        if paper is not None and figure == 5 and axes is grid[-1, 0]:
            handles.append(_draw_paper(axes, *paper))
        below = axes.transAxes + ScaledTranslation(0, -_BELOW[kind.over], drawn.dpi_scale_trans)
        axes.legend(handles=handles, title=title, loc="upper left", bbox_to_anchor=(0, 0),
                    bbox_transform=below, frameon=False, fontsize=8.5, title_fontsize=8.5,
                    handlelength=5, alignment="left", borderpad=0)
    drawn.suptitle(f"Figure {figure}, {game} game: {runs:,} trainings a point, bars are 95 % intervals",
                   fontsize=11, x=0.01, ha="left")
    return drawn


def _groups(looks: _Looks) -> dict[str, _Looks]:
    """Looks of each column of panels, by the title of its legend; no column is empty."""
    prominent = {pair: look for pair, look in looks.items() if look.prominent}
    others = {pair: look for pair, look in looks.items() if not look.prominent}
    return {title: group for title, group in
            (("the paper's learners, reading", prominent), ("other learners, settings", others)) if group}


def _height(panels: int, groups: dict[str, _Looks]) -> float:
    """Height of the figure, inches: rows of panels and the longest legend below."""
    lines = max(sum(1.2 + look.label.count("\n") for look in group.values()) for group in groups.values())
    return (1.5 if panels == 1 else 1.0) + 2.5 * max(panels, 1.5) + 0.16 * lines


def _abscissa(values: pl.Series, over: str) -> list[float]:
    """Horizontal positions: k itself; for a decay the steps in which the temperature falls to 1/e."""
    return [1 / max(1 - x, 1e-9) if over == "decay" else x for x in values]


def _draw_curves(axes: Axes, rows: pl.DataFrame, kind: _Figure, looks: _Looks, *, width: float) -> None:
    """Draw one panel, about ``width`` points wide, without its scales."""
    step = _room(rows[kind.over], kind.over, width) / max(len(looks), 1)
    inches = axes.figure.dpi_scale_trans
    for place, ((learner, reading), look) in enumerate(looks.items()):
        curve = rows.filter(learner=learner, reading=reading).drop_nulls(kind.over).sort(kind.over)
        x = _abscissa(curve[kind.over], kind.over)
        aside = min(step, 5.0) * (place - (len(looks) - 1) / 2) / 72
        where = axes.transData + ScaledTranslation(aside, 0, inches)
        value, low, high = (curve[name].cast(pl.Float64).fill_null(math.nan).to_numpy()
                            for name in kind.of)
        level = 4 if look.prominent else 3
        axes.vlines(x, low, high, transform=where, color=look.line["color"], alpha=0.5, zorder=level - 2,
                    linewidth=1.8 if look.prominent else 1.2)
        axes.plot(x, value, transform=where, zorder=level, **look.line)
    plain(axes, "y")


def _room(values: pl.Series, over: str, width: float) -> float:
    """Length that neighbours' markers may fill, in points: a share of the least distance between them."""
    x = _abscissa(values.drop_nulls().unique().sort(), over)
    if over == "decay":
        x = [math.log(each) for each in x]
    gaps = [b - a for a, b in pairwise(x)]
    share = 1.0 if over == "decay" else 0.8
    return share * width * min(gaps) / (x[-1] - x[0]) if gaps else width


def _draw_paper(axes: Axes, decay: float, p: float, low: float, high: float) -> ErrorbarContainer:
    """Draw the paper's own point, behind the others."""
    x = _abscissa(pl.Series([decay]), "decay")
    return axes.errorbar(x, [p], [[p - low], [high - p]], fmt="o", color="0.25", markerfacecolor="white",
                         markersize=11, capsize=6, linewidth=1.4, zorder=1.5,
                         label=f"the paper's IVQ: {p:g} at {decay:g}\n  (100 runs: {low:.2f} to {high:.2f})")


def _scale(axes: Axes, rows: pl.DataFrame, kind: _Figure) -> None:
    """Set limits and ticks, which all panels share."""
    if kind.of == _P:
        axes.set_ylim(-0.03, 1.03)
        axes.yaxis.set_major_locator(FixedLocator([0, 0.2, 0.4, 0.6, 0.8, 1]))
    else:
        seen = [value for value in rows[kind.of[0]] if value is not None]
        longest = max(seen, default=_SHORTEST)
        if longest > 5 * _SHORTEST:
            axes.set_yscale("log")
            axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 4)))
            axes.yaxis.set_minor_locator(NullLocator())
        axes.set_ylim(0.95 * _SHORTEST, max(1.1 * longest, 1.5 * _SHORTEST))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    values = rows[kind.over].drop_nulls().unique().sort()
    x = _abscissa(values, kind.over)
    if kind.over == "decay":
        axes.set_xscale("log")
        axes.set_xlim(x[0] / 1.3, x[-1] * 1.3)
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xticks(x, [f"{decay:.6g}" for decay in values])
    else:
        room = 0.04 * (x[-1] - x[0]) or 1
        limits = (x[0] - room, x[-1] + room)
        axes.set_xlim(*(reversed(limits) if x[0] < 0 else limits))  # the penalty grows to the right
        if _room(values, kind.over, 300) > 8:
            axes.set_xticks(x, [f"{k:g}" for k in x])


def plot_sensitivity(points: pl.DataFrame) -> Figure:
    """Sensitivity to readings of the text: one row for each reading, by learner, and a panel for each game.

    Args:
        points: schema Paradigms; those of the study ``sensitivity`` are drawn. Points of one reading in one
            game that differ in decay, k or runs share its row; the legend tells them apart.

    Raises:
        NotFound: if there is no such point.
    """
    known = points.filter(pl.col("study") == "sensitivity")
    if not len(known):
        raise NotFound("there are no points to draw", where="the study of sensitivity",
                       next_step="Make them with `pitchlore paradigms`")
    pairs = sorted(known.select("learner", "reading").unique().iter_rows(), key=_place)
    games = known.select("figure", "game").unique().sort("figure", "game").rows()
    learners = list(dict.fromkeys(learner for learner, _ in pairs))
    height: dict[tuple[str, str | None], float] = {}
    labels = []
    total = 0.0
    for line in (line for name in learners for line in [(name, None), *(p for p in pairs if p[0] == name)]):
        label = line[0] if line[1] is None else fill(line[1], 64)
        room = 1 + 0.75 * label.count("\n")
        height[line] = -(total + room / 2)
        labels.append(label)
        total += room
    figure = Figure(figsize=(10, 1.4 + 0.22 * max(total, 3)), layout="constrained")
    grid = figure.subplots(1, len(games), sharey=True, squeeze=False)[0]
    grid[0].set_yticks(list(height.values()), labels, fontsize=8)
    grid[0].set_ylim(-total, 0)
    for (_, reading), tick in zip(height, grid[0].get_yticklabels(), strict=True):
        tick.set_fontweight("bold" if reading is None else "normal")
    for axes, (number, game) in zip(grid, games, strict=True):
        rows = known.filter((pl.col("game") == game) & (pl.col("figure") == number))
        _draw_forest(axes, rows, height, written=len(games) == 1)
    return figure


def _draw_forest(
    axes: Axes, rows: pl.DataFrame, height: dict[tuple[str, str | None], float], *, written: bool
) -> None:
    """Draw one panel: an interval for each point; settings differ in place and colour."""
    by = ["decay", "k", "runs"]
    settings = rows.sort(by, maintain_order=True).partition_by(by, as_dict=True)
    for (_, reading), y in height.items():
        if reading is None:
            axes.axhline(y - 0.5, color="0.85", linewidth=0.8)
    for place, ((decay, k, runs), points) in enumerate(settings.items()):
        colour = "#000000" if len(settings) == 1 else COLOURS[place % len(COLOURS)]
        marker = "os^Dv<>"[place % 7]
        shift = (place - (len(settings) - 1) / 2) * 0.6 / len(settings)
        label = f"decay {decay:g}" + ("" if k is None else f", k = {k:g}") + f", {runs:,} trainings"
        for row in points.iter_rows(named=True):
            y = height[row["learner"], row["reading"]] - shift
            axes.plot([row["p_low"], row["p_high"]], [y, y], color=colour, linewidth=1.6, alpha=0.6)
            axes.plot([row["p_optimal"]], [y], color=colour, marker=marker, markersize=4.5, linestyle="",
                      label=label)
            label = "_"
            if written and len(settings) == 1:
                text = f"{row['p_optimal']:.3f} [{row['p_low']:.3f}, {row['p_high']:.3f}]"
                axes.annotate(text, (1.02, y), xycoords=("axes fraction", "data"), fontsize=7.5, va="center")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), frameon=False, fontsize=8, borderaxespad=0.2,
                title=f"{rows['game'][0]} game", alignment="left")
    axes.set_xlim(-0.03, 1.03)
    axes.set_xlabel("P(optimal), 95 % interval")
    axes.tick_params(axis="y", length=0)
    plain(axes, "x", "left")
