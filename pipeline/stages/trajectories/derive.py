"""Trajectories of a log: frames cleaned, turned, cut into stretches of play, with velocities and roles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.base.errors import DamagedLog
from pitchlore.pipeline.game.pitch import SCALES, Scales
from pitchlore.pipeline.matches.frame import MatchLog, home_attacks, runs, wrap
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.numbers.arrays import F32, F64, I8, I32, I64, U8, Bools
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.kinematics import REPEATED, assign_roles, find_jumps, slopes
from pitchlore.pipeline.stages.trajectories.timeline import Stretches, cut_stretches, find_gaps, order_samples
from pitchlore.schemas import AWAY, BODIES, ROLES, Trajectories

_BALL = BODIES.index("ball")
_HOME = np.uint8(BODIES.index("home"))
_NO_ROLE = len(ROLES)
_NOWHERE = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class _Bodies:
    """Rows of the ball or of robots, each field [n].

    Attributes:
        frame: index of the sample in order of time.
        team: index into BODIES.
        robot: number of the robot, 0 for the ball.
        role: index into ROLES, _NO_ROLE for the ball.
        x, y, theta: metres and radians, home attacks +x; theta is NaN where unknown.
    """

    frame: I64
    team: U8
    robot: npt.NDArray[np.uint16]
    role: I8
    x: F32
    y: F32
    theta: F32

    def __len__(self) -> int:
        return len(self.frame)

    def key(self) -> I32:
        """Number of the body of each row, int32 [n], in the order of the schema."""
        return self.team.astype(np.int32) << 16 | self.robot

    def take(self, rows: I64 | Bools) -> _Bodies:
        """Bodies of some of the rows."""
        return _Bodies(*(getattr(self, name)[rows] for name in self.__slots__))


def trajectories(log: MatchLog, settings: TrajectorySettings) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Every body at every sample, and the flaws of the samples.

    Velocities are slopes of least-squares lines over a window of ``window_s`` centred on the sample
    (and at least ``window_samples``). The window ends where the stretch of play does, at a hole of the
    body longer than ``hole_s``, and where the body was put elsewhere. A suspect sample counts as a
    missing body and has no velocity. Headings are unwrapped first, so a body must turn by less than half
    a turn from one sample to the next. A centred window has no delay; where it is cut short, the
    estimate belongs to the middle of the rest, and lags or leads by up to ``window_s / 4``. Noise of
    standard deviation s in the position becomes
    ``s / h * sqrt(12 / (m * (m**2 - 1)))`` in the velocity, for m samples h apart: 11 s a second at
    60 Hz and 13 s at 40 Hz with the default window.

    A body that jumps further than ``max_speed * dt`` plus a robot's radius is suspect; real vision and
    its clock err by that radius (docs/decisions/trajectories.md). Once the body has kept to its new place
    for ``jump_accept_s``, it counts as put there, and for the ball a new segment begins.

    Args:
        log: log of the match; its frames as recorded, in any order.
        settings: settings of the stage.

    Returns:
        Rows of schema Trajectories, sorted as it says: one for each body with finite x and y in each
        frame that is kept. And rows of schema Quality for the flaws found here: duplicate frame,
        reordered frame, clock jump back, clock leap ahead, gap, not a number, ball jump, robot jump,
        ball lost.

    Raises:
        DamagedLog: if a robot has a team other than home or away, or a number over 32767.
    """
    info = log.info
    if not len(log.frames):
        return Trajectories.empty(), quality_table(info.match_id, [])
    scales = SCALES[info.pitch.kind]
    gap_ns, hole_ns, accept_ns = _ns(settings.gap_s), _ns(settings.hole_s), _ns(settings.jump_accept_s)

    order, flaws = order_samples(log.frames.t_ns, _ns(settings.reorder_s))
    t_ns = log.frames.t_ns[order]
    sign = home_attacks(info.periods, t_ns)
    ball, infinite = _finite(_turn(_ball(log, order), sign), t_ns, "ball")
    robots, not_numbers = _finite(_turn(_robots(log, order), sign), t_ns, None)
    robots, repeated = _with_roles(robots, info.pitch.goal_x, t_ns)

    stretches = cut_stretches(t_ns, log.referee, info.periods, gap_ns, _NOWHERE)
    ball_suspect, ball_moved = _jumps(ball, t_ns, stretches, scales.max_ball_speed, scales, accept_ns)
    stretches = cut_stretches(t_ns, log.referee, info.periods, gap_ns, ball.frame[ball_moved])
    suspect, moved = _jumps(robots, t_ns, stretches, scales.max_robot_speed, scales, accept_ns)

    flaws += find_gaps(t_ns, gap_ns) + infinite + not_numbers + repeated
    flaws += _jump_flaws(ball, t_ns, ball_suspect, ball_moved) + _jump_flaws(robots, t_ns, suspect, moved)
    flaws += _ball_lost(ball, t_ns, hole_ns)

    bodies = _Bodies(*(np.concatenate((getattr(ball, f), getattr(robots, f))) for f in _Bodies.__slots__))
    suspect, moved = np.concatenate((ball_suspect, suspect)), np.concatenate((ball_moved, moved))
    vx, vy, omega = _velocities(bodies, t_ns, stretches, suspect, moved, settings)
    segment = stretches.segment[bodies.frame]
    table = pl.DataFrame(
        {
            "frame": bodies.frame.astype(np.uint32),
            "t_ns": t_ns[bodies.frame],
            "team": pl.Series(BODIES, dtype=pl.Enum(BODIES)).gather(bodies.team),
            "robot": bodies.robot.astype(np.int16),
            "role": pl.Series((*ROLES, None), dtype=pl.Enum(ROLES)).gather(bodies.role),
            "x": bodies.x,
            "y": bodies.y,
            "theta": bodies.theta,
            "vx": vx,
            "vy": vy,
            "omega": omega,
            "segment": segment,
            "suspect": suspect,
            "turned": sign[bodies.frame] < 0,
        }
    ).with_columns(
        pl.lit(info.match_id).alias("match_id"),
        pl.when(pl.col("team") != "ball").then("robot"),
        pl.col("theta", "vx", "vy", "omega").fill_nan(None),
        pl.when(pl.col("segment") >= 0).then("segment"),
    )
    return table.select(*Trajectories.dtypes()), quality_table(info.match_id, flaws)


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)


