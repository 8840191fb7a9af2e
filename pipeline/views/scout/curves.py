"""Membership curves of fuzzy terms as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from markupsafe import Markup

from pitchlore.pipeline.views.commentary.words import with_minus

#: Size of a chart, and its margins to the left, the right, above and below the curves.
_WIDE, _HIGH = 300.0, 92.0
_LEFT, _RIGHT, _TOP, _FOOT = 20.0, 8.0, 8.0, 18.0
#: Least distance between two numbers under the axis.
_APART = 30.0


class TermCurve(NamedTuple):
    """A term: membership rises from a to b and falls from c to d.

    Attributes:
        term: its name.
        a, b, c, d: corners, in the variable's unit; None at an open end.
        rises_at, falls_at: where it crosses one half; None on the side on which it does not.
    """

    term: str
    a: float | None
    b: float | None
    c: float | None
    d: float | None
    rises_at: float | None
    falls_at: float | None


def term_chart(terms: Sequence[TermCurve], label: str) -> Markup:
    """A chart of terms of one variable: membership 0 to 1 over the variable, one line a term."""
    corners = [at for term in terms for at in (term.a, term.b, term.c, term.d) if at is not None]
    low, high = min(corners), max(corners)
    margin = 0.15 * (high - low) or 1.0
    # an angle, a distance or a time is not below 0; no angle is beyond the shoulder of its last term
    shoulders = [term.d for term in terms if term.d is not None and term.c == term.d]
    low, high = (low - margin if low < 0 else 0.0), max(shoulders, default=high + margin)

    def x(at: float) -> float:
        return _LEFT + (at - low) / (high - low) * (_WIDE - _LEFT - _RIGHT)

    def y(degree: float) -> float:
        return _HIGH - _FOOT - degree * (_HIGH - _FOOT - _TOP)

    parts = [Markup('<svg class="curve" role="img" aria-label="{}" viewBox="0 0 {:.0f} {:.0f}">').format(
        label, _WIDE, _HIGH)]
    parts.append(Markup('<path class="axis" d="M{0:.1f} {1:.1f}V{2:.1f}H{3:.1f}"/>').format(
        _LEFT, y(1), y(0), _WIDE - _RIGHT))
    parts += [Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="end">{}</text>').format(
        _LEFT - 4, y(degree) + 3, degree) for degree in (0, 1)]
    shown: list[float] = []
    half = sorted({at for term in terms for at in (term.rises_at, term.falls_at) if at is not None})
    for at in half:
        if all(abs(x(at) - x(other)) >= _APART for other in shown):
            shown.append(at)
            parts.append(Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>').format(
                x(at), _HIGH - 5, with_minus(f"{at:.3g}")))
    for place, term in enumerate(terms):
        ways = " L".join(f"{x(at):.1f} {y(degree):.1f}" for at, degree in _corners(term, low, high))
        parts.append(Markup('<path class="line-{}" d="M{}"><title>{}</title></path>').format(
            place % 6, ways, term.term))
    return Markup("").join([*parts, Markup("</svg>")])


def swatch(place: int) -> Markup:
    """The line of a term, to stand beside its name."""
    return Markup('<svg class="curve swatch" aria-hidden="true" viewBox="0 0 28 6">'
                  '<path class="line-{}" d="M0 3H28"/></svg>').format(place % 6)


def _corners(term: TermCurve, low: float, high: float) -> list[tuple[float, float]]:
    """The corners of a term's curve between two values, each with its degree."""
    points = [(low, 1.0)] if term.a is None or term.b is None or term.a == term.b else [
        (low, 0.0), (term.a, 0.0), (term.b, 1.0)]
    points += [(high, 1.0)] if term.c is None or term.d is None or term.c == term.d else [
        (term.c, 1.0), (term.d, 0.0), (high, 0.0)]
    return points
