"""A match as dense arrays: every robot and the ball at every sample."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numba
import numpy as np
import numpy.typing as npt
import polars as pl

from pipeline.arrays import F64, I8, I32, I64, Bools
from pipeline.errors import SchemaMismatch
from pipeline.pitch import Scales
from schemas import BODIES

#: The ball's name as a team.
BALL = BODIES[0]

#: Speed below which a body has no direction of motion, m/s, to be multiplied by the kind's speed scale.
STILL = 0.05

#: The ball's velocities before and after a jolt are taken over at least this time each.
_JOLT_NS = 50_000_000
#: Longest time between samples for that; a longer one begins anew.
_JOLT_LONGEST_NS = 200_000_000
#: Share of its velocity that the ball may lose or gain by rolling and noise within that time. rcssserver's
#: ball loses 6 % a cycle (ball_decay) and is put off by up to 5 % (ball_rand).
_ROLLING = 0.1


@dataclass(frozen=True, slots=True)
class DenseMatch:
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
        ball: float64 [8, T], the ball's x, y, speed, cosine and sine of its direction of travel, jolt and
            gain (see :func:`jolts`), and its height above ``Scales.reach``, 0 below it or where not known.
    """

    t_ns: I64
    segment: I32
    team: I8
    robot: I64
    present: Bools
    role: I8
    poses: F64
    ball: F64


def dense_match(trajectories: pl.DataFrame, scales: Scales) -> DenseMatch:
    """The dense arrays of a table of trajectories.

    A row counts as a missing body if it is suspect, its position is not finite, or a robot has no role.

    Args:
        trajectories: rows of schema Trajectories of one match, sorted as it says; not empty. It may have a
            column z, the ball's height, metres, null where not known.
        scales: distances and speeds of the kind of match.

    Raises:
        SchemaMismatch: if a body's rows are not together and in order of time.
    """
    sample, samples = _samples(trajectories["frame"].to_numpy())
    bodies = dict(_bodies(trajectories, sample))
    t_ns = np.empty(samples, dtype=np.int64)
    t_ns[sample] = trajectories["t_ns"].to_numpy()
    segment = np.empty(samples, dtype=np.int32)
    segment[sample] = trajectories["segment"].fill_null(-1).to_numpy()

    x, y, theta, vx, vy = (
        trajectories[name].to_numpy().astype(np.float64) for name in ("x", "y", "theta", "vx", "vy")
    )
    roles = trajectories["role"].to_physical().cast(pl.Int8).fill_null(-1).to_numpy()
    is_ball = (trajectories["team"] == BALL).to_numpy()
    usable = np.isfinite(x) & np.isfinite(y) & ~trajectories["suspect"].to_numpy() & (is_ball | (roles >= 0))

    still = STILL * scales.speed
    ball = np.full((8, samples), np.nan)
    ball[7] = 0.0
    robots = [body for body in bodies if body[0] != BODIES.index(BALL)]
    poses = np.full((7, len(robots), samples), np.nan)
    present = np.zeros((len(robots), samples), dtype=np.bool_)
    role = np.full((len(robots), samples), -1, dtype=np.int8)
    for body, rows in bodies.items():
        keep = usable[rows]
        at = sample[rows][keep]
        motion = (x[rows][keep], y[rows][keep], vx[rows][keep], vy[rows][keep])
        if body in robots:
            row = robots.index(body)
            present[row, at] = True
            role[row, at] = roles[rows][keep]
            _carry(role[row])
            heading = theta[rows][keep]
            if scales.heads_as_it_moves:
                heading = headings(heading, motion[2], motion[3], still)
            _pose(*motion, heading, at, still, scales.omnidirectional, poses[:, row])
        else:
            _ball(*motion, at, segment, still, ball)
            jolts(motion[0], motion[1], t_ns[at], segment[at], at, ball)
            if "z" in trajectories.columns:
                z = trajectories["z"].fill_null(0.0).to_numpy().astype(np.float64)
                ball[7, at] = np.maximum(z[rows][keep] - scales.reach, 0.0)
    return DenseMatch(
        t_ns=t_ns, segment=segment,
        team=np.array([team - BODIES.index("home") for team, _ in robots], dtype=np.int8),
        robot=np.array([robot for _, robot in robots], dtype=np.int64),
        present=present, role=role, poses=poses, ball=ball,
    )


def _samples(frame: npt.NDArray[np.uint32]) -> tuple[I64, int]:
    """Rank of each row's frame among the distinct frames, int64 [rows], and the number of distinct frames."""
    since = frame.astype(np.int64) - int(frame.min())
    occurs = np.zeros(int(since.max()) + 1, dtype=np.bool_)
    occurs[since] = True
    return (np.cumsum(occurs) - 1)[since], int(np.count_nonzero(occurs))


def _bodies(trajectories: pl.DataFrame, sample: I64) -> Iterator[tuple[tuple[int, int], slice]]:
    """Each body, (team of BODIES, number or -1), with its rows."""
    team = trajectories["team"].to_physical().to_numpy().astype(np.int64)
    robot = trajectories["robot"].cast(pl.Int64).fill_null(-1).to_numpy()
    same = (np.diff(team) == 0) & (np.diff(robot) == 0)
    edges = [0, *(np.flatnonzero(~same) + 1).tolist(), len(team)]
    bodies = [(int(team[start]), int(robot[start])) for start in edges[:-1]]
    if bodies != sorted(set(bodies)) or np.any(np.diff(sample)[same] <= 0):
        raise SchemaMismatch(
            "is not sorted by team, robot and time", where="trajectories",
            next_step="Sort it as its schema says",
        )
    for body, start, end in zip(bodies, edges[:-1], edges[1:], strict=True):
        yield body, slice(start, end)


