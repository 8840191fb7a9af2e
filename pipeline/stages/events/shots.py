"""Shots: touches after which the ball would roll into the adversary's goal, or goes past it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Kind, Pitch
from pitchlore.pipeline.game.roles import roles
from pitchlore.pipeline.game.touches import BallInPlay
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.pipeline.settings import EventSettings
from pitchlore.pipeline.stages.events.control import NOBODY, Control
from pitchlore.pipeline.stages.events.in_way import in_way
from pitchlore.pipeline.stages.events.views import tabled, towards
from pitchlore.schemas import SIDES, Shots


class Rolling(NamedTuple):
    """How a free ball rolls.

    Attributes:
        deceleration: m/s², whatever its speed.
        drag: loss of speed on each metre, m/s.
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
#: ball_decay of 0.94 a cycle of 0.1 s, and loganalyzer3's least speed of 1 m a cycle. Human: by FIFA's
#: Quality Pro a ball that rolls down a ramp of 1 m, to 3.4 m/s, goes on for 4 to 8 m: 1 m/s² at 6 m.
ROLLING = {
    Kind.VSSS: Rolling(0.34, 0.0, 0.0),
    Kind.SSL: Rolling(0.25, 0.0, 0.0),
    Kind.SIM2D: Rolling(0.0, (1 - 0.94) / 0.1, 10.0),
    Kind.HUMAN: Rolling(1.0, 0.0, 0.0),
}

#: Football's centre circle, its radius as a share of the pitch's length.
_CIRCLE = 9.15 / 105


def shots(
    control: Control, trajectories: pl.DataFrame, over: pl.DataFrame, pitch: Pitch, settings: EventSettings
) -> pl.DataFrame:
    """Rows of schema Shots of one match.

    Args:
        control: control of the match.
        trajectories: rows of schema Trajectories of the match.
        over: how its segments ended (:func:`pipeline.game.episodes.episodes`).
        pitch: pitch of the match.
        settings: settings of the stage.
    """
    ball, contacts = control.ball, control.contacts
    last, following = _left(control)
    team, robot = contacts.team[control.toucher[last]], contacts.robot[control.toucher[last]]
    lines = [ball.course(int(here), None if to == NOBODY else int(to), settings.line_s)
             for here, to in zip(last, following, strict=True)]
    x, y, dx, dy, took = np.array(lines, dtype=np.float64).reshape(-1, 5).T
    turn = towards(team)
    x, y, dx, dy = x * turn, y * turn, dx * turn, dy * turn
    to_x, speed = pitch.goal_x - x, np.hypot(dx, dy) / took
    off, way = _at_line(to_x, y, dx, dy)
    rolling, scales = ROLLING[pitch.kind], SCALES[pitch.kind]
    on_target = (off < pitch.goal_width / 2) & (rolling.at(speed, way) > rolling.least)
    aimed = off <= settings.wide * pitch.goal_width
    past = (
        (off >= pitch.goal_width / 2) & aimed
        & (speed >= settings.wide_speed * scales.speed) & (to_x <= speed * settings.wide_s)
    )
    names = pl.Series(SIDES).gather(team)
    scored = _scored(last, on_target | aimed, control, over, round(settings.deflected_s * 1e9))
    outcome, by = _outcomes(last, following, on_target, scored, control, trajectories)
    # where both strikers run to the ball, each kick-off would be a shot that is blocked at once
    kicks_off = _kicks_off(last, ball, pitch)
    reach = _reach(ball, last, following, turn, past | kicks_off)
    arrives = reach >= pitch.goal_x - 2 * scales.ball_radius
    found = scored | (past & arrives) | (on_target & (~kicks_off | (reach >= pitch.goal_x / 2)))
    t_ns = pl.Series(ball.t_ns[last])
    before = in_way(trajectories, names, t_ns, x, y, pitch)
    return tabled(Shots, trajectories, {
        "team": names,
        "t_ns": t_ns,
        "segment": ball.segment[last],
        "robot": robot,
        "role": roles(trajectories, names, pl.Series(robot), t_ns),
        "x": x, "y": y,
        "speed": speed,
        "distance": np.hypot(to_x, y),
        "angle": _angle(to_x, y, pitch.goal_width / 2),
        "outcome": outcome,
        "by": by,
        "in_way": before["in_way"],
        "cover": before["cover"],
    }, found)


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