def _ball(log: MatchLog, order: I64) -> _Bodies:
    """Ball in each kept frame, as logged."""
    ball = log.frames.ball[order]
    n = len(ball)
    return _Bodies(
        frame=np.arange(n, dtype=np.int64),
        team=np.full(n, _BALL, dtype=np.uint8),
        robot=np.zeros(n, dtype=np.uint16),
        role=np.full(n, _NO_ROLE, dtype=np.int8),
        x=ball["x"].copy(),
        y=ball["y"].copy(),
        theta=np.full(n, np.nan, dtype=np.float32),
    )


def _robots(log: MatchLog, order: I64) -> _Bodies:
    """Robots in each kept frame, as logged, frame by frame, without roles."""
    counts = log.frames.counts()[order]
    ends = np.cumsum(counts)
    # consecutive rows from each frame's own offset on
    shift = log.frames.offsets[order] - (ends - counts)
    rows = np.arange(int(counts.sum()), dtype=np.int64) + np.repeat(shift, counts)
    # field by field: gathering whole records is several times slower
    team, robot, x, y, theta = (log.frames.robots[name][rows] for name in ("team", "id", "x", "y", "theta"))
    if team.max(initial=0) > AWAY or robot.max(initial=0) > np.iinfo(np.int16).max:
        raise DamagedLog(
            "a robot has a team other than 0 and 1, or a number over 32767",
            where=log.info.match_id, next_step="Import or record the match again",
        )
    return _Bodies(
        frame=np.repeat(np.arange(len(order), dtype=np.int64), counts),
        team=team + _HOME,
        robot=robot,
        role=np.full(len(rows), _NO_ROLE, dtype=np.int8),
        x=x,
        y=y,
        theta=theta,
    )


def _turn(bodies: _Bodies, sign: I8) -> _Bodies:
    """Bodies turned so that home attacks +x; ``sign`` is home's direction at each sample, int8 [F]."""
    of_row = sign[bodies.frame].astype(np.float32)
    theta = np.where(np.isfinite(bodies.theta), bodies.theta, np.float32(np.nan))
    theta[of_row < 0] += np.float32(np.pi)
    outside = np.abs(theta) >= np.float32(np.pi)  # few: wrapping is costly
    theta[outside] = wrap(theta[outside])
    # adding zero makes -0.0 the 0.0 that an unturned log has
    return replace(bodies, x=bodies.x * of_row + 0, y=bodies.y * of_row + 0, theta=theta)


def _finite(bodies: _Bodies, t_ns: I64, team: str | None) -> tuple[_Bodies, list[Flaw]]:
    """The bodies with a finite position, and a flaw for the others; NaN of the ball means unseen, no flaw."""
    usable = np.isfinite(bodies.x) & np.isfinite(bodies.y)
    if usable.all():
        return bodies, []
    bad = ~usable
    if team == "ball":
        bad &= ~(np.isnan(bodies.x) | np.isnan(bodies.y))
    note = "position is not a number: left out"
    return bodies.take(usable), _flaw_over("not a number", t_ns[bodies.frame[bad]], note, team)


def _flaw_over(flaw: str, times: I64, note: str, team: str | None = None) -> list[Flaw]:
    """One flaw over all the times; none without times."""
    return [Flaw(flaw, note, len(times), int(times.min()), int(times.max()) + 1, team)] if len(times) else []


