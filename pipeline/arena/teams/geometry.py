"""Lengths, directions and speeds in a team's view, float64 [1 + 2 N, 6]; metres, m/s."""

from __future__ import annotations

import math

from numba import njit

from pipeline.bodies import F64, THETA, VX, VY, X, Y


@njit(cache=True, nogil=True, error_model="numpy")
def offset(view: F64, a: int, b: int) -> tuple[float, float]:
    """The way from the body of row ``a`` to that of row ``b``."""
    return view[b, X] - view[a, X], view[b, Y] - view[a, Y]


@njit(cache=True, nogil=True, error_model="numpy")
def distance(view: F64, a: int, b: int) -> float:
    """Between the middles of the bodies of rows ``a`` and ``b``."""
    return math.hypot(view[a, X] - view[b, X], view[a, Y] - view[b, Y])


@njit(cache=True, nogil=True, error_model="numpy")
def speed_of(view: F64, row: int) -> float:
    """How fast the body of a row is."""
    return math.hypot(view[row, VX], view[row, VY])


@njit(cache=True, nogil=True, error_model="numpy")
def along(view: F64, robot: int, dx: float, dy: float) -> float:
    """How far a way leads where a robot's front points; negative if to its back."""
    return math.cos(view[robot, THETA]) * dx + math.sin(view[robot, THETA]) * dy


@njit(cache=True, nogil=True, error_model="numpy")
def unit(dx: float, dy: float) -> tuple[float, float]:
    """The direction of a way, of length 1; of (0, 0) it is (1, 0)."""
    length = math.sqrt(dx * dx + dy * dy)
    return (dx / length, dy / length) if length > 0.0 else (1.0, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def clamp(value: float, limit: float) -> float:
    """The nearest number within ± ``limit``, which is at least 0."""
    return min(max(value, -limit), limit)
