"""Signals: the inputs of the rules, computed from the positions and motions of all bodies.

A ball above the reach of the bodies is as much farther from them: what they could play counts as no height.

All signals are float64. They are NaN where a body, its heading or its velocity is missing. Angles are
in [0, pi]; they come from dot and cross products, so no angle needs wrapping.
"""

from __future__ import annotations

from math import pi

import numpy as np

from pitchlore.pipeline.numbers.arrays import F64, Bools
from pitchlore.pipeline.numbers.kernels import njit

#: Distance to an absent robot; no term of nearness holds.
ABSENT = 1e6

#: Signals of a robot, in the order of :func:`fill_own`.
OWN: tuple[str, ...] = (
    "ball_distance", "ball_off_heading", "ball_off_course",
    "robot_off_ball_course", "course_off_ball_course",
    "speed", "ball_speed", "speed_over_ball", "ball_speed_over_robot",
    "opponent_ball_distance", "teammate_ball_distance", "nearest_ball_distance", "ball_jolt", "ball_gain",
    "ball_off_face",
    "ball_x_distance", "ball_x_off_course", "ball_y_distance", "ball_y_off_course",
    "ball_y_way_off_course",
    "own_goal_distance", "own_goal_off_heading", "own_goal_off_course",
    "adversary_goal_distance", "adversary_goal_off_heading", "adversary_goal_off_course",
)

#: Signals between a robot and one other, in the order of :func:`fill_other`.
OTHER: tuple[str, ...] = ("other_distance", "other_off_course", "speed")


@njit(cache=True, nogil=True, error_model="numpy")
def ball_distances(poses: F64, ball: F64) -> F64:
    """Distance of each robot to the ball, float64 [B, T] in metres, NaN where either is missing.

    Args:
        poses: as in :class:`pipeline.stages.situations.dense.DenseMatch`.
        ball: as in :class:`pipeline.stages.situations.dense.DenseMatch`.
    """
    out = np.empty(poses.shape[1:], dtype=np.float64)
    for b in range(len(out)):
        for k in range(len(ball[0])):
            dx, dy = ball[0, k] - poses[0, b, k], ball[1, k] - poses[1, b, k]
            out[b, k] = np.sqrt(dx * dx + dy * dy + ball[7, k] * ball[7, k])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_to_ball(distances: F64, among: Bools, ball: F64) -> F64:
    """Distance of the nearest of some robots to the ball, float64 [T] in metres.

    Missing robots do not count. The distance is ABSENT without any robot, NaN without the ball.

    Args:
        distances: float64 [B, T], as :func:`ball_distances`.
        among: bool [B], the robots to choose from.
        ball: as in :class:`pipeline.stages.situations.dense.DenseMatch`.
    """
    nearest = np.empty(ball.shape[1], dtype=np.float64)
    for k in range(len(nearest)):  # np.where takes a second to compile
        nearest[k] = np.nan if np.isnan(ball[0, k]) else ABSENT
    for b in range(distances.shape[0]):
        if among[b]:
            for k in range(distances.shape[1]):
                nearest[k] = distances[b, k] if distances[b, k] < nearest[k] else nearest[k]
    return nearest


@njit(cache=True, nogil=True, error_model="numpy")
def between(ax: float, ay: float, bx: float, by: float) -> float:
    """Angle in [0, pi] between two directions of any length; NaN if either has none.

    It equals ``atan2(|a × b|, a · b)`` within 1e-15, but has no call and no branch, so that loops over it
    become SIMD. The quotient is reduced to ±tan(pi / 8), where an odd polynomial of degree 21 (Chebyshev
    interpolation of the arctangent) is exact to rounding.
    """
    dot, cross = ax * bx + ay * by, abs(ax * by - ay * bx)
    along = abs(dot)
    small, large = (cross, along) if cross < along else (along, cross)
    wide = small > 0.41421356237309503 * large
    q = (small - large if wide else small) / (small + large if wide else large)
    z = q * q
    p = 0.02276132525949482
    p = p * z - 0.0448528690985488
    p = p * z + 0.05737366755340846
    p = p * z - 0.06649874687829412
    p = p * z + 0.07691091377782666
    p = p * z - 0.09090855435595245
    p = p * z + 0.111111097645445
    p = p * z - 0.14285714268989583
    p = p * z + 0.19999999999924267
    p = p * z - 0.3333333333333328
    turn = q + q * z * p + (0.7853981633974483 if wide else 0.0)
    turn = turn if cross < along else 1.5707963267948966 - turn
    return pi - turn if dot < 0.0 else turn


