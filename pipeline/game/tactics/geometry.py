"""Lengths, directions and speeds in a team's view, float64 [1 + 2 N, 6]; metres, m/s."""

from __future__ import annotations

import math

from pitchlore.pipeline.game.bodies import THETA, VX, VY, X, Y
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit


@njit(cache=True, nogil=True, error_model="numpy")
def offset(view: F64, a: int, b: int) -> tuple[float, float]:
    """The vector from the body of row ``a`` to that of row ``b``."""
    return view[b, X] - view[a, X], view[b, Y] - view[a, Y]


@njit(cache=True, nogil=True, error_model="numpy")
def distance(view: F64, a: int, b: int) -> float:
    """Distance between the middles of the bodies of rows ``a`` and ``b``, metres."""
    return math.hypot(view[a, X] - view[b, X], view[a, Y] - view[b, Y])


@njit(cache=True, nogil=True, error_model="numpy")
def speed_of(view: F64, row: int) -> float:
    """Speed of the body of a row, m/s."""
    return math.hypot(view[row, VX], view[row, VY])


@njit(cache=True, nogil=True, error_model="numpy")
def along(view: F64, robot: int, dx: float, dy: float) -> float:
    """Component of a vector along a robot's heading; negative if it points to the back."""
    return math.cos(view[robot, THETA]) * dx + math.sin(view[robot, THETA]) * dy


@njit(cache=True, nogil=True, error_model="numpy")
def unit_vector(dx: float, dy: float) -> tuple[float, float]:
    """The vector scaled to length 1; (1, 0) for (0, 0)."""
    length = math.sqrt(dx * dx + dy * dy)
    return (dx / length, dy / length) if length > 0.0 else (1.0, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def clamp(value: float, limit: float) -> float:
    """The nearest number within ± ``limit``, which is at least 0."""
    return min(max(value, -limit), limit)