def _kicks_off(last: I64, ball: BallInPlay, pitch: Pitch) -> Bools:
    """Mask of kick-offs, [n]: a segment begins, and its ball first leaves a robot, in the centre circle.

    Places tell it, because not every source tells of kick-offs.
    """
    begins = np.searchsorted(ball.segment, ball.segment[last])
    far: Bools = np.hypot(ball.x, ball.y) > _CIRCLE * pitch.length
    return np.asarray(np.diff(begins, prepend=NOBODY) != 0) & ~far[begins] & ~far[last]


def _at_line(to_x: F64, y: F64, dx: F64, dy: F64) -> tuple[F64, F64]:
    """Where straight lines cross the goal line at +x: from the goal's middle, and how far they go, metres.

    float64 [n] each; NaN where they do not cross it.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where((dx > 0) & (to_x > 0), to_x / dx, np.nan)
    return np.abs(y + dy * share), np.hypot(to_x, dy * share)


def _reach(ball: BallInPlay, last: I64, following: I64, turn: F64, asked: Bools) -> F64:
    """The greatest x of the ball from a touch to before the next one in the segment, metres, [n].

    It is as the toucher's team sees the pitch; -inf where it is not asked for.
    """
    reach = np.full(len(last), -np.inf)
    for index in np.flatnonzero(asked):
        here, to = int(last[index]), int(following[index])
        if to == NOBODY:
            to = int(np.searchsorted(ball.segment, ball.segment[here], side="right"))
        reach[index] = (ball.x[here:to] * turn[index]).max()
    return reach


def _angle(to_x: F64, y: F64, half_goal: float) -> F64:
    """Angle at which a place sees the goal, rad, [n]."""
    left: F64 = np.arctan2(half_goal - y, to_x)
    right: F64 = np.arctan2(-half_goal - y, to_x)
    return left - right


def _scored(last: I64, aimed: Bools, control: Control, over: pl.DataFrame, soon_ns: int) -> Bools:
    """Mask of the touches that goals came of, [n]: at most one a goal, the last that is aimed.

    The direction is enough, whatever the speed: :mod:`pipeline.stages.goals` tells so whose goal it is.
    """
    contacts, ball = control.contacts, control.ball
    ends = {episode: (over_ns, scorer)
            for episode, over_ns, scorer in over.select("episode", "over_ns", "scorer").iter_rows()}
    found = dict[int, int]()  # segment to the last such touch
    for index in np.flatnonzero(aimed):
        here = int(last[index])
        segment, team = int(ball.segment[here]), contacts.team[control.toucher[here]]
        over_ns, scorer = ends[segment]
        if (scorer == SIDES[team] and over_ns - ball.t_ns[here] <= soon_ns
                and not _touches_after(control, here, int(np.searchsorted(ball.t_ns, over_ns)))):
            found[segment] = int(index)
    scored = np.zeros(len(last), dtype=np.bool_)
    scored[list(found.values())] = True
    return scored


def _outcomes(
    last: I64, following: I64, on_target: Bools, scored: Bools, control: Control, trajectories: pl.DataFrame
) -> tuple[pl.Series, pl.Series]:
    """Outcomes of shots, and who stopped them: columns outcome and by of schema Shots, [n] each."""
    contacts, toucher, ball = control.contacts, control.toucher, control.ball
    touched = following != NOBODY
    team, other = contacts.team[toucher[last]], contacts.team[toucher[following]]
    by = pl.Series("by", contacts.robot[toucher[following]])
    role = roles(trajectories, pl.Series(SIDES).gather(other), by, pl.Series(ball.t_ns[following]))
    came = pl.DataFrame({
        "touched": touched, "own": other == team, "keeper": (role == "goalkeeper").fill_null(value=False),
        "scored": scored, "on_target": on_target, "by": by,
    }).with_columns(
        outcome=pl.when("scored").then(pl.lit("goal"))
        .when(~pl.col("on_target")).then(pl.lit("wide"))
        .when(pl.col("touched") & pl.col("own")).then(pl.lit("own"))
        .when(pl.col("touched") & pl.col("keeper")).then(pl.lit("saved"))
        .when("touched").then(pl.lit("blocked"))
        .otherwise(pl.lit("missed")))
    return came["outcome"], came.select(
        pl.when(pl.col("outcome").is_in(["saved", "blocked"])).then("by"))["by"]


def _touches_after(control: Control, here: int, until: int) -> bool:
    """True if the team of the robot that touches at row ``here`` touches after it and before ``until``.

    The robot's own touch may go on: it pushes the ball while an adversary is at it, too.
    """
    contacts, own = control.contacts, control.toucher[here]
    after = (contacts.team == contacts.team[own]) & (contacts.last > here) & (contacts.first < until)
    after[own] = False
    return bool(np.any(after))