@numba.njit(cache=True, nogil=True)
def _carry(role: I8) -> None:
    """Fill unknown roles with the last known one, in place."""
    for k in range(1, len(role)):
        if role[k] < 0:
            role[k] = role[k - 1]


@numba.njit(cache=True, nogil=True)
def headings(theta: F64, vx: F64, vy: F64, still: float) -> F64:
    """Headings of a body, float64 [n]; where one is not known it is the direction of motion.

    While the body is slower than ``still`` it keeps the last direction in which it moved. The heading is NaN
    before the body first moves.

    Args:
        theta: [n], rad; NaN where not known.
        vx: [n], m/s; NaN where not known.
        vy: [n], the same.
        still: speed below which there is no direction of motion, m/s.
    """
    out = theta.copy()
    last = np.nan
    for i in range(len(theta)):
        if vx[i] * vx[i] + vy[i] * vy[i] >= still * still:
            last = np.arctan2(vy[i], vx[i])
        if np.isnan(theta[i]):
            out[i] = last
    return out


@numba.njit(cache=True, nogil=True)
def _pose(
    x: F64, y: F64, vx: F64, vy: F64, theta: F64, at: I64, still: float, omnidirectional: bool, out: F64
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
def _ball(x: F64, y: F64, vx: F64, vy: F64, at: I64, segment: I32, still: float, out: F64) -> None:
    """Fill columns ``at`` [n] of ``out`` [8, T] with x, y, speed, and cos and sin of the direction of travel.

    While the ball is still, its last direction of the segment is held.
    """
    cos, sin = np.nan, np.nan
    for i in range(len(x)):
        k = at[i]
        for j in range(at[i - 1] if i > 0 else k, k):
            if segment[j + 1] != segment[j]:
                cos, sin = np.nan, np.nan
        speed = np.sqrt(vx[i] * vx[i] + vy[i] * vy[i])
        if speed >= still:
            cos, sin = vx[i] / speed, vy[i] / speed
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = x[i], y[i], speed, cos, sin


@numba.njit(cache=True, nogil=True)
def jolts(x: F64, y: F64, t_ns: I64, segment: I32, at: I64, out: F64) -> None:
    """Fill rows 5 and 6 of columns ``at`` [n] of ``out`` [8, T]: jolt and gain of the ball, m/s.

    The velocity after is the slope of the least-squares line through the samples of the last
    ``_JOLT_NS``, at least two. The velocity before is that of the samples before them. The jolt is the
    length of their difference, less ``_ROLLING`` of the speed before, at least 0. The gain is the speed
    after minus the speed before, at the greatest jolt of the last ``_JOLT_NS``: while a jolt passes
    through one of the windows, two courses cancel there, and the ball only seems to be slow. Both are 0
    where the segment's samples do not reach back so far.
    """
    begin = 0
    sizes, gains = np.zeros(len(x)), np.zeros(len(x))
    for i in range(len(x)):
        if segment[i] != segment[begin] or (i > 0 and t_ns[i] - t_ns[i - 1] > _JOLT_LONGEST_NS):
            begin = i
        middle = i
        while middle > begin and (middle == i or t_ns[i] - t_ns[middle] < _JOLT_NS - 1000):
            middle -= 1
        first = middle
        while first > begin and (first == middle or t_ns[middle] - t_ns[first] < _JOLT_NS - 1000):
            first -= 1
        out[5, at[i]] = out[6, at[i]] = 0.0
        if middle == i or first == middle:
            continue
        vx, vy = _slope(x, t_ns, middle, i), _slope(y, t_ns, middle, i)
        ux, uy = _slope(x, t_ns, first, middle), _slope(y, t_ns, first, middle)
        after, before = np.sqrt(vx * vx + vy * vy), np.sqrt(ux * ux + uy * uy)
        jolt = np.sqrt((vx - ux) * (vx - ux) + (vy - uy) * (vy - uy)) - _ROLLING * before
        sizes[i], gains[i] = max(jolt, 0.0), after - before
        peak = j = i
        while j >= begin and t_ns[i] - t_ns[j] <= _JOLT_NS + 1000:
            peak = j if sizes[j] > sizes[peak] else peak
            j -= 1
        out[5, at[i]], out[6, at[i]] = sizes[i], gains[peak]


@numba.njit(cache=True, nogil=True)
def _slope(values: F64, t_ns: I64, first: int, last: int) -> float:
    """Slope of the least-squares line through samples [first, last], per second."""
    n = last - first + 1
    t_mean, mean = 0.0, 0.0
    for i in range(first, last + 1):
        t_mean += (t_ns[i] - t_ns[first]) * 1e-9
        mean += values[i] - values[first]
    t_mean, mean = t_mean / n, mean / n
    moment, spread = 0.0, 0.0
    for i in range(first, last + 1):
        dt = (t_ns[i] - t_ns[first]) * 1e-9 - t_mean
        moment += dt * (values[i] - values[first] - mean)
        spread += dt * dt
    return moment / spread
