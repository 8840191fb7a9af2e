"""A match over time as SVG: who has the ball, where it is, and who is on top."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from markupsafe import Markup

from pitchlore.pipeline.views.commentary.words import with_minus
from pitchlore.pipeline.views.scout.swings import BalanceLine, Swing

#: Blank parts of a strip, side by side, that a word fits into.
_WORD = 4
#: Times under a strip: steps in seconds, and how many there are at most.
_STEPS, _TIMES = (10, 30, 60, 120, 300, 600, 1200), 8


#: Values at which the scale of the line of who is on top may end, and its height in pixels.
_SCALES, _PIXELS = (0.1, 0.2, 0.4, 0.6, 0.8, 1.0), 150
#: Of numbers at swings: height in pixels, hundredths of the line that two side by side are apart (on a
#: phone), and heights by which one gives way to others, the first that is free of them.
_NUMBER, _APART, _ROWS = 16, 6.0, (0, 1, -1, 2, -2, 3, -3)


class GoalLine(NamedTuple):
    """A goal in a picture over time.

    Attributes:
        at: its place in the match, 0 to 1.
        team: home or away; empty where nobody knows.
        says: text shown when it is pointed at.
        link: where it leads.
    """

    at: float
    team: str
    says: str
    link: str = ""


def over_time(
    shares: Sequence[float | None], goals: Sequence[GoalLine], label: str, seconds: float,
    blank: str,
) -> Markup:
    """Home's share in each part of a match as bars about one half, the goals above and below, and times.

    Args:
        shares: home's share in each part, 0 to 1; None where nobody had any.
        goals: the goals.
        label: description for readers of the page.
        seconds: duration of the match.
        blank: words for parts without a share.
    """
    wide = 100 / max(len(shares), 1)
    words = []
    parts = [Markup('<svg class="strip" role="img" aria-label="{}" viewBox="0 0 100 24" '
                    'preserveAspectRatio="none">').format(label)]
    halves: dict[str, str] = {"home": "", "away": ""}
    for place, share in enumerate(shares):
        if share is not None:
            home = round(20 * share, 2)
            for side, top, high in (("home", 2.0, home), ("away", 2 + home, 20 - home)):
                halves[side] += (f"M{place * wide:.4g} {top:.4g}h{wide * 0.92:.4g}"
                                 f"v{high:.4g}h{-wide * 0.92:.4g}z")
    parts += [Markup('<path class="{}" d="{}"/>').format(side, drawn) for side, drawn in halves.items()]
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
    lines: dict[str, str] = {}
    for at, team, says, _ in goals:
        line = f"M{100 * at:.4g} {12 * (team == 'away')}V{24 - 12 * (team == 'home')}"
        lines[says] = lines.get(says, "") + line
    parts += [Markup('<path class="goal-at" d="{}"><title>{}</title></path>').format(drawn, says)
              for says, drawn in lines.items()]
    return Markup('<div class="over-time">{}<div class="words" aria-hidden="true">{}</div>'
                  '<div class="times" aria-hidden="true">{}</div></div>').format(
        Markup("").join([*parts, Markup("</svg>")]), Markup("").join(words), _times(seconds))


def on_top(
    played: Sequence[BalanceLine], goals: Sequence[GoalLine], label: str, seconds: float,
    half: float | None = None, swings: Sequence[Swing] = (),
) -> Markup:
    """Home's chance to score soon less that of away as a line about zero, with a scale and with goals.

    The line is broken at each restart, and wherever V is unknown.

    Args:
        played: stretches of play, each a line of its own.
        goals: the goals, above and below; each leads to its link.
        label: description for readers of the page.
        seconds: duration of the match.
        half: place of half-time in the match, 0 to 1; None without one.
        swings: changes that are marked on the line, with a number each, in their order.
    """
    greatest = max((float(np.abs(it.v).max()) for it in played), default=0.0)
    most = next((each for each in _SCALES if greatest <= each), 1.0)
    lines, areas = "", {"home": "", "away": ""}

    def at(t_ns: float, v: float) -> tuple[float, float]:
        return 100 * t_ns / 1e9 / max(seconds, 1e-9), 20 - 20 * v / most

    for t_ns, v in played:
        points = [at(*point) for point in zip(t_ns.tolist(), v.tolist(), strict=True)]
        lines += "M" + "L".join(f"{x:.4g} {y:.4g}" for x, y in points) + ("h.01" if len(points) == 1 else "")
        for side, held in (("home", min), ("away", max)):
            top = "L".join(f"{x:.4g} {held(y, 20.0):.4g}" for x, y in points)
            areas[side] += f"M{points[0][0]:.4g} 20L{top}L{points[-1][0]:.4g} 20Z"
    parts = [Markup('<svg class="strip top" role="group" aria-label="{}" viewBox="0 0 100 40" '
                    'preserveAspectRatio="none">').format(label)]
    parts.append(Markup('<path class="grid" d="M0 10H100M0 30H100"/>'))
    if half is not None:
        parts.append(Markup('<path class="grid" d="M{:.4g} 0V40"><title>half-time</title></path>').format(
            100 * half))
    parts += [Markup('<path class="{}" d="{}"/>').format(side, drawn) for side, drawn in areas.items()]
    parts.append(Markup('<path class="half" d="M0 20H100"/><path class="swing" d="{}"/>').format(lines))
    for goal in goals:
        begin, end = (0, 20) if goal.team == "home" else (20, 40) if goal.team == "away" else (0, 40)
        line = Markup('d="M{:.4g} {}V{}"').format(100 * goal.at, begin, end)
        parts.append(Markup(
            '<a href="{}" aria-label="{}"><title>{}</title><path class="hit" {}/>'
            '<path class="goal-at {}" {}/></a>').format(
                goal.link, goal.says, goal.says, line, goal.team, line))
    words, taken = [], list[tuple[float, float]]()
    for number, swing in enumerate(swings, 1):
        (x, y), (to_x, to_y) = at(swing.start_ns, swing.before), at(swing.end_ns, swing.after)
        parts.append(Markup('<path class="swung {}" d="M{:.5g} {:.4g}h0M{:.5g} {:.4g}h0"/>').format(
            swing.side, x, y, to_x, to_y))
        beside = _PIXELS / 40 * to_y - (_NUMBER + 2 if to_y < y else -3)
        tops = [min(max(beside + rows * (_NUMBER + 1), 0), _PIXELS - _NUMBER) for rows in _ROWS]
        free = next((each for each in tops if all(
            abs(to_x - left) > _APART or abs(each - over) >= _NUMBER for left, over in taken)), tops[0])
        taken.append((to_x, free))
        words.append(Markup('<span class="nth" style="left:{:.2f}%;top:{:.0f}px">{}</span>').format(
            to_x, free, number))
    scale = Markup("").join(Markup("<span>{}</span>").format(
        with_minus(f"{part * most:+.3g}") if part else "0")
                            for part in (1, 0.5, 0, -0.5, -1))
    return Markup('<div class="over-time scaled"><div class="scale" aria-hidden="true">{}</div>{}'
                  '{}<div class="times" aria-hidden="true">{}</div></div>').format(
        scale, Markup("").join([*parts, Markup("</svg>")]), Markup("").join(words), _times(seconds))


def spark(values: Sequence[float | None], label: str) -> Markup:
    """A number's way over matches as a small line from the least to the greatest; unknown values cut it."""
    known = [value for value in values if value is not None]
    low, high = min(known, default=0.0), max(known, default=0.0)
    wide, drawn, pen = 100 / max(len(values) - 1, 1), "", "M"
    for place, value in enumerate(values):
        if value is None:
            pen = "M"
            continue
        drawn += f"{pen}{place * wide:.4g} {18 - 16 * (value - low) / ((high - low) or 1.0):.3g}"
        pen = "L"
    return Markup('<svg class="spark" role="img" aria-label="{}" viewBox="-2 0 104 20" '
                  'preserveAspectRatio="none"><path d="{}"/></svg>').format(label, drawn)


def _times(seconds: float) -> Markup:
    """Minutes and seconds at their places under a strip, the end left out."""
    step = next((each for each in _STEPS if seconds <= _TIMES * each), max(seconds / _TIMES, 1.0))
    at = np.arange(0.0, seconds, step)
    return Markup("").join(
        Markup('<span style="left:{:.2f}%">{}:{:02d}</span>').format(
            100 * each / seconds, int(each) // 60, int(each) % 60) for each in at if each <= 0.96 * seconds)
