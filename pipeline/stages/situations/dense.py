"""A match, or the next part of it, as dense arrays: every robot and the ball at every sample."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.game.pitch import Scales
from pitchlore.pipeline.numbers.arrays import F64, I8, I32, I64, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.schemas import BODIES

#: The ball's name as a team.
BALL = BODIES[0]

#: Speed below which a body has no direction of motion, m/s, to be multiplied by the kind's speed scale.
STILL = 0.05

#: The ball's velocities before and after a jolt are taken over at least this time each.
_JOLT_NS = 50_000_000
#: Longest time between samples for that; a longer one begins anew.
_JOLT_LONGEST_NS = 200_000_000
#: No jolt or gain depends on samples from longer before: the peak's window, and two velocities.
_JOLT_REACH_NS = _JOLT_NS + 2 * (_JOLT_NS + _JOLT_LONGEST_NS)
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
    """The dense arrays of a whole match; arguments and errors are those of :meth:`Densifier.take`."""
    return Densifier(scales).take(trajectories)


class Densifier:
    """Makes the dense arrays of a match that comes part by part.

    The arrays of the parts, put together, are those of the whole match, however it is parted.

    Args:
        scales: distances and speeds of the kind of match.
    """

    def __init__(self, scales: Scales) -> None:
        self._scales = scales
        self._segment = -1
        self._direction = np.full(2, np.nan)
        self._moved: dict[tuple[int, int], F64] = {}
        self._roles: dict[tuple[int, int], int] = {}
        self._rolled = _Rolled(np.empty(0), np.empty(0), np.empty(0, np.int64), np.empty(0, np.int32))

    def take(self, trajectories: pl.DataFrame) -> DenseMatch:
        """The dense arrays of the next part, of those robots that have a row in it.

        A row counts as a missing body if it is suspect, its position is not finite, or a robot has no role.

        Args:
            trajectories: rows of schema Trajectories of one match, sorted as it says; not empty, and later
                than all before. It may have a column z, the ball's height, metres, null where not known.

        Raises:
            SchemaMismatch: if a body's rows are not together and in order of time.
        """
        scales = self._scales
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
        usable = np.isfinite(x) & np.isfinite(y) & (is_ball | (roles >= 0))
        usable &= ~trajectories["suspect"].to_numpy()

        still = STILL * scales.speed
        ball = np.full((8, samples), np.nan)
        ball[7] = 0.0
        robots = [body for body in bodies if body[0] != BODIES.index(BALL)]
        poses = np.full((7, len(robots), samples), np.nan)
        present = np.zeros((len(robots), samples), dtype=np.bool_)
        role = np.full((len(robots), samples), -1, dtype=np.int8)
        at, motion = np.empty(0, np.int64), (np.empty(0),) * 4
        for body, rows in bodies.items():
            keep = usable[rows]
            here = sample[rows][keep]
            moves = (x[rows][keep], y[rows][keep], vx[rows][keep], vy[rows][keep])
            if body in robots:
                row = robots.index(body)
                present[row, here] = True
                role[row, here] = roles[rows][keep]
                _carry(role[row], self._roles.get(body, -1))
                self._roles[body] = int(role[row, -1])
                heading = theta[rows][keep]
                if scales.heads_as_it_moves:
                    last = self._moved.setdefault(body, np.full(1, np.nan))
                    heading = headings(heading, moves[2], moves[3], still, last)
                _pose(*moves, heading, here, still, scales.omnidirectional, poses[:, row])
            else:
                at, motion = here, moves
                if "z" in trajectories.columns:
                    z = trajectories["z"].fill_null(0.0).to_numpy().astype(np.float64)
                    ball[7, at] = np.maximum(z[rows][keep] - scales.reach, 0.0)
        _ball(*motion, at, segment, self._segment, self._direction, still, ball)
        self._segment = int(segment[-1])
        self._jolts(_Rolled(motion[0], motion[1], t_ns[at], segment[at]), at, ball)
        return DenseMatch(
            t_ns=t_ns, segment=segment,
            team=np.array([team - BODIES.index("home") for team, _ in robots], dtype=np.int8),
            robot=np.array([robot for _, robot in robots], dtype=np.int64),
            present=present, role=role, poses=poses, ball=ball,
        )

    def _jolts(self, part: _Rolled, at: I64, ball: F64) -> None:
        """Fill the rows of jolt and gain in the columns ``at`` of ``ball``, where the ball is seen."""
        last = self._rolled
        before = len(last.x)
        rolled = _Rolled(
            np.concatenate((last.x, part.x)), np.concatenate((last.y, part.y)),
            np.concatenate((last.t_ns, part.t_ns)), np.concatenate((last.segment, part.segment)),
        )
        found = jolts(*rolled)
        ball[5:7, at] = found[:, before:]
        if len(rolled.t_ns):
            recent = rolled.t_ns >= rolled.t_ns[-1] - _JOLT_REACH_NS
            self._rolled = _Rolled(*(column[recent] for column in rolled))


class _Rolled(NamedTuple):
    """Samples of the ball: x and y, metres, time and segment, [n] each."""

    x: F64
    y: F64
    t_ns: I64
    segment: I32


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


@njit(cache=True, nogil=True)
def _carry(role: I8, last: int) -> None:
    """Fill unknown roles with the last known one, in place; ``last`` is that of before."""
    for k in range(len(role)):
        if role[k] < 0:
            role[k] = last
        last = role[k]


@njit(cache=True, nogil=True)
def headings(theta: F64, vx: F64, vy: F64, still: float, last: F64) -> F64:
    """Headings of a body, float64 [n]; where one is not known it is the direction of motion.

    While the body is slower than ``still`` it keeps the last direction in which it moved. The heading is NaN
    before the body first moves.

    Args:
        theta: [n], rad; NaN where not known.
        vx: [n], m/s; NaN where not known.
        vy: [n], the same.
        still: speed below which there is no direction of motion, m/s.
        last: [1], last direction in which it moved, NaN before; changed.
    """
    out = theta.copy()
    for i in range(len(theta)):
        if vx[i] * vx[i] + vy[i] * vy[i] >= still * still:
            last[0] = np.arctan2(vy[i], vx[i])
        if np.isnan(theta[i]):
            out[i] = last[0]
    return out


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def _ball(
    x: F64, y: F64, vx: F64, vy: F64, at: I64, segment: I32, before: int, direction: F64, still: float,
    out: F64,
) -> None:
    """Fill columns ``at`` [n] of ``out`` [8, T] with x, y, speed, and cos and sin of the direction of travel.

    While the ball is still, its last direction of the segment is held: ``direction`` [2], which is changed.
    The sample before the first one is of the segment ``before``.
    """
    i = 0
    for k in range(len(segment)):
        if segment[k] != before:
            direction[:] = np.nan
        before = segment[k]
        if i == len(at) or at[i] != k:
            continue
        speed = np.sqrt(vx[i] * vx[i] + vy[i] * vy[i])
        if speed >= still:
            direction[0], direction[1] = vx[i] / speed, vy[i] / speed
        out[0, k], out[1, k], out[2, k], out[3, k], out[4, k] = x[i], y[i], speed, direction[0], direction[1]
        i += 1


@njit(cache=True, nogil=True)
def jolts(x: F64, y: F64, t_ns: I64, segment: I32) -> F64:
    """Jolt and gain of the ball, m/s, float64 [2, n], at its n samples.

    The velocity after is the slope of the least-squares line through the samples of the last
    ``_JOLT_NS``, at least two. The velocity before is that of the samples before them. The jolt is the
    length of their difference, less ``_ROLLING`` of the speed before, at least 0. The gain is the speed
    after minus the speed before, at the greatest jolt of the last ``_JOLT_NS``: while a jolt passes
    through one of the windows, two courses cancel there, and the ball only seems to be slow. Both are 0
    where the segment's samples do not reach back so far.
    """
    begin = 0
    sizes, gains = np.empty(len(x), dtype=np.float64), np.empty(len(x), dtype=np.float64)
    out = np.empty((2, len(x)), dtype=np.float64)
    for i in range(len(x)):
        sizes[i] = gains[i] = out[0, i] = out[1, i] = 0.0
        if segment[i] != segment[begin] or (i > 0 and t_ns[i] - t_ns[i - 1] > _JOLT_LONGEST_NS):
            begin = i
        middle = i
        while middle > begin and (middle == i or t_ns[i] - t_ns[middle] < _JOLT_NS - 1000):
            middle -= 1
        first = middle
        while first > begin and (first == middle or t_ns[middle] - t_ns[first] < _JOLT_NS - 1000):
            first -= 1
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
        out[0, i], out[1, i] = sizes[i], gains[peak]
    return out


@njit(cache=True, nogil=True)
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
