"""Pictures as SVG, which take their colours from the page's style sheet: light, dark and in print."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from markupsafe import Markup, escape

from pitchlore.pipeline.game.pitch import MARKINGS, Pitch
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.views.commentary.words import percent

#: Cells of a heat map along and across the pitch.
CELLS = (24, 16)
#: From so many marks on, marks are small, thin and see-through.
MANY = 80
#: Up to so many passes have an arrow each.
SINGLE = 30
#: Zones along and across the pitch by which more passes are put together, and ways from zone to zone drawn.
ZONES, WAYS_DRAWN = (6, 3), 24
#: Faintest cell of a heat map, so that it is seen on light and on dark ground.
_FAINTEST = 0.09
#: Shades of a heat map, and the least share of its fullest cell that is drawn.
_SHADES, _LEAST = 12, 0.02


class Mark(NamedTuple):
    """A mark on a pitch.

    Attributes:
        x, y: place, metres; the team that the picture is of attacks to the right.
        style: class of the style sheet.
        says: text shown when it is pointed at.
        to: end of an arrow that begins there, None for a dot.
        link: address that it leads to.
        size: radius of a dot, or length of an arrow's head (0: a dot at its end), hundredths of the pitch.
        letter: text in a dot.
        width: width of an arrow's line, hundredths of the pitch (0: that of the style).
    """

    x: float
    y: float
    style: str
    says: str
    to: tuple[float, float] | None = None
    link: str | None = None
    size: float = 0.0
    letter: str = ""
    width: float = 0.0


def pass_arrow(row: Mapping[str, Any], side: str, pitch: Pitch) -> Mark:
    """A pass as an arrow from pass to receipt; ``row`` is of schema Passes. A short one has a short head."""
    far = float(np.hypot(row["to_x"] - row["x"], row["to_y"] - row["y"])) * 100 / pitch.length
    return Mark(row["x"], row["y"], f"mark {side}", f"{row['robot']} to {row['receiver']}",
                (row["to_x"], row["to_y"]), size=max(min(2.4, 0.7 * far), 1e-3))


def passes_drawn(passes: pl.DataFrame, side: str, pitch: Pitch) -> tuple[list[Mark], str]:
    """Arrows of passes, and what they are in a sentence; of many one for all that lead from zone to zone.

    Args:
        passes: rows of schema Passes of a team.
        side: class of the style sheet that has its colour.
        pitch: pitch of the matches.
    """
    if passes.height <= SINGLE:
        return ([pass_arrow(row, side, pitch) for row in passes.iter_rows(named=True)],
                "Arrows lead from pass to receipt.")
    ends = [("x", pitch.length, ZONES[0]), ("y", pitch.width, ZONES[1]),
            ("to_x", pitch.length, ZONES[0]), ("to_y", pitch.width, ZONES[1])]
    zones = [((pl.col(name) / span + 0.5) * count).floor().clip(0, count - 1).alias(f"{name}_zone")
             for name, span, count in ends]
    ways = passes.group_by(zones).agg(pl.col("x", "y", "to_x", "to_y").mean(), pl.len()).sort(
        "len", *(f"{name}_zone" for name, *_ in ends), descending=[True, *(False for _ in ends)])
    drawn = ways.head(WAYS_DRAWN).filter(pl.col("len") > 1)
    most = max(drawn["len"].to_list(), default=1)
    marks = [Mark(x, y, f"mark {side}", f"{n} passes", (to_x, to_y), size=1.6 + 1.6 * n / most,
                  width=1.6 * n / most)
             for x, y, to_x, to_y, n in drawn.select("x", "y", "to_x", "to_y", "len").iter_rows()]
    left = passes.height - int(drawn["len"].sum())
    return marks, (f"An arrow stands for all passes from one of {ZONES[0] * ZONES[1]} parts of the pitch to"
                   f" another: the wider, the more. Passes of rarer ways are left out: {left}.")


def heat(x: F64, y: F64, pitch: Pitch) -> F64:
    """Share of samples in each cell, float64 [cells across, cells along], from places in metres [n]."""
    counts, _, _ = np.histogram2d(y, x, bins=CELLS[::-1], range=[
        [-pitch.width / 2, pitch.width / 2], [-pitch.length / 2, pitch.length / 2]])
    cells: F64 = counts / max(counts.sum(), 1.0)
    return cells


def on_pitch(
    pitch: Pitch, label: str, *, marks: Iterable[Mark] = (), cells: F64 | None = None,
    under: Markup | None = None,
) -> Markup:
    """A pitch with marks, and perhaps a heat map, or what is ``under`` the lines, beneath them."""
    x, y = pitch.length / 2, pitch.width / 2
    depth = pitch.goal_depth
    unit = pitch.length / 100
    marks = list(marks)
    if cells is not None:
        label = f"{label}: {_thirds(cells)}"
    role = "img" if all(mark.link is None for mark in marks) else "group"
    parts = [Markup(
        '<svg class="pitch{}" role="{}" aria-label="{}" viewBox="{:.4g} {:.4g} {:.4g} {:.4g}" '
        'style="--unit:{:.4g}">'
    ).format(" many" if len(marks) >= MANY else "", role, label,
             -x - depth - unit, -y - unit, 2 * (x + depth + unit), 2 * (y + unit), unit)]
    parts.append(Markup('<rect class="grass" x="{:.4g}" y="{:.4g}" width="{:.4g}" height="{:.4g}"/>').format(
        -x, -y, 2 * x, 2 * y))
    if cells is not None:
        parts.append(_cells(cells, pitch))
    if under is not None:
        parts.append(under)
    parts.append(Markup('<path class="chalk" d="M0 {:.4g}V{:.4g}"/>').format(-y, y))
    parts.append(Markup('<circle class="chalk" r="{:.4g}"/>').format(MARKINGS[pitch.kind].circle))
    parts += [Markup('<path class="goal" d="M{:.4g} {:.4g}h{:.4g}v{:.4g}h{:.4g}"/>').format(
        side * x, -pitch.goal_width / 2, side * depth, pitch.goal_width, -side * depth) for side in (-1, 1)]
    parts += _drawn(marks, unit)
    return Markup("").join([*parts, Markup("</svg>")])


def _thirds(cells: F64) -> str:
    """How much of a heat map is in each third of the pitch, in words."""
    shares = [float(part.sum()) for part in np.array_split(cells, 3, axis=1)]
    return ", ".join(f"{percent(share)} in {name}" for share, name in zip(shares, (
        "the own third", "the middle third", "the attacking third"), strict=True))


def _cells(cells: F64, pitch: Pitch) -> Markup:
    """The cells that have samples: for each shade the runs of its rows, as lines one cell wide."""
    share = cells / (cells.max() or 1.0)
    wide, high = pitch.length / cells.shape[1], pitch.width / cells.shape[0]
    levels = np.where(share > _LEAST, np.ceil(_SHADES * share), 0).astype(int)
    edges = np.diff(levels, axis=1, prepend=0, append=0) != 0
    runs: dict[int, str] = {}
    for row, ends in enumerate(edges):
        for first, last in pairwise(np.flatnonzero(ends).tolist()):
            level = int(levels[row, first])
            runs[level] = runs.get(level, "") + f"M{first} {row}h{last - first}"
    paths = (f'<path stroke-opacity="{_FAINTEST + (1 - _FAINTEST) * level / _SHADES:.2f}" d="{runs[level]}"/>'
             for level in sorted(runs.keys() - {0}))
    return Markup(  # noqa: S704 (numbers only)
        f'<g class="heat" transform="matrix({wide:.4g} 0 0 {-high:.4g} {-pitch.length / 2:.4g}'
        f' {(pitch.width - high) / 2:.4g})">{"".join(paths)}</g>')


class _Pen(NamedTuple):
    """Writes shapes in the units of a pitch; y points up in metres and down in SVG.

    Attributes:
        unit: a hundredth of the pitch, metres.
        digits: after the point, so that a tenth of a unit shows.
    """

    unit: float
    digits: int

    def number(self, metres: float) -> str:
        """A number without zeros that say nothing."""
        text = f"{round(metres, self.digits) + 0.0:.{self.digits}f}"  # no minus before a zero
        if self.digits:
            text = text.rstrip("0").rstrip(".")
        return re.sub(r"^(-?)0\.", r"\1.", text)

    def at(self, x: float, y: float) -> str:
        """A place in a path."""
        return f"{self.number(x)} {self.number(-y)}"

    def dot(self, x: float, y: float, size: float) -> str:
        """A circle; ``size`` is in units."""
        place = f'cx="{self.number(x)}" cy="{self.number(-y)}" r="{self.number(size * self.unit)}"'
        return f"<circle {place}/>"

    def shape(self, mark: Mark) -> str:
        """Shapes of a mark."""
        if mark.to is None:
            drawn = self.dot(mark.x, mark.y, mark.size or 1.1)
            if mark.letter:
                drawn += (f'<text x="{self.number(mark.x)}" y="{self.number(-mark.y)}"'
                          f' font-size="{self.number(3.6 * self.unit)}">{escape(mark.letter)}</text>')
            return drawn
        if mark.size:
            return self._headed(mark.x, mark.y, *mark.to, mark.size * self.unit, mark.width * self.unit)
        return (f'<path class="way" d="M{self.at(mark.x, mark.y)}L{self.at(*mark.to)}"/>'
                f"{self.dot(*mark.to, 0.7)}")

    def _headed(self, x: float, y: float, to_x: float, to_y: float, head: float, width: float) -> str:
        """An arrow with a head, which is left out if the arrow is shorter than it."""
        length = math.hypot(to_x - x, to_y - y)
        if length <= head:
            return ""
        along_x, along_y = (to_x - x) / length, (to_y - y) / length
        neck_x, neck_y, side_x, side_y = (
            to_x - head * along_x, to_y - head * along_y, -0.45 * head * along_y, 0.45 * head * along_x)
        wide = f' style="stroke-width:{self.number(width)}"' if width else ""
        return (f'<path class="way"{wide} d="M{self.at(x, y)}L{self.at(neck_x, neck_y)}"/>'
                f'<path class="head" d="M{self.at(to_x, to_y)}L{self.at(neck_x + side_x, neck_y + side_y)}'
                f' {self.at(neck_x - side_x, neck_y - side_y)}Z"/>')


def _drawn(marks: Iterable[Mark], unit: float) -> Iterator[Markup]:
    """The marks: in a group for each style, in it a group for those that say the same, or a link for each."""
    pen = _Pen(unit, max(0, math.ceil(-math.log10(unit / 10))))
    styles: dict[str, dict[tuple[str, str | None], list[str]]] = {}
    for mark in marks:
        if shape := pen.shape(mark):
            styles.setdefault(mark.style, {}).setdefault((mark.says, mark.link), []).append(shape)
    for style, groups in styles.items():
        # f-strings, because Markup.format takes several times as long, and a page has hundreds of marks
        drawn = []
        for (says, link), shapes in groups.items():
            tag, address = ("g", "") if link is None else ("a", f' href="{escape(link)}"')
            drawn.append(f"<{tag}{address}><title>{escape(says)}</title>{''.join(shapes)}</{tag}>")
        yield Markup(f'<g class="{escape(style)}">{"".join(drawn)}</g>')  # noqa: S704 (all text in it is escaped)


def bars(values: Sequence[float], label: str) -> Markup:
    """Small bars side by side, the greatest of full height."""
    most = max(values, default=0.0) or 1.0
    wide = 100 / max(len(values), 1)
    drawn = "".join(
        f"M{place * wide:.4g} 20v{-20 * value / most:.3g}h{wide * 0.94:.4g}V20z"
        for place, value in enumerate(values) if value)
    return Markup('<svg class="bars" role="img" aria-label="{}" viewBox="0 0 100 20" '
                  'preserveAspectRatio="none"><path d="{}"/></svg>').format(label, drawn)