@njit(cache=True, nogil=True, error_model="numpy")
def fill_own(
    mine: F64, ball: F64, opponent: F64, teammate: F64, at: int, n: int, own_goal_x: float, faces: int,
    out: F64,
) -> None:
    """Fill the signals OWN of one robot for a block of its samples.

    A half turn of the pitch changes no distance and no angle between two things, so the away team's
    point of view is the home team's with the goals swapped.

    Args:
        mine: float64 [7, N], the robot's x, y, cos, sin, speed, course_cos, course_sin.
        ball: float64 [8, N], as in :class:`pipeline.stages.situations.dense.DenseMatch`.
        opponent: float64 [N], distance of the nearest opponent to the ball.
        teammate: float64 [N], distance of the nearest teammate to the ball.
        at: first sample of the block.
        n: samples in the block.
        own_goal_x: x of the own goal, metres; the adversary's is at minus that.
        faces: number of the robot's sides that play the ball, as ``Scales.faces``.
        out: float64 [at least len(OWN), at least n].
    """
    x, y, cos, sin = mine[0, at:at + n], mine[1, at:at + n], mine[2, at:at + n], mine[3, at:at + n]
    speed, course_cos, course_sin = mine[4, at:at + n], mine[5, at:at + n], mine[6, at:at + n]
    ball_x, ball_y, ball_speed = ball[0, at:at + n], ball[1, at:at + n], ball[2, at:at + n]
    ball_cos, ball_sin, above = ball[3, at:at + n], ball[4, at:at + n], ball[7, at:at + n]
    for j in range(n):
        dx, dy = ball_x[j] - x[j], ball_y[j] - y[j]
        out[0, j] = np.sqrt(dx * dx + dy * dy + above[j] * above[j])
        out[1, j] = between(cos[j], sin[j], dx, dy)
        out[2, j] = between(course_cos[j], course_sin[j], dx, dy)
        out[3, j] = between(ball_cos[j], ball_sin[j], -dx, -dy)
        out[4, j] = between(course_cos[j], course_sin[j], ball_cos[j], ball_sin[j])
    for j in range(n):
        out[5, j] = speed[j]
        out[6, j] = ball_speed[j]
        out[7, j] = speed[j] - ball_speed[j]
        out[8, j] = ball_speed[j] - speed[j]
        out[9, j] = opponent[at + j]
        out[10, j] = teammate[at + j]
        others = min(opponent[at + j], teammate[at + j])
        out[11, j] = ABSENT if others < out[0, j] else out[0, j]
        out[12, j] = ball[5, at + j]
        out[13, j] = ball[6, at + j]
        off = out[1, j]
        out[14, j] = off if faces == 1 else (min(off, pi - off) if faces == 2 else 0.0 * off)
    for j in range(n):
        dx, dy = ball_x[j] - x[j], ball_y[j] - y[j]
        out[15, j] = abs(dx)
        out[16, j] = between(course_cos[j], course_sin[j], dx, 0.0)
        out[17, j] = abs(dy)
        out[18, j] = between(course_cos[j], course_sin[j], 0.0, dy)
        out[19, j] = between(course_cos[j], course_sin[j], 0.0, ball_sin[j])
    for goal in range(2):
        goal_x = own_goal_x if goal == 0 else -own_goal_x
        row = 20 + 3 * goal
        for j in range(n):
            dx, dy = goal_x - x[j], -y[j]
            out[row, j] = np.sqrt(dx * dx + dy * dy)
            out[row + 1, j] = between(cos[j], sin[j], dx, dy)
            out[row + 2, j] = between(course_cos[j], course_sin[j], dx, dy)


@njit(cache=True, nogil=True, error_model="numpy")
def fill_other(mine: F64, other_x: F64, other_y: F64, at: int, n: int, out: F64) -> None:
    """Fill the signals OTHER between one robot and another for a block of the first one's samples.

    Args:
        mine: as for :func:`fill_own`.
        other_x: float64 [N], NaN where the other is missing.
        other_y: float64 [N], the same.
        at: first sample of the block.
        n: samples in the block.
        out: float64 [at least len(OTHER), at least n].
    """
    x, y, speed = mine[0, at:at + n], mine[1, at:at + n], mine[4, at:at + n]
    course_cos, course_sin = mine[5, at:at + n], mine[6, at:at + n]
    to_x, to_y = other_x[at:at + n], other_y[at:at + n]
    for j in range(n):
        dx, dy = to_x[j] - x[j], to_y[j] - y[j]
        out[0, j] = np.sqrt(dx * dx + dy * dy)
        out[1, j] = between(course_cos[j], course_sin[j], dx, dy)
        out[2, j] = speed[j]
