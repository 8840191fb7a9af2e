"""Observation of a robot when it decides, as numbers (``schemas.sights.SIGHT``)."""

from __future__ import annotations

import math

from pitchlore.pipeline.game.bodies import BALL, THETA, VX, VY, X, Y
from pitchlore.pipeline.numbers.arrays import F32, F64
from pitchlore.pipeline.numbers.kernels import njit

#: Longest time to a goal line, seconds, and the speed below which a ball does not roll, m/s.
LONG_S, _ROLLS = 9.0, 0.05


@njit(cache=True, nogil=True, error_model="numpy")
def see_from(view: F64, robot: int, goal_x: float, out: F32) -> None:
    """Write what a robot sees.

    Args:
        view: float64 [1 + 2 N, 6], its team's (:func:`pipeline.game.bodies.see`); NaN where a body is not
            seen.
        robot: row of the robot, 1 to N.
        goal_x: goal lines from the centre, metres.
        out: float32 [30], written, in the order of ``schemas.sights.SIGHT``; NaN where a number is not known,
            as those of team-mates where there are none.
    """
    count = (len(view) - 1) // 2
    bx, side = view[BALL, X], -1.0 if view[BALL, Y] < 0.0 else 1.0
    by, bvx, bvy = side * view[BALL, Y], view[BALL, VX], side * view[BALL, VY]
    x, y = view[robot, X], side * view[robot, Y]
    dx, dy = bx - x, by - y
    away = math.hypot(dx, dy)
    hx, hy = math.cos(view[robot, THETA]), side * math.sin(view[robot, THETA])
    shot_x, shot_y, back_x = goal_x - bx, -by, -goal_x - bx
    home = math.hypot(x + goal_x, y)
    nearer, deeper = 0, 0
    mate, mate_away = _nearest(view, 1, count, robot)
    adversary, adversary_away = _nearest(view, count + 1, 2 * count, 0)
    for other in range(1, count + 1):
        if other != robot:
            ox, oy = view[other, X], side * view[other, Y]
            nearer += math.hypot(bx - ox, by - oy) < away
            deeper += math.hypot(ox + goal_x, oy) < home
    line = max(math.hypot(back_x, by), 1e-9)
    out[0], out[1], out[2], out[3] = bx, by, bvx, bvy
    out[4], out[5], out[6], out[7] = x, y, view[robot, VX], side * view[robot, VY]
    out[8], out[9], out[10] = away, dx, dy
    out[11] = _cosine(dx, dy, shot_x, shot_y)
    out[12] = abs(_cosine(hx, hy, dx, dy))
    out[13] = abs(_cosine(hx, hy, shot_x, shot_y))
    out[14], out[15], out[16], out[17] = nearer, mate_away, adversary_away, deeper
    out[18], out[19] = line, math.hypot(shot_x, shot_y)
    out[20] = out[21] = out[22] = out[23] = out[27] = math.nan
    if adversary > 0:
        out[20] = _cosine(bx - view[adversary, X], by - side * view[adversary, Y], back_x, -by)
        out[27] = view[adversary, X]
    if mate > 0:
        out[21], out[22] = view[mate, X], side * view[mate, Y]
        out[23] = _cosine(bx - view[mate, X], by - side * view[mate, Y], shot_x, shot_y)
    out[24] = abs(dx * -by - dy * back_x) / line
    out[25] = -(dx * back_x + dy * -by) / line**2
    out[26] = home
    out[28] = _seconds(-back_x, -bvx)
    out[29] = _seconds(shot_x, bvx)


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest(view: F64, first: int, last: int, but: int) -> tuple[int, float]:
    """Row of the robot from ``first`` to ``last`` that is nearest to the ball, -1 and NaN without one."""
    best, least = -1, math.nan
    for row in range(first, last + 1):
        away = math.hypot(view[BALL, X] - view[row, X], view[BALL, Y] - view[row, Y])
        if row != but and not math.isnan(away) and not away >= least:
            best, least = row, away
    return best, least


@njit(cache=True, nogil=True, error_model="numpy")
def _cosine(ax: float, ay: float, bx: float, by: float) -> float:
    """Cosine of the angle between two ways; 0 where one has no length."""
    return (ax * bx + ay * by) / max(math.hypot(ax, ay) * math.hypot(bx, by), 1e-9)


@njit(cache=True, nogil=True, error_model="numpy")
def _seconds(way: float, speed: float) -> float:
    """Time in which the ball covers a way at constant speed."""
    return min(way / speed, LONG_S) if speed > _ROLLS else LONG_S