def _with_roles(robots: _Bodies, goal_x: float, t_ns: I64) -> tuple[_Bodies, list[Flaw]]:
    """Robots with their roles, body-contiguous, each once per frame, and a flaw for repeated ones."""
    role = assign_roles(robots.frame, robots.team - _HOME, robots.robot, robots.x, robots.y, goal_x)
    twice = role == REPEATED
    note = "robot twice in a frame: the first is kept"
    flaws = _flaw_over("duplicate frame", t_ns[robots.frame[twice]], note)
    robots = replace(robots, role=role)
    if flaws:
        robots = robots.take(~twice)
    # numpy sorts 16 bits by radix, and the key fits: the team is the highest bit, the number the rest
    key = (robots.team - _HOME).astype(np.uint16) << np.uint16(15) | robots.robot
    return robots.take(np.argsort(key, kind="stable")), flaws


def _parts(bodies: _Bodies, stretches: Stretches, also: Bools | None = None) -> I64:
    """Part of each row, int64 [n]: it changes with the body, with the stretch, and where ``also`` is true."""
    key, number = bodies.key(), stretches.number[bodies.frame]
    change = np.zeros(len(bodies), dtype=np.bool_)
    change[1:] = (np.diff(key) != 0) | (np.diff(number) != 0)
    return np.cumsum(change if also is None else change | also, dtype=np.int64)


def _jumps(
    bodies: _Bodies, t_ns: I64, stretches: Stretches, max_speed: float, scales: Scales, accept_ns: int
) -> tuple[Bools, Bools]:
    """Masks of suspect rows, and of rows where a body was put elsewhere; bool [n] each."""
    suspect, moved = find_jumps(
        bodies.key(), _parts(bodies, stretches), t_ns[bodies.frame], bodies.x, bodies.y,
        max_speed, scales.robot_radius, accept_ns,
    )
    return suspect, moved


def _jump_flaws(bodies: _Bodies, t_ns: I64, suspect: Bools, moved: Bools) -> list[Flaw]:
    """One flaw for each run of suspect rows of a body, and one for each time it was put elsewhere."""
    key = bodies.key()
    found = []
    for begin, end in runs(suspect):
        # a run of rows may go on from one body to the next
        inner = np.flatnonzero(np.diff(key[begin:end])) + begin + 1
        edges = [begin, *inner.tolist(), end]
        found += [(a, b, "implausible: suspect") for a, b in pairwise(edges)]
    found += [(i, i + 1, "put elsewhere: accepted") for i in np.flatnonzero(moved).tolist()]
    flaws = []
    for begin, end, note in sorted(found):
        team = BODIES[bodies.team[begin]]
        is_ball = team == "ball"
        flaws.append(
            Flaw(
                "ball jump" if is_ball else "robot jump",
                note + ", a new segment begins" if is_ball and note.startswith("put") else note,
                end - begin, int(t_ns[bodies.frame[begin]]), int(t_ns[bodies.frame[end - 1]]) + 1,
                team, None if is_ball else int(bodies.robot[begin]),
            )
        )
    return flaws


def _ball_lost(ball: _Bodies, t_ns: I64, hole_ns: int) -> list[Flaw]:
    """Flaws of a lost ball: one per time longer than ``hole_ns`` with frames but no ball."""
    lost = np.ones(len(t_ns), dtype=np.bool_)
    lost[ball.frame] = False
    flaws = []
    for begin, end in runs(lost):
        back = int(t_ns[end]) if end < len(t_ns) else int(t_ns[-1]) + 1
        if back - t_ns[begin] > hole_ns:
            flaws.append(Flaw("ball lost", "no ball: no rows", end - begin, int(t_ns[begin]), back, "ball"))
    return flaws


def _velocities(
    bodies: _Bodies, t_ns: I64, stretches: Stretches, suspect: Bools, moved: Bools,
    settings: TrajectorySettings,
) -> tuple[F32, F32, F32]:
    """Velocities vx, vy (m/s) and omega (rad/s), float32 [n] each; NaN where they cannot be estimated."""
    part = _parts(bodies, stretches, moved)
    times = t_ns[bodies.frame]
    half_ns, hole_ns = _ns(settings.window_s / 2), _ns(settings.hole_s)

    def fit(rows: I64, values: F64) -> F32:
        cut = np.diff(part[rows], prepend=0) != 0
        cut[1:] |= np.diff(times[rows]) > hole_ns
        piece = np.cumsum(cut, dtype=np.int64)
        out = np.full((len(values), len(bodies)), np.nan, dtype=np.float32)
        out[:, rows] = slopes(piece, times[rows], values, half_ns, settings.window_samples)
        return out

    rows = np.flatnonzero(~suspect)
    vx, vy = fit(rows, np.stack((bodies.x[rows], bodies.y[rows])).astype(np.float64))
    rows = np.flatnonzero(~suspect & np.isfinite(bodies.theta))
    theta = bodies.theta[rows].astype(np.float64)
    turns = np.cumsum(np.rint(np.diff(theta, prepend=theta[:1]) / (2 * np.pi)))
    (omega,) = fit(rows, (theta - 2 * np.pi * turns)[None, :])
    return vx, vy, omega
