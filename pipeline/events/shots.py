"""Shots: touches after which the ball would roll into the adversary's goal."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from pipeline.arrays import F64, I64, Bools
from pipeline.events.control import NOBODY, Control
from pipeline.events.views import tabled, towards
from pipeline.pitch import Kind, Pitch
from pipeline.settings import EventSettings
from schemas import ROLES, SIDES, Shots


class Rolling(NamedTuple):
    """How a free ball rolls.

    Attributes:
        deceleration: m/s², whatever its speed.
        drag: what it loses of its speed on each metre, m/s.
        least: speed at the goal line above which it is a shot, m/s.
    """

    deceleration: float
    drag: float
    least: float

    def at(self, speed: F64, distance: F64) -> F64:
        """Speed after a distance, m/s; 0 if it does not get so far. Only one of the two slows a ball."""
        left = np.sqrt(np.maximum(speed**2 - 2 * self.deceleration * distance, 0.0))
        return np.maximum(left - self.drag * distance, 0.0)


#: VSSS: the arena's ball (``pipeline.arena.physics.settings``). SSL: median of the slow free balls of a
#: recording of 2025 (0.25 m/s²); a fast kick slides first and loses a third of its speed. 2D: the server's
#: ball_decay of 0.94 a cycle of 0.1 s, and loganalyzer3's least speed of 1 m a cycle.
ROLLING = {
    Kind.VSSS: Rolling(0.34, 0.0, 0.0),
    Kind.SSL: Rolling(0.25, 0.0, 0.0),
    Kind.SIM2D: Rolling(0.0, (1 - 0.94) / 0.1, 10.0),
}


def shots(
    control: Control, trajectories: pl.DataFrame, over: pl.DataFrame, pitch: Pitch, settings: EventSettings
) -> pl.DataFrame:
    """Rows of schema Shots of one match.

    Args:
        control: of the match.
        trajectories: rows of schema Trajectories of the match.
        over: how its segments ended (:func:`pipeline.episodes.episodes`).
        pitch: pitch of the match.
        settings: of the stage.
    """
    ball, contacts = control.ball, control.contacts
    last, following = _left(control)
    team, robot = contacts.team[control.toucher[last]], contacts.robot[control.toucher[last]]
    lines = [ball.course(int(here), None if to == NOBODY else int(to), settings.line_s)
             for here, to in zip(last, following, strict=True)]
    x, y, dx, dy, took = np.array(lines, dtype=np.float64).reshape(-1, 5).T
    turn = towards(team)
    x, y, dx, dy = x * turn, y * turn, dx * turn, dy * turn
    found = _goes_in(x, y, dx, dy, took, pitch)
    speed = np.hypot(dx, dy)[found] / took[found]
    last, following, team, robot = last[found], following[found], team[found], robot[found]
    x, y = x[found], y[found]
    to_x = pitch.goal_x - x
    return tabled(Shots, trajectories, {
        "team": np.array(SIDES)[team],
        "t_ns": ball.t_ns[last],
        "segment": ball.segment[last],
        "robot": robot,
        "role": _roles(trajectories, ball.t_ns[last], team, robot),
        "x": x, "y": y,
        "speed": speed,
        "distance": np.hypot(to_x, y),
        "angle": _angle(to_x, y, pitch.goal_width / 2),
        "outcome": _outcomes(
            last, following, control, trajectories, over, round(settings.deflected_s * 1e9)),
    })


def _left(control: Control) -> tuple[I64, I64]:
    """The rows at which the ball leaves a robot for another or for nobody, and those of the next touch.

    Each int64 [n]; ``NOBODY`` if nobody touches it again in the segment.
    """
    toucher, ball, contacts = control.toucher, control.ball, control.contacts
    rows = np.flatnonzero(toucher != NOBODY)
    following = np.append(rows[1:], NOBODY)[:len(rows)]
    if len(rows):
        following[ball.segment[following] != ball.segment[rows]] = NOBODY
        following[-1] = NOBODY
    own, next_ = toucher[rows], toucher[following]
    same = (contacts.team[own] == contacts.team[next_]) & (contacts.robot[own] == contacts.robot[next_])
    alone = control.team[rows] != NOBODY
    leaves = alone & ((following == NOBODY) | ~same)
    return rows[leaves], following[leaves]


def _goes_in(x: F64, y: F64, dx: F64, dy: F64, took: F64, pitch: Pitch) -> Bools:
    """Whether a ball rolls over the goal line at +x between the posts, [n]."""
    to_x = pitch.goal_x - x
    with np.errstate(invalid="ignore", divide="ignore"):
        share = to_x / dx
        at_line = ROLLING[pitch.kind].at(np.hypot(dx, dy) / took, np.hypot(to_x, dy * share))
        return (dx > 0) & (to_x > 0) & (np.abs(y + dy * share) < pitch.goal_width / 2) & (
            at_line > ROLLING[pitch.kind].least)


def _angle(to_x: F64, y: F64, half_goal: float) -> F64:
    """Angle at which a place sees the goal, rad, [n]."""
    left: F64 = np.arctan2(half_goal - y, to_x)
    right: F64 = np.arctan2(-half_goal - y, to_x)
    return left - right


def _roles(trajectories: pl.DataFrame, t_ns: I64, team: I64, robot: I64) -> pl.Series:
    """The roles of robots at some times, null where they are not seen, [n]."""
    asked = pl.DataFrame({"t_ns": t_ns, "side": team, "robot": robot}).with_columns(
        pl.lit(pl.Series(SIDES)).gather(pl.col("side")).alias("team") if len(team)
        else pl.lit(None, dtype=pl.String).alias("team"), pl.col("robot").cast(pl.Int16))
    seen = trajectories.filter(pl.col("team") != "ball").select(
        "t_ns", pl.col("team").cast(pl.String), "robot", "role")
    return asked.join(seen, on=("t_ns", "team", "robot"), how="left", maintain_order="left")["role"].cast(
        pl.Enum(ROLES))


def _outcomes(
    last: I64, following: I64, control: Control, trajectories: pl.DataFrame, over: pl.DataFrame, soon_ns: int
) -> pl.Series:
    """What came of shots, column outcome of schema Shots, [n]."""
    contacts, toucher, ball = control.contacts, control.toucher, control.ball
    touched = following != NOBODY
    team, other = contacts.team[toucher[last]], contacts.team[toucher[following]]
    by = _roles(trajectories, ball.t_ns[following], other, contacts.robot[toucher[following]])
    ends = {episode: (over_ns, scorer)
            for episode, over_ns, scorer in over.select("episode", "over_ns", "scorer").iter_rows()}
    scored = np.zeros(len(last), dtype=np.bool_)
    for index, here in enumerate(last):
        over_ns, scorer = ends[int(ball.segment[here])]
        scored[index] = (
            scorer == SIDES[team[index]] and over_ns - ball.t_ns[here] <= soon_ns
            and not _touches_after(control, int(here), int(np.searchsorted(ball.t_ns, over_ns))))
    return pl.DataFrame({
        "touched": touched, "own": other == team, "keeper": (by == "goalkeeper").fill_null(value=False),
        "scored": scored,
    }).select(
        pl.when("scored").then(pl.lit("goal"))
        .when(pl.col("touched") & pl.col("own")).then(pl.lit("own"))
        .when(pl.col("touched") & pl.col("keeper")).then(pl.lit("saved"))
        .when("touched").then(pl.lit("blocked"))
        .otherwise(pl.lit("missed")).alias("outcome"))["outcome"]


def _touches_after(control: Control, here: int, until: int) -> bool:
    """Whether the team of the robot that touches at row ``here`` touches after it and before ``until``."""
    contacts = control.contacts
    own = contacts.team == contacts.team[control.toucher[here]]
    return bool(np.any(own & (contacts.last > here) & (contacts.first < until)))
