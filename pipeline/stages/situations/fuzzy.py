"""The five fuzzy variables: scikit-fuzzy's trapezoids define every term (paper section 3.2.1, Figure 1).

The figure's numbers are in no text that could be found; these are ours (docs/decisions/numbers.md).
The recogniser evaluates them as pairs of straight lines through scikit-fuzzy's degrees (:func:`lines`).
Tests compare them with :func:`membership`, scikit-fuzzy's own evaluation.
"""

from __future__ import annotations

from enum import StrEnum
from math import pi
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.game.pitch import Scales
from pitchlore.pipeline.numbers.arrays import F64

#: Corner in place of infinity, which scikit-fuzzy does not take; beyond any length, speed or time of a match.
FAR_OFF = 1e6


class Variable(StrEnum):
    """A fuzzy variable of the paper."""

    DISTANCE = "distance"
    ORIENTATION = "orientation"
    BEARING = "bearing"
    PLAYING_TIME = "playing time"
    VELOCITY = "velocity"


#: Meaning and unit of each variable.
MEANINGS: dict[Variable, tuple[str, str]] = {
    Variable.DISTANCE: ("distance between two objects", "m"),
    Variable.ORIENTATION: ("absolute difference between the orientations of two objects, 0 to pi", "rad"),
    Variable.BEARING: (
        "absolute angle from an object's orientation or course to another object, 0 to pi", "rad"
    ),
    Variable.PLAYING_TIME: ("time for which a condition has held", "s"),
    Variable.VELOCITY: ("speed of an object minus the speed of another", "m/s"),
}


class Trapezoid(NamedTuple):
    """Membership 0 up to a, rising to 1 at b, falling from c, 0 from d on; a = b or c = d is a shoulder."""

    a: float
    b: float
    c: float
    d: float


class Lines(NamedTuple):
    """A trapezoid as ``clip(min(rise * x + up, fall * x + down), 0, 1)``."""

    rise: float
    up: float
    fall: float
    down: float


Terms = dict[Variable, dict[str, Trapezoid]]

#: The terms of the playing time, s, from short to long.
PLAYING_TIMES: dict[str, Trapezoid] = {
    "INSTANT": Trapezoid(0, 0, 0.05, 0.15),
    "SHORT": Trapezoid(0.05, 0.15, 0.30, 0.50),
    "MEDIUM": Trapezoid(0.30, 0.50, 1.0, 2.0),
    "LONG": Trapezoid(1.0, 2.0, FAR_OFF, FAR_OFF),
}


def terms(scales: Scales) -> Terms:
    """The terms of all five variables for one kind of match.

    Neighbouring terms cross at 0.5 and sum to 1. BODY is the part of CONTACT in which bodies touch; TOWARDS,
    ACROSS and AWAY are a second, coarser division of the bearings, for courses. Distances scale with the
    crossings in ``scales``, in the proportions of the VSSS terms; velocities scale with ``scales.speed``.
    Angles and times do not scale.
    """
    touch, apart = scales.contact - scales.contact_fade, scales.contact + scales.contact_fade
    close, near, far = (
        (crossing * low, crossing * high)
        for crossing, low, high in (
            (scales.close, 0.15 / 0.20, 0.25 / 0.20),
            (scales.near, 0.35 / 0.45, 0.55 / 0.45),
            (scales.far, 0.75 / 0.85, 0.95 / 0.85),
        )
    )
    e1, e2, f1, f2 = (scales.speed * edge for edge in (0.05, 0.10, 0.40, 0.60))
    return {
        Variable.DISTANCE: {
            "BODY": Trapezoid(0, 0, scales.body - scales.body_fade, scales.body + scales.body_fade),
            "CONTACT": Trapezoid(0, 0, touch, apart),
            "CLOSE": Trapezoid(touch, apart, *close),
            "NEAR": Trapezoid(*close, *near),
            "FAR": Trapezoid(*near, *far),
            "VERY_FAR": Trapezoid(*far, FAR_OFF, FAR_OFF),
        },
        Variable.ORIENTATION: {
            "PARALLEL": Trapezoid(0, 0, pi / 6, pi / 3),
            "PERPENDICULAR": Trapezoid(pi / 6, pi / 3, 2 * pi / 3, 5 * pi / 6),
            "OPPOSITE": Trapezoid(2 * pi / 3, 5 * pi / 6, pi, pi),
        },
        Variable.BEARING: {
            "FACING": Trapezoid(0, 0, pi / 12, pi / 4),
            "SIDE": Trapezoid(pi / 12, pi / 4, 3 * pi / 4, 11 * pi / 12),
            "BACK": Trapezoid(3 * pi / 4, 11 * pi / 12, pi, pi),
            "TOWARDS": Trapezoid(0, 0, pi / 4, 5 * pi / 12),
            "ACROSS": Trapezoid(pi / 4, 5 * pi / 12, 7 * pi / 12, 3 * pi / 4),
            "AWAY": Trapezoid(7 * pi / 12, 3 * pi / 4, pi, pi),
        },
        Variable.PLAYING_TIME: PLAYING_TIMES,
        Variable.VELOCITY: {
            "MUCH_SLOWER": Trapezoid(-FAR_OFF, -FAR_OFF, -f2, -f1),
            "SLOWER": Trapezoid(-f2, -f1, -e2, -e1),
            "EQUAL": Trapezoid(-e2, -e1, e1, e2),
            "FASTER": Trapezoid(e1, e2, f1, f2),
            "MUCH_FASTER": Trapezoid(f1, f2, FAR_OFF, FAR_OFF),
        },
    }


def membership(term: Trapezoid, x: npt.ArrayLike) -> F64:
    """Degree to which each value belongs to the term, as scikit-fuzzy defines it.

    Args:
        term: the term.
        x: values in the variable's unit, any shape; NaN is unknown.

    Returns:
        Float64 in [0, 1] of the same shape, NaN where ``x`` is NaN.
    """
    import skfuzzy  # noqa: PLC0415 (it loads much of scipy, and few commands need it)

    values = np.asarray(x, dtype=np.float64)
    degrees: F64 = skfuzzy.trapmf(values.ravel(), term)  # type: ignore[no-untyped-call]
    return np.where(np.isnan(values), np.nan, degrees.reshape(values.shape))


def crossings(term: Trapezoid, degree: float = 0.5) -> tuple[float | None, float | None]:
    """The values at which the term's membership rises and falls through ``degree``: its lambda-cut.

    None for the side of a shoulder, on which it neither rises nor falls.
    """
    import skfuzzy  # noqa: PLC0415 (see membership)

    def cut(low: float, high: float) -> float | None:
        if low == high:
            return None
        universe = np.array([low, high])
        cuts = skfuzzy.lambda_cut_boundaries(  # type: ignore[no-untyped-call]
            universe, membership(term, universe), degree
        )
        return float(cuts[0])

    return cut(term.a, term.b), cut(term.c, term.d)


def lines(term: Trapezoid) -> Lines:
    """The term as two straight lines, which need no branch, through scikit-fuzzy's degrees at its corners.

    They equal :func:`membership` within 1e-9 on the variable's domain; a shoulder stays flat outside it.
    """
    at_a, at_b, at_c, at_d = membership(term, term).tolist()

    def line(x: float, at_x: float, y: float, at_y: float) -> tuple[float, float]:
        if x == y:
            return 0.0, 1.0
        return (at_y - at_x) / (y - x), (at_x * y - at_y * x) / (y - x)

    return Lines(*line(term.a, at_a, term.b, at_b), *line(term.c, at_c, term.d, at_d))
