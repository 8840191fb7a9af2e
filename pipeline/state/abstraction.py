"""The abstract state: the levels of the 36 elements for one team, from poses and velocities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.numbers.arrays import F64, I64, U8, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.state.table import (
    AFTER_BALL,
    BALL_DISTANCE,
    BALL_ORIENTATION,
    DIRECTION,
    DRAWING,
    ELEMENTS,
    FAULT,
    GOAL,
    GOAL_DISTANCE,
    GOAL_ORIENTATION,
    NORMAL,
    SCORE,
    SITUATION,
    SPEED,
)
from pitchlore.schemas import ROLES, SIDES


class BinEdges(NamedTuple):
    """Edges between levels; a distance, angle or speed equal to an edge is of the lower level.

    Attributes:
        too_close: robot to ball, metres.
        near: robot to ball, metres.
        very_close: ball to goal, metres.
        close: ball to goal, metres.
        front: orientation to the ball, radians.
        side: orientation to the ball, radians (it is itself "back").
        pointing: half the angle under which a robot points at a goal at least, radians.
        slow: upper limit of a slow ball, m/s.
        medium: upper limit of a ball of medium speed, m/s.
        moving: a ball at least so fast has a direction, m/s.
        goal_x: goal line from the centre, metres.
        half_goal: half the goal's width, metres.
    """

    too_close: float
    near: float
    very_close: float
    close: float
    front: float
    side: float
    pointing: float
    slow: float
    medium: float
    moving: float
    goal_x: float
    half_goal: float

    @classmethod
    def of(cls, pitch: Pitch) -> BinEdges:
        """The break points on a pitch.

        On a VSSS pitch: 0.20 and 0.45 m (crossings of the fuzzy Distance), 0.40 m (corner of the
        goal area) and 0.75 m (half the field), 0.10, 0.60 and 0.05 m/s. Elsewhere the first two
        and the speeds go with the league's robots, the others with the pitch's length.
        """
        scales = SCALES[pitch.kind]
        return cls(
            too_close=scales.close, near=scales.near,
            very_close=0.40 / 1.5 * pitch.length, close=pitch.length / 2,
            front=np.pi / 4, side=3 * np.pi / 4, pointing=np.pi / 6,
            slow=0.10 * scales.speed, medium=0.60 * scales.speed, moving=0.05 * scales.speed,
            goal_x=pitch.goal_x, half_goal=pitch.goal_width / 2,
        )


class Observation(NamedTuple):
    """One moment of a match as one team observes it.

    Attributes:
        robots: float64 [R, 3], x, y, theta of the robots of both teams, pitch frame.
        sides: int64 [R], 0 for the observing team, 1 for the adversary.
        roles: int64 [R], index in ``schemas.ROLES``.
        ball: float64 [4], x, y, vx, vy, pitch frame.
        flip: 1.0 if the observing team attacks +x, else -1.0.
        direction: direction of the ball's last motion, pitch frame, radians; NaN if it never moved.
        score: level 0 losing, 1 drawing, 2 winning.
        situation: level 0 normal, 1 fault, 2 goal.
    """

    robots: F64
    sides: I64
    roles: I64
    ball: F64
    flip: float
    direction: float
    score: int
    situation: int


@njit(cache=True, nogil=True)
def abstract_state(seen: Observation, edges: BinEdges, out: U8) -> bool:
    """Write the levels of the 36 elements into ``out``; false if they are not known.

    A slot is filled by the robot of its role, of several the nearest to the ball. If nobody has the
    role, the robot whose role is nearest in rank fills it (again nearest to the ball). A side may have
    any number of robots, and a robot may fill several slots.

    Args:
        seen: the moment.
        edges: edges of the pitch.
        out: uint8 [36], written.

    Returns:
        Whether the state is known: false if the ball, its speed, a side's robots or a slot's heading is
        missing; ``out`` is then all 0.
    """
    robots, ball, flip, direction = seen.robots, seen.ball, seen.flip, seen.direction
    out[:] = 0
    bx, by = ball[0], ball[1]
    speed = np.hypot(ball[2], ball[3])
    if np.isnan(bx + by + speed):
        return False
    for slot in range(6):
        side, role = slot // 3, slot % 3
        best, best_rank, best_distance = -1, 3, np.inf
        for r in range(len(robots)):
            if seen.sides[r] != side:
                continue
            rank = abs(seen.roles[r] - role)
            distance = np.hypot(robots[r, 0] - bx, robots[r, 1] - by)
            if rank < best_rank or (rank == best_rank and distance < best_distance):
                best, best_rank, best_distance = r, rank, distance
        if best < 0 or np.isnan(robots[best, 2]):
            out[:] = 0  # slots before this one are written
            return False
        x, y, theta = robots[best, 0], robots[best, 1], robots[best, 2]
        attacks = flip if side == 0 else -flip
        out[BALL_DISTANCE + slot] = _level(best_distance, edges.too_close, edges.near)
        bearing = np.abs(_turn(np.arctan2(by - y, bx - x) - theta))
        out[BALL_ORIENTATION + slot] = 0 if bearing <= edges.front else (2 if bearing >= edges.side else 1)
        for goal in range(2):
            gx = attacks * edges.goal_x * (2 * goal - 1)
            bearing = np.abs(_turn(np.arctan2(-y, gx - x) - theta))
            reach = max(edges.pointing, np.arctan2(edges.half_goal, np.hypot(gx - x, y)))
            out[GOAL_ORIENTATION + 2 * slot + goal] = 1 if bearing <= reach else 0
        out[AFTER_BALL + slot] = 1 if attacks * (x - bx) > 0 else 0
    for goal in range(2):
        distance = np.hypot(bx - flip * edges.goal_x * (2 * goal - 1), by)
        out[GOAL_DISTANCE + goal] = _level(distance, edges.very_close, edges.close)
    if not np.isnan(direction):
        sector = int(np.floor((direction + np.pi / 8) / (np.pi / 4)))
        out[DIRECTION] = (sector if flip > 0 else sector + 4) % 8
    out[SPEED] = _level(speed, edges.slow, edges.medium)
    out[SCORE] = seen.score
    out[SITUATION] = seen.situation
    return True


@njit(cache=True, nogil=True)
def _level(value: float, low: float, high: float) -> int:
    """0 up to ``low``, 1 up to ``high``, else 2."""
    return 0 if value <= low else (1 if value <= high else 2)


@njit(cache=True, nogil=True)
def _turn(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


class _Samples(NamedTuple):
    """The bodies at M samples of a match, in order of time.

    Attributes:
        robots: float64 [R, 3], x, y, theta of the robots of all samples.
        teams: int64 [R], 0 home, 1 away.
        roles: int64 [R], index in ``schemas.ROLES``.
        offsets: int64 [M + 1]; sample m has the robots ``offsets[m]`` to ``offsets[m + 1]``, exclusive.
        ball: float64 [M, 4], x, y, vx, vy.
        direction: float64 [M], of the ball's last motion, radians; NaN if it never moved.
    """

    robots: F64
    teams: I64
    roles: I64
    offsets: I64
    ball: F64
    direction: F64


@njit(cache=True, nogil=True)
def _abstract_all(
    at: _Samples, sample: I64, team: I64, score: I64, situation: I64, edges: BinEdges, out: U8, known: Bools
) -> None:
    """Write the levels of K observations into ``out``, uint8 [K, 36], and into ``known``, bool [K].

    ``sample`` [K] is -1 where there is no sample.
    """
    for k in range(len(sample)):
        m = sample[k]
        if m < 0:
            continue
        lo, hi = at.offsets[m], at.offsets[m + 1]
        sides = np.abs(at.teams[lo:hi] - team[k])
        seen = Observation(
            at.robots[lo:hi], sides, at.roles[lo:hi], at.ball[m], 1.0 - 2.0 * team[k], at.direction[m],
            score[k], situation[k],
        )  # fmt: skip
        known[k] = abstract_state(seen, edges, out[k])


def elements(
    trajectories: pl.DataFrame, referee: pl.DataFrame, pitch: Pitch, team: npt.NDArray[np.integer], t_ns: I64
) -> tuple[U8, Bools]:
    """Levels of the 36 elements as the observing teams see them at some samples of a match.

    Suspect rows count as missing. The score is the last that the referee reported by then; where
    the source does not log it, the goals counted so far (0 : 0 at the start). The game
    situation is normal in a segment; between segments it is a goal or a fault, by the
    referee's last event. The ball's direction is held while it is slower than
    ``BinEdges.moving``, within a segment; before it first moves the level is 0.

    Args:
        trajectories: rows of schema Trajectories of one match.
        referee: rows of schema Referee of the same match, in order of time.
        pitch: pitch of the match.
        team: [K], index of each observing team in ``schemas.SIDES``.
        t_ns: int64 [K], times of samples.

    Returns:
        Elements, uint8 [K, 36], and whether they are known, bool [K]. They are unknown, and 0,
        where there is no sample at that time or a body it takes is missing, see :func:`abstract_state`.
    """
    known = np.zeros(len(t_ns), dtype=np.bool_)
    out = np.zeros((len(t_ns), ELEMENTS), dtype=np.uint8)
    edges = BinEdges.of(pitch)
    wanted = pl.DataFrame({"t_ns": np.unique(t_ns)})
    balls = wanted.join(_balls(trajectories, edges.moving), on="t_ns").sort("t_ns")
    robots = (
        trajectories.filter(pl.col("team").is_in(SIDES), ~pl.col("suspect"), pl.col("role").is_not_null())
        .join(balls.select("t_ns"), on="t_ns", how="semi")
        .sort("t_ns", "team", "robot")
    )
    times = balls["t_ns"].to_numpy()
    offsets = np.searchsorted(robots["t_ns"].to_numpy(), np.append(times, np.iinfo(np.int64).max))
    at = np.searchsorted(times, t_ns)
    sample = np.where(np.isin(t_ns, times), at, -1)
    observer = np.asarray(team, dtype=np.int64)
    stopped = np.isin(t_ns, balls.filter(pl.col("segment").is_null())["t_ns"].to_numpy())
    samples = _Samples(
        robots.select("x", "y", "theta").cast(pl.Float64).fill_null(np.nan).to_numpy(order="c"),
        _index(robots["team"], SIDES), _index(robots["role"], ROLES), offsets,
        balls.select("x", "y", "vx", "vy").cast(pl.Float64).fill_null(np.nan).to_numpy(order="c"),
        balls["direction"].fill_null(np.nan).to_numpy(),
    )  # fmt: skip
    score = _score_levels(referee, observer, t_ns)
    situation = np.where(stopped, _stopped_levels(referee, t_ns), NORMAL)
    _abstract_all(samples, sample, observer, score, situation, edges, out, known)
    return out, known


def _score_levels(referee: pl.DataFrame, team: I64, t_ns: I64) -> I64:
    """Level of the score element for each team and time, int64 [K]; an event counts from its own time.

    A goal of which neither team nor score is known leaves the level as it was.
    """
    events = referee.filter(
        (pl.col("score_home").is_not_null() & pl.col("score_away").is_not_null())
        | ((pl.col("event") == "goal") & pl.col("team").is_not_null())
    )
    leads = [0]
    for event, scorer, home, away in events.select("event", "team", "score_home", "score_away").iter_rows():
        if home is not None and away is not None:
            leads.append(home - away)
        elif event == "goal":
            leads.append(leads[-1] + (1 if scorer == SIDES[0] else -1))
    lead = np.array(leads)[np.searchsorted(events["t_ns"].to_numpy(), t_ns, side="right")]
    return DRAWING + np.sign(np.where(team == 0, lead, -lead))


def _stopped_levels(referee: pl.DataFrame, t_ns: I64) -> I64:
    """Level of the game situation if play is stopped: what the last event by then was, int64 [K]."""
    levels = {"goal": GOAL, "fault": FAULT, "stop": FAULT, "half": FAULT, "end": FAULT}
    after = np.array([NORMAL, *(levels.get(event, NORMAL) for event in referee["event"])])
    return after[np.searchsorted(referee["t_ns"].to_numpy(), t_ns, side="right")]


def _balls(trajectories: pl.DataFrame, moving: float) -> pl.DataFrame:
    """The ball's rows with its held direction in radians (null before it moves)."""
    vx, vy = pl.col("vx").cast(pl.Float64), pl.col("vy").cast(pl.Float64)
    direction = pl.when((vx**2 + vy**2).sqrt() >= moving).then(pl.arctan2(vy, vx))
    return (
        trajectories.filter(pl.col("team") == "ball", ~pl.col("suspect"))
        .sort("t_ns")
        .with_columns(direction=direction.forward_fill().over(pl.col("segment").rle_id()))
    )


def _index(labels: pl.Series, categories: tuple[str, ...]) -> I64:
    """Index of each label in its categories, int64."""
    return labels.cast(pl.String).cast(pl.Enum(categories)).to_physical().to_numpy().astype(np.int64)
