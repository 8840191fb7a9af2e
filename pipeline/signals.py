"""Where everything is and how it moves, as the signals that the rules speak of.

All signals are float64 and NaN where a body or what is asked of it (heading, velocity) is missing.
Angles are in [0, pi]; they come from dot and cross products, so nothing has to be wrapped.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numba
import numpy as np
import numpy.typing as npt
import polars as pl

from pipeline.errors import SchemaMismatch
from pipeline.pitch import Scales
from schemas import BODIES, ROLES

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
I32 = npt.NDArray[np.int32]
I8 = npt.NDArray[np.int8]
Flags = npt.NDArray[np.bool_]

#: Distance to somebody who is not there: no term of nearness holds.
NOBODY = 1e6

#: Below this share of the kind's speed scale a direction of motion is not known, m/s for VSSS.
STILL = 0.05

#: Signals of a robot, in the order of :func:`fill_own`; what comes before the first dot of RULES.
OWN: tuple[str, ...] = (
    "ball_distance", "ball_off_heading", "ball_off_course",
    "robot_off_ball_course", "heading_off_ball_course",
    "speed", "ball_speed", "speed_over_ball", "ball_speed_over_robot",
    "opponent_ball_distance", "teammate_ball_distance",
    "ball_x_distance", "ball_x_off_course", "ball_y_distance", "ball_y_off_course",
    "own_goal_distance", "own_goal_off_heading", "own_goal_off_course",
    "adversary_goal_distance", "adversary_goal_off_heading", "adversary_goal_off_course",
)

#: Signals between a robot and one other, in the order of :func:`fill_other`.
OTHER: tuple[str, ...] = ("other_distance", "other_off_course", "speed")


@dataclass(frozen=True, slots=True)
class Scene:
    """A match as dense arrays: B robots (home first, by number) at T samples.

    Attributes:
        t_ns: int64 [T], increasing.
        segment: int32 [T], -1 while play is stopped.
        team: int8 [B], 0 home, 1 away.
        robot: int64 [B], the robots' numbers.
        present: bool [B, T], whether the robot can be used there.
        role: int8 [B, T], index in ROLES as last seen; -1 before the first time.
        poses: float64 [7, B, T]: x and y in metres, cosine and sine of the heading, speed in m/s, cosine
            and sine of the course, the direction in which it drives.
        ball: float64 [5, T], the ball's x, y, speed, and cosine and sine of its direction of travel.
    """

    t_ns: I64
    segment: I32
    team: I8
    robot: I64
    present: Flags
    role: I8
    poses: F64
    ball: F64


def scene(trajectories: pl.DataFrame, scales: Scales) -> Scene:
    """The dense arrays of a table of trajectories.

    Rows that are suspect, have a position that is not finite, or (of robots) no role, are missing bodies.

    Args:
        trajectories: rows of schema Trajectories of one match, sorted as it says.
        scales: what the kind of match is scaled by.

    Raises:
        SchemaMismatch: if a body's rows are not together and in order of time.
    """
    frame = trajectories["frame"].to_numpy().astype(np.int64)
    first = int(frame.min())
    seen = np.zeros(int(frame.max()) - first + 1, dtype=np.bool_)
    seen[frame - first] = True
    column = (np.cumsum(seen) - 1)[frame - first]
    samples = int(np.count_nonzero(seen))

    team = trajectories["team"].to_physical().to_numpy().astype(np.int64)
    robot = trajectories["robot"].cast(pl.Int64).fill_null(-1).to_numpy()
    starts = np.flatnonzero(np.concatenate(([True], (np.diff(team) != 0) | (np.diff(robot) != 0))))
    ends = np.append(starts[1:], len(team))
    bodies = list(zip(team[starts].tolist(), robot[starts].tolist(), strict=True))
    inside = np.ones(len(team), dtype=np.bool_)
    inside[starts] = False
    if bodies != sorted(set(bodies)) or np.any(np.diff(column)[inside[1:]] <= 0):
        raise SchemaMismatch(
            "is not sorted by team, robot and time", where="trajectories", next_step="Sort it as its schema says"
        )

    t_ns = np.empty(samples, dtype=np.int64)
    t_ns[column] = trajectories["t_ns"].to_numpy()
    segment = np.empty(samples, dtype=np.int32)
    segment[column] = trajectories["segment"].fill_null(-1).to_numpy()

    values = {
        name: trajectories[name].to_numpy().astype(np.float64) for name in ("x", "y", "theta", "vx", "vy")
    }
    role = trajectories["role"].to_physical().cast(pl.Int8).fill_null(-1).to_numpy()
    usable = np.isfinite(values["x"]) & np.isfinite(values["y"]) & ~trajectories["suspect"].to_numpy()
    usable &= (role >= 0) | (team == BODIES.index("ball"))

    rows = [row for row, body in enumerate(bodies) if body[0] != BODIES.index("ball")]
    shape = (len(rows), samples)
    present = np.zeros(shape, dtype=np.bool_)
    dense_role = np.full(shape, -1, dtype=np.int8)
    still = STILL * scales.speed
    poses = np.full((7, *shape), np.nan)
    for out, row in enumerate(rows):
        part = slice(starts[row], ends[row])
        keep = usable[part]
        at = column[part][keep]
        present[out, at] = True
        dense_role[out, at] = role[part][keep]
        _carry(dense_role[out])
        pose = {name: column_values[part][keep] for name, column_values in values.items()}
        _pose(
            pose["x"], pose["y"], pose["theta"], pose["vx"], pose["vy"],
            at, still, scales.omnidirectional, poses[:, out],
        )

    ball = np.full((5, samples), np.nan)
    if bodies[0][0] == BODIES.index("ball"):
        part = slice(starts[0], ends[0])
        keep = usable[part]
        at = column[part][keep]
        vx, vy = np.full(samples, np.nan), np.full(samples, np.nan)
        ball[0, at], ball[1, at] = values["x"][part][keep], values["y"][part][keep]
        vx[at], vy[at] = values["vx"][part][keep], values["vy"][part][keep]
        ball[2] = np.sqrt(vx * vx + vy * vy)
        _ball_course(vx, vy, segment, still, ball)
    return Scene(
        t_ns=t_ns, segment=segment,
        team=np.array([bodies[row][0] - 1 for row in rows], dtype=np.int8),
        robot=np.array([bodies[row][1] for row in rows], dtype=np.int64),
        present=present, role=dense_role, poses=poses, ball=ball,
    )


@numba.njit(cache=True, nogil=True)
def _pose(
    x: F64, y: F64, theta: F64, vx: F64, vy: F64, at: I64, still: float, omnidirectional: bool, out: F64
) -> None:
    """Fill columns ``at`` [n] of ``out`` [7, T] with x, y, cos, sin, speed, and cos and sin of the course."""
    for i in range(len(x)):
        cos, sin = np.cos(theta[i]), np.sin(theta[i])
        speed = np.sqrt(vx[i] * vx[i] + vy[i] * vy[i])
        course_cos, course_sin = cos, sin
        if np.isnan(speed):
            course_cos, course_sin = np.nan, np.nan
        elif omnidirectional and speed >= still and not np.isnan(cos):
            course_cos, course_sin = vx[i] / speed, vy[i] / speed
        elif not omnidirectional and vx[i] * cos + vy[i] * sin < -still:
            course_cos, course_sin = -cos, -sin
        k = at[i]
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = x[i], y[i], cos, sin, speed
        out[5, k], out[6, k] = course_cos, course_sin


@numba.njit(cache=True, nogil=True)
def _carry(role: I8) -> None:
    """Fill unknown roles with the last known one, in place."""
    for k in range(1, len(role)):
        if role[k] < 0:
            role[k] = role[k - 1]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _ball_course(vx: F64, vy: F64, segment: I32, still: float, ball: F64) -> None:
    """Fill rows 3 and 4 of ``ball``: the direction of travel, held within a segment while the ball is still."""
    cos, sin = np.nan, np.nan
    for k in range(len(vx)):
        if k > 0 and segment[k] != segment[k - 1]:
            cos, sin = np.nan, np.nan
        if ball[2, k] >= still:
            cos, sin = vx[k] / ball[2, k], vy[k] / ball[2, k]
        if not np.isnan(ball[0, k]):
            ball[3, k], ball[4, k] = cos, sin


@numba.njit(cache=True, nogil=True, error_model="numpy")
def ball_distances(poses: F64, ball: F64) -> F64:
    """Distance of each robot to the ball, float64 [B, T] in metres, NaN where either is missing.

    Args:
        poses, ball: as in :class:`Scene`.
    """
    out = np.empty_like(poses[0])
    for b in range(len(out)):
        for k in range(len(ball[0])):
            dx, dy = ball[0, k] - poses[0, b, k], ball[1, k] - poses[1, b, k]
            out[b, k] = np.sqrt(dx * dx + dy * dy)
    return out


@numba.njit(cache=True, nogil=True, error_model="numpy")
def nearest_to_ball(distances: F64, among: Flags, ball: F64) -> F64:
    """Distance of the nearest of some robots to the ball, float64 [T] in metres.

    Only robots that are there count; NOBODY where none is, NaN where the ball is missing.

    Args:
        distances: float64 [B, T], as :func:`ball_distances`.
        among: bool [B], the robots to choose from.
        ball: as in :class:`Scene`.
    """
    nearest = np.where(np.isnan(ball[0]), np.nan, NOBODY)
    for b in range(distances.shape[0]):
        if among[b]:
            for k in range(distances.shape[1]):
                nearest[k] = distances[b, k] if distances[b, k] < nearest[k] else nearest[k]
    return nearest


@numba.njit(cache=True, nogil=True, error_model="numpy")
def between(ax: float, ay: float, bx: float, by: float) -> float:
    """Angle in [0, pi] between two directions of any length; NaN if either has none.

    ``atan2(|a × b|, a · b)`` within 1e-15, but without a call or a branch, so that a loop of it becomes
    SIMD. The quotient is brought into ±tan(pi / 8), where an odd polynomial of degree 21 (Chebyshev
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


@numba.njit(cache=True, nogil=True, error_model="numpy")
def fill_own(
    mine: F64, ball: F64, opponent: F64, teammate: F64, at: int, n: int, own_goal_x: float, out: F64
) -> None:
    """Fill the signals OWN of one robot for a block of its samples.

    A half turn of the pitch changes no distance and no angle between two things, so the away team's
    point of view is the home team's with the goals swapped.

    Args:
        mine: float64 [7, N], the robot's x, y, cos, sin, speed, course_cos, course_sin.
        ball: float64 [5, N], as in :class:`Scene`.
        opponent, teammate: float64 [N], distance of the nearest (other) one to the ball.
        at: first sample of the block.
        n: samples in the block.
        own_goal_x: where the own goal is, metres; the adversary's is at minus that.
        out: float64 [at least len(OWN), at least n].
    """
    x, y, cos, sin = mine[0, at:at + n], mine[1, at:at + n], mine[2, at:at + n], mine[3, at:at + n]
    speed, course_cos, course_sin = mine[4, at:at + n], mine[5, at:at + n], mine[6, at:at + n]
    ball_x, ball_y, ball_speed = ball[0, at:at + n], ball[1, at:at + n], ball[2, at:at + n]
    ball_cos, ball_sin = ball[3, at:at + n], ball[4, at:at + n]
    for j in range(n):
        dx, dy = ball_x[j] - x[j], ball_y[j] - y[j]
        out[0, j] = np.sqrt(dx * dx + dy * dy)
        out[1, j] = between(cos[j], sin[j], dx, dy)
        out[2, j] = between(course_cos[j], course_sin[j], dx, dy)
        out[3, j] = between(ball_cos[j], ball_sin[j], -dx, -dy)
        out[4, j] = between(cos[j], sin[j], ball_cos[j], ball_sin[j])
    for j in range(n):
        out[5, j] = speed[j]
        out[6, j] = ball_speed[j]
        out[7, j] = speed[j] - ball_speed[j]
        out[8, j] = ball_speed[j] - speed[j]
        out[9, j] = opponent[at + j]
        out[10, j] = teammate[at + j]
    for j in range(n):
        dx, dy = ball_x[j] - x[j], ball_y[j] - y[j]
        out[11, j] = abs(dx)
        out[12, j] = between(course_cos[j], course_sin[j], dx, 0.0)
        out[13, j] = abs(dy)
        out[14, j] = between(course_cos[j], course_sin[j], 0.0, dy)
    for goal in range(2):
        goal_x = own_goal_x if goal == 0 else -own_goal_x
        row = 15 + 3 * goal
        for j in range(n):
            dx, dy = goal_x - x[j], -y[j]
            out[row, j] = np.sqrt(dx * dx + dy * dy)
            out[row + 1, j] = between(cos[j], sin[j], dx, dy)
            out[row + 2, j] = between(course_cos[j], course_sin[j], dx, dy)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def fill_other(mine: F64, other_x: F64, other_y: F64, at: int, n: int, out: F64) -> None:
    """Fill the signals OTHER between one robot and another for a block of the first one's samples.

    Args:
        mine: as for :func:`fill_own`.
        other_x, other_y: float64 [N], NaN where the other is missing.
        at, n: the block.
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
