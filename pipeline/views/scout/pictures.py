"""Pictures as SVG, which take their colours from the page's style sheet: light, dark and in print."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup, escape

from pipeline.arrays import F64
from pipeline.pitch import Pitch

#: Cells of a heat map along and across the pitch.
CELLS = (24, 16)
#: From so many marks on, marks are small, thin and see-through.
MANY = 80
#: Faintest cell of a heat map, so that it is seen on light and on dark ground.
_FAINTEST = 0.09
#: Shades of a heat map, and the least share of its fullest cell that is drawn.
_SHADES, _LEAST = 20, 0.02
#: Blank parts of a strip, side by side, that a word fits into.
_WORD = 4
#: Times under a strip: steps in seconds, and how many there are at most.
_STEPS, _TIMES = (10, 30, 60, 120, 300, 600, 1200), 8


class Mark(NamedTuple):
    """A mark on a pitch.

    Attributes:
        x, y: place, metres; the team that the picture is of attacks to the right.
        style: class of the style sheet.
        says: what it says when it is pointed at.
        to: end of an arrow that begins there, None for a dot.
        link: address that it leads to.
        size: radius of a dot, or length of an arrow's head (0: a dot at its end), hundredths of the pitch.
        letter: what stands in a dot.
    """

    x: float
    y: float
    style: str
    says: str
    to: tuple[float, float] | None = None
    link: str | None = None
    size: float = 0.0
    letter: str = ""


def pass_arrow(row: Mapping[str, Any], side: str, pitch: Pitch) -> Mark:
    """A pass as an arrow from pass to receipt; ``row`` is of schema Passes. A short one has a short head."""
    far = float(np.hypot(row["to_x"] - row["x"], row["to_y"] - row["y"])) * 100 / pitch.length
    return Mark(row["x"], row["y"], f"mark {side}", f"{row['robot']} to {row['receiver']}",
                (row["to_x"], row["to_y"]), size=max(min(2.4, 0.7 * far), 1e-3))


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
    parts.append(Markup('<circle class="chalk" r="{:.4g}"/>').format(0.09 * pitch.length))
    parts += [Markup('<path class="goal" d="M{:.4g} {:.4g}h{:.4g}v{:.4g}h{:.4g}"/>').format(
        side * x, -pitch.goal_width / 2, side * depth, pitch.goal_width, -side * depth) for side in (-1, 1)]
    parts += [_mark(mark, unit) for mark in marks]
    return Markup("").join([*parts, Markup("</svg>")])


def _thirds(cells: F64) -> str:
    """How much of a heat map is in each third of the pitch, in words."""
    shares = [float(part.sum()) for part in np.array_split(cells, 3, axis=1)]
    return ", ".join(f"{share:.0%} in {name}" for share, name in zip(shares, (
        "the own third", "the middle third", "the attacking third"), strict=True))


def _cells(cells: F64, pitch: Pitch) -> Markup:
    """The cells that have samples: a path for each shade, in a group whose unit is a cell."""
    share = cells / (cells.max() or 1.0)
    wide, high = pitch.length / cells.shape[1], pitch.width / cells.shape[0]
    levels = np.where(share > _LEAST, np.ceil(_SHADES * share), 0).astype(int)
    paths = []
    for level in np.unique(levels[levels > 0]):
        drawn = "".join(f"M{column} {row}h1v1h-1z" for row, column in np.argwhere(levels == level))
        opacity = _FAINTEST + (1 - _FAINTEST) * level / _SHADES
        paths.append(f'<path opacity="{opacity:.2f}" d="{drawn}"/>')
    return Markup(  # noqa: S704 (numbers only)
        f'<g class="heat" transform="matrix({wide:.4g} 0 0 {-high:.4g} {-pitch.length / 2:.4g}'
        f' {pitch.width / 2:.4g})">{"".join(paths)}</g>')


def _mark(mark: Mark, unit: float) -> Markup:
    """A mark; y points up in metres and down in SVG."""
    # f-strings, because Markup.format takes several times as long, and a page has hundreds of marks
    style, title = escape(mark.style), f"<title>{escape(mark.says)}</title>"
    if mark.to is None:
        place = f'cx="{mark.x:.4g}" cy="{-mark.y:.4g}" r="{(mark.size or 1.1) * unit:.4g}"'
        drawn = f'<circle class="{style}" {place}>{title}</circle>'
        if mark.letter:
            drawn += (f'<text class="{style}" x="{mark.x:.4g}" y="{-mark.y:.4g}"'
                      f' font-size="{3.6 * unit:.4g}">{escape(mark.letter)}</text>')
    elif mark.size:
        drawn = _headed(mark, style, title, unit)
    else:
        x, y = mark.to
        drawn = (f'<path class="{style} way" d="M{mark.x:.4g} {-mark.y:.4g}L{x:.4g} {-y:.4g}">{title}</path>'
                 f'<circle class="{style}" cx="{x:.4g}" cy="{-y:.4g}" r="{0.7 * unit:.4g}"/>')
    if mark.link is not None:
        # the script makes the first one a Tab stop; arrow keys lead to the others
        drawn = (f'<a href="{escape(mark.link)}" aria-label="{escape(mark.says)}" tabindex="-1">{drawn}</a>')
    return Markup(drawn)  # noqa: S704 (all text in it is escaped)


def _headed(mark: Mark, style: str, title: str, unit: float) -> str:
    """An arrow with a head, which is left out if the arrow is shorter than it."""
    assert mark.to is not None
    x, y, to_x, to_y = mark.x, -mark.y, mark.to[0], -mark.to[1]
    length, head = math.hypot(to_x - x, to_y - y), mark.size * unit
    if length <= head:
        return ""
    along_x, along_y = (to_x - x) / length, (to_y - y) / length
    neck_x, neck_y, side_x, side_y = (
        to_x - head * along_x, to_y - head * along_y, -0.45 * head * along_y, 0.45 * head * along_x)
    return (f'<path class="{style} way" d="M{x:.4g} {y:.4g}L{neck_x:.4g} {neck_y:.4g}">{title}</path>'
            f'<path class="{style} head" d="M{to_x:.4g} {to_y:.4g}L{neck_x + side_x:.4g}'
            f' {neck_y + side_y:.4g} {neck_x - side_x:.4g} {neck_y - side_y:.4g}Z"/>')


def over_time(
    shares: Sequence[float | None], goals: Sequence[tuple[float, str, str]], label: str, seconds: float,
    blank: str,
) -> Markup:
    """Home's share in each part of a match as bars about one half, the goals above and below, and times.

    Args:
        shares: of home in each part, 0 to 1; None where nobody had any.
        goals: of each the place in the match, 0 to 1, the team, and what it says.
        label: what it shows.
        seconds: of the match.
        blank: what is said of parts without a share.
    """
    wide = 100 / max(len(shares), 1)
    words = []
    parts = [Markup('<svg class="strip" role="img" aria-label="{}" viewBox="0 0 100 24" '
                    'preserveAspectRatio="none">').format(label)]
    for place, share in enumerate(shares):
        if share is not None:
            home = 20 * share
            parts.append(Markup(
                '<rect class="home" x="{0:.3f}" y="2" width="{1:.3f}" height="{2:.2f}"/>'
                '<rect class="away" x="{0:.3f}" y="{3:.2f}" width="{1:.3f}" height="{4:.2f}"/>').format(
                    place * wide, wide * 0.92, home, 2 + home, 20 - home))
    first = 0
    for missing, group in groupby(shares, lambda share: share is None):
        begin, count = first, len(list(group))
        first += count
        if not missing:
            continue
        parts.append(Markup('<rect class="blank" x="{:.3f}" y="2" width="{:.3f}" height="20">'
                            '<title>{}</title></rect>').format(begin * wide, count * wide, blank))
        if count >= _WORD:
            words.append(Markup('<span style="left:{:.2f}%;width:{:.2f}%">{}</span>').format(
                begin * wide, count * wide, blank))
    parts.append(Markup('<path class="half" d="M0 12H100"/>'))
    parts += [Markup('<path class="goal-at" d="M{:.3f} {}V{}"><title>{}</title></path>').format(
        100 * at, 12 * (team == "away"), 24 - 12 * (team == "home"), says) for at, team, says in goals]
    return Markup('<div class="over-time">{}<div class="words" aria-hidden="true">{}</div>'
                  '<div class="times" aria-hidden="true">{}</div></div>').format(
        Markup("").join([*parts, Markup("</svg>")]), Markup("").join(words), _times(seconds))


def _times(seconds: float) -> Markup:
    """Minutes and seconds at their places under a strip, the end left out."""
    step = next((each for each in _STEPS if seconds <= _TIMES * each), max(seconds / _TIMES, 1.0))
    at = np.arange(0.0, seconds, step)
    return Markup("").join(
        Markup('<span style="left:{:.2f}%">{}:{:02d}</span>').format(
            100 * each / seconds, int(each) // 60, int(each) % 60) for each in at if each <= 0.96 * seconds)


def bars(values: Sequence[float], label: str) -> Markup:
    """Small bars side by side, the greatest of full height."""
    most = max(values, default=0.0) or 1.0
    wide = 100 / max(len(values), 1)
    bar = Markup('<rect class="heat" x="{:.3f}" y="{:.2f}" width="{:.3f}" height="{:.2f}"/>')
    drawn = [bar.format(place * wide, 20 * (1 - value / most), wide * 0.94, 20 * value / most)
             for place, value in enumerate(values)]
    return Markup('<svg class="bars" role="img" aria-label="{}" viewBox="0 0 100 20" '
                  'preserveAspectRatio="none">{}</svg>').format(label, Markup("").join(drawn))
