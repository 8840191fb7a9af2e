"""Observation of a robot that drives in all directions: vectors to what it may drive by, and numbers."""

from __future__ import annotations

import math

from numba import njit

from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.numbers.arrays import F64

#: Vectors: a command is a sum of them, each times a weight of the option. Those to places are as long as the
#: speed at which a robot can still stop there, as far as one with 0.5 m/s² can, and at most ``_TOP``.
VECTORS = (
    "own velocity", "own change of velocity", "the ball", "the ball soon", "velocity of the ball",
    "behind the ball", "own goal", "adversary's goal", "between ball and own goal", "nearest team-mate",
    "second team-mate", "nearest adversary", "second adversary", "ahead", "middle of the team-mates",
    "before the adversary that threatens",
)
#: Angles from the heading: a turn is a sum of them, and of the own turn rate.
ANGLES = (
    "turn rate", "to the ball", "to the adversary's goal", "to where it drives",
    "to where the ball comes from",
)
NUMBERS = 53
_TOP, _SMALL = 1.5, 1e-6
#: How far behind the ball, and before an adversary, a place is, metres; the longest look ahead, s.
_BEHIND, _BEFORE, _AHEAD_S = 0.12, 0.4, 0.5
#: Distance of a body that is not there, metres.
_FAR = 9.0
_BALL_SPEED = 3.0


@njit(cache=True, nogil=True, error_model="numpy")
def _toward(dx: float, dy: float, vectors: F64, row: int) -> None:
    """Write a vector to a place."""
    away = math.hypot(dx, dy)
    scale = min(math.sqrt(away), _TOP) / (away + _SMALL)
    vectors[row, 0], vectors[row, 1] = scale * dx, scale * dy


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest(view: F64, robot: int, first: int, last: int, other: int, x: float, y: float) -> int:
    """Row of the nearest robot to a place, but for two rows; -1 without one."""
    best, least = -1, math.inf
    for row in range(first, last):
        away = math.hypot(view[row, X] - x, view[row, Y] - y)
        if row != robot and row != other and away < least:
            best, least = row, away
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _off(angle: float) -> float:
    """An angle in [-pi, pi]."""
    return math.atan2(math.sin(angle), math.cos(angle))


