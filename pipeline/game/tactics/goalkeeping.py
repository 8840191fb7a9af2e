"""A goalkeeper that waits for the ball stands on its line where the ball will cross it.

View, robot and wheels are those of :mod:`pipeline.game.tactics.steering`.
"""

from __future__ import annotations

import math

from pitchlore.pipeline.game.bodies import BALL, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.tactics.geometry import clamp
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.steering import EITHER, drive_to, face, steer
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

#: A goalkeeper's middle keeps off the goal line by so many radii (5 cm on the VSSS pitch).
OFF_LINE = 5 / 3.75


@njit(cache=True, nogil=True, error_model="numpy")
def crossing(view: F64, line: float, m: Measures) -> float:
    """The y at which the ball will cross the line x = ``line``; its own while it does not roll toward it."""
    x, vx = view[BALL, X], view[BALL, VX]
    y: float = view[BALL, Y]
    if vx < -m.moving and x > line:
        y += view[BALL, VY] * (line - x) / vx
    return y


@njit(cache=True, nogil=True, error_model="numpy")
def keep_line(view: F64, robot: int, limit: float, m: Measures, wheels: F64) -> None:
    """Stand before the goal line, the side to the pitch, where the ball will cross.

    It stands no further than ``limit`` beside the goal's middle, metres, at least 0.
    """
    line = -m.goal_x + OFF_LINE * m.radius
    cross = clamp(crossing(view, line, m), limit)
    short, left = line - view[robot, X], cross - view[robot, Y]
    if abs(short) > m.radius:
        drive_to(view, robot, line, cross, m.top, EITHER, m, wheels)
    elif abs(left) > 0.2 * m.radius:
        # along the line, leaning back to it
        speed = min(m.top, m.arrival * abs(left))
        steer(view, robot, clamp(2.0 * short, abs(left)), left, speed, EITHER, m, wheels)
    else:
        face(view, robot, 0.0, 1.0 if math.sin(view[robot, THETA]) >= 0.0 else -1.0, m, wheels)