@njit(cache=True, nogil=True, error_model="numpy")
def observe_omni(
    view: F64, robot: int, before: F64, goal_x: float, vectors: F64, angles: F64, numbers: F64
) -> None:
    """Write what a robot sees; what it would see of a body that is not there is 0, or far.

    Args:
        view: float64 [1 + 2 N, 6], the team's; NaN in a row whose body is not there.
        robot: row of the robot, 1 to N.
        before: float64 [2], its velocity 0.1 s ago.
        goal_x: place of the adversary's goal line, metres.
        vectors: float64 [VECTORS, 2], written.
        angles: float64 [ANGLES], written, radians and rad/s.
        numbers: float64 [NUMBERS], written.
    """
    count = (len(view) - 1) // 2
    vectors[:], numbers[:] = 0.0, 0.0
    own, ball = view[robot], view[BALL]
    x, y, bx, by = own[X], own[Y], ball[X], ball[Y]
    dx, dy = bx - x, by - y
    away = math.hypot(dx, dy)
    vectors[0, 0], vectors[0, 1] = own[VX], own[VY]
    vectors[1, 0], vectors[1, 1] = own[VX] - before[0], own[VY] - before[1]
    _toward(dx, dy, vectors, 2)
    ahead_s = min(_AHEAD_S, away / _BALL_SPEED)
    sx, sy = dx + ahead_s * ball[VX], dy + ahead_s * ball[VY]
    _toward(sx, sy, vectors, 3)
    vectors[4, 0], vectors[4, 1] = ball[VX] / _BALL_SPEED, ball[VY] / _BALL_SPEED
    gx, gy = goal_x - bx, -by
    length = math.hypot(gx, gy) + _SMALL
    _toward(dx - _BEHIND * gx / length, dy - _BEHIND * gy / length, vectors, 5)
    _toward(-goal_x - x, -y, vectors, 6)
    _toward(goal_x - x, -y, vectors, 7)
    ox, oy = -goal_x - bx, -by
    part = min(max(-(dx * ox + dy * oy) / (ox * ox + oy * oy + _SMALL), 0.0), 1.0)
    lx, ly = dx + part * ox, dy + part * oy
    _toward(lx, ly, vectors, 8)
    c, s = math.cos(own[THETA]), math.sin(own[THETA])
    vectors[13, 0], vectors[13, 1] = c, s
    mates, nearer, deeper, mate_to_ball = 0, 0, 0, _FAR
    for row in range(1, count + 1):
        if row != robot and not math.isnan(view[row, X]):
            mates += 1
            vectors[14, 0] += view[row, X]
            vectors[14, 1] += view[row, Y]
            to_ball = math.hypot(view[row, X] - bx, view[row, Y] - by)
            mate_to_ball = min(mate_to_ball, to_ball)
            nearer += to_ball < away
            deeper += math.hypot(view[row, X] + goal_x, view[row, Y]) < math.hypot(x + goal_x, y)
    if mates:
        _toward(vectors[14, 0] / mates - x, vectors[14, 1] / mates - y, vectors, 14)
    threat, least, other_to_ball = -1, math.inf, _FAR
    for row in range(count + 1, 2 * count + 1):
        if not math.isnan(view[row, X]):
            other_to_ball = min(other_to_ball, math.hypot(view[row, X] - bx, view[row, Y] - by))
            cost = (math.hypot(view[row, X] - x, view[row, Y] - y)
                    + 0.5 * math.hypot(view[row, X] + goal_x, view[row, Y]))
            if cost < least:
                threat, least = row, cost
    if threat > 0:
        tx, ty = -goal_x - view[threat, X], -view[threat, Y]
        length = math.hypot(tx, ty) + _SMALL
        ux, uy = view[threat, X] - x, view[threat, Y] - y
        _toward(ux + _BEFORE * tx / length, uy + _BEFORE * ty / length, vectors, 15)
        numbers[42], numbers[43] = ux, uy
    numbers[0], numbers[1], numbers[2], numbers[3] = x, y, c, s
    numbers[4], numbers[5], numbers[6] = own[VX], own[VY], own[OMEGA]
    numbers[7], numbers[8] = vectors[1]
    numbers[9], numbers[10], numbers[11], numbers[12] = bx, by, ball[VX], ball[VY]
    numbers[13], numbers[14], numbers[15] = dx, dy, away
    numbers[16], numbers[17] = c * dx + s * dy, c * dy - s * dx
    numbers[18], numbers[19], numbers[20] = math.hypot(own[VX], own[VY]), nearer, deeper
    numbers[21], numbers[22] = mate_to_ball, other_to_ball
    numbers[23], numbers[24], numbers[25], numbers[26] = sx, sy, lx, ly
    numbers[27] = (own[VX] * dx + own[VY] * dy) / (away + _SMALL)
    numbers[28] = -(ball[VX] * dx + ball[VY] * dy) / (away + _SMALL)
    numbers[29] = math.hypot(x + goal_x, y)
    place, slot = 9, 30
    for side in range(2):
        first = 1 if side == 0 else count + 1
        last = first + count
        one = _nearest(view, robot, first, last, -1, x, y)
        two = _nearest(view, robot, first, last, one, x, y)
        for other in (one, two):
            if other > 0:
                ux, uy = view[other, X] - x, view[other, Y] - y
                _toward(ux, uy, vectors, place)
                numbers[slot], numbers[slot + 1], numbers[slot + 2] = ux, uy, math.hypot(ux, uy)
            else:
                numbers[slot + 2] = _FAR
            place, slot = place + 1, slot + 3
    numbers[44], numbers[45] = goal_x - x, math.hypot(goal_x - x, y)
    heading = own[THETA]
    angles[0] = own[OMEGA]
    angles[1] = _off(math.atan2(dy, dx) - heading)
    angles[2] = _off(math.atan2(-y, goal_x - x) - heading)
    angles[3] = _off(math.atan2(own[VY], own[VX]) - heading) if numbers[18] > 0.1 else 0.0
    rolls = math.hypot(ball[VX], ball[VY]) > 0.5
    angles[4] = _off(math.atan2(-ball[VY], -ball[VX]) - heading) if rolls else 0.0
    for row in range(4):
        numbers[46 + row] = angles[1 + row]
    numbers[50], numbers[51] = math.hypot(bx - goal_x, by), math.hypot(bx + goal_x, by)
    numbers[52] = c * own[VX] + s * own[VY]
