"""Goals: by direct action, by indirect action, or by error of the adversary (paper, Fig. 10)."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.game.touches import FLICKER, BallInPlay, Touches, touches
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.settings import GoalSettings
from pitchlore.schemas import HOME, SIDES, Goals

GoalKind = Literal["direct", "indirect", "error"]

#: Codes of Table 1: robot with the ball, guides the ball, kicks the ball.
WITH_BALL, GUIDES, KICKS = 1, 11, 21
OWN_ACTION = (WITH_BALL, GUIDES, KICKS)


class _Episodes(NamedTuple):
    """Situations, each [k]; end exclusive."""

    team: I64
    robot: I64
    code: I64
    start_ns: I64
    end_ns: I64

    def meets(self, team: int, robot: int, codes: tuple[int, ...], first_ns: int, last_ns: int) -> bool:
        """True if a situation with one of the codes has a time in common with [first, last]."""
        same = (self.team == team) & (self.robot == robot) & np.isin(self.code, codes)
        return bool(np.any(same & (self.start_ns <= last_ns) & (self.end_ns > first_ns)))


def attribute(
    referee: pl.DataFrame,
    trajectories: pl.DataFrame,
    situations: pl.DataFrame,
    pitch: Pitch,
    settings: GoalSettings,
    origin: str | None = "referee",
    confidence: Mapping[str, float] = MappingProxyType({}),
) -> pl.DataFrame:
    """Robot and kind of each goal.

    A robot touches the ball where the distance of their centres is below the contact distance of the
    kind of match. The touches of the last ``before_s`` of play before the goal count; without any, all
    since play last stopped or restarted.

    1. The scoring team touched last, during a situation 021, 011 or 001 of the robot, nobody else touched
       the ball since that touch began, and it then took a straight line into the goal: direct, by that
       robot.
    2. The scoring team touched last in any other way: indirect, by that robot.
    3. The defending team touched last. It is indirect, by the scoring team's last toucher, if he touched
       the ball during the defender's touch (they pressed it in together), or at most ``before_s`` before
       it and the ball then came towards the goal: its line passes the goal's middle at no more than
       ``beside`` half goals. Otherwise it is an error of the adversary, by the defender.
    4. Without a touch, or without a known scoring team: robot and kind are null.

    A sample counts if it is in play, not suspect, strictly before the goal, and the ball's centre is not
    beyond a goal line: some sources log a goal after the bodies were put back, or long after play stopped.

    Args:
        referee: rows of schema Referee of one match.
        trajectories: rows of schema Trajectories of that match.
        situations: rows of schema Situations of that match; without any, no goal is direct.
        pitch: pitch of the match.
        settings: settings of the stage.
        origin: source of the goals, one of ``schemas.goals.ORIGINS``; None where that is not known.
        confidence: confidence in goals found from the ball, by their time in ns as text, as a log has it.

    Returns:
        Rows of schema Goals by time, one a goal.
    """
    given = referee.filter(pl.col("event") == "goal").sort("t_ns", maintain_order=True)
    in_play = trajectories.filter(pl.col("segment").is_not_null(), ~pl.col("suspect"))
    scales = SCALES[pitch.kind]
    ball, touched = touches(in_play, scales.contact, pitch.goal_x, scales.reach)
    done = _episodes(situations)
    breaks = referee.filter(pl.col("event") != "play")["t_ns"].sort().to_numpy()
    times = np.unique(in_play["t_ns"].to_numpy())

    made: list[tuple[int | None, GoalKind | None]] = []
    for goal in given.iter_rows(named=True):
        if goal["team"] is None:
            made.append((None, None))
            continue
        before = int(np.searchsorted(times, goal["t_ns"]))
        window = _window(touched, times[:before], breaks, settings)
        seen = ball.before(goal["t_ns"])
        made.append(_judge(SIDES.index(goal["team"]), window, seen, done, pitch, settings))
    return given.select(
        "match_id", "t_ns", "team",
        pl.Series("robot", [robot for robot, _ in made], dtype=pl.Int16),
        pl.Series("kind", [kind for _, kind in made], dtype=Goals.dtypes()["kind"]),
        pl.Series("origin", [origin] * len(made), dtype=Goals.dtypes()["origin"]),
        pl.Series("confidence", [confidence.get(str(t_ns)) for t_ns in given["t_ns"]], dtype=pl.Float64),
    )


def _episodes(situations: pl.DataFrame) -> _Episodes:
    """Situations with a code that the rules of :func:`attribute` name."""
    asked = situations.filter(pl.col("code").is_in(OWN_ACTION)).with_columns(
        pl.col("team").to_physical()
    )
    return _Episodes(*(asked[name].cast(pl.Int64).to_numpy() for name in _Episodes._fields))


def _window(touches: Touches, times: I64, breaks: I64, settings: GoalSettings) -> Touches:
    """The touches that count for a goal; times are those in play before it."""
    if not len(times):
        return Touches(*(field[:0] for field in touches))
    last = times[-1]
    end = np.searchsorted(touches.t_ns, last, side="right")
    begin = np.searchsorted(touches.t_ns, last - round(settings.before_s * 1e9))
    since = np.searchsorted(breaks, last, side="right")
    restarted = np.searchsorted(touches.t_ns, breaks[since - 1]) if since else 0
    begin = max(begin, restarted) if max(begin, restarted) < end else restarted
    return Touches(*(field[begin:end] for field in touches))


def _judge(
    scorer: int, touches: Touches, ball: BallInPlay, done: _Episodes, pitch: Pitch, settings: GoalSettings
) -> tuple[int | None, GoalKind | None]:
    """Robot and kind of one goal of the team ``scorer`` (index into SIDES)."""
    if not len(touches.t_ns):
        return None, None
    last = len(touches.t_ns) - 1
    t, robot = int(touches.t_ns[last]), int(touches.robot[last])
    began = _touch_began(last, touches)
    if touches.team[last] == scorer:
        others = (touches.team != scorer) | (touches.robot != robot)
        direct = (
            done.meets(scorer, robot, OWN_ACTION, t, t) and not (others & (touches.t_ns >= began)).any()
            and _goes_in(last, touches, ball, pitch, settings)
        )
        return robot, "direct" if direct else "indirect"
    shots = np.flatnonzero(touches.team == scorer)
    if len(shots):
        shot = int(shots[-1])
        pressed = touches.t_ns[shot] >= began
        soon = began - touches.t_ns[shot] <= round(settings.before_s * 1e9)
        if pressed or (soon and _comes(shot, touches, ball, pitch, settings)):
            return int(touches.robot[shot]), "indirect"
    return robot, "error"


def _touch_began(last: int, touches: Touches) -> int:
    """Time of the first sample of the uninterrupted touch that sample ``last`` belongs to."""
    same = np.flatnonzero((touches.team == touches.team[last]) & (touches.robot == touches.robot[last]))
    same = same[same <= last]
    apart = np.flatnonzero(np.diff(touches.ball[same]) > FLICKER + 1)
    return int(touches.t_ns[same[apart[-1] + 1 if len(apart) else 0]])


def _course(
    i: int, touches: Touches, ball: BallInPlay, settings: GoalSettings
) -> tuple[float, float, float, float]:
    """The ball's straight line after touch ``i``: a place on it (x, y) and a direction (dx, dy).

    It is :meth:`BallInPlay.course` until the next touch by another robot.
    """
    here = int(touches.ball[i])
    others = (touches.team != touches.team[i]) | (touches.robot != touches.robot[i])
    next_touch = touches.ball[others & (touches.ball > here)]
    x, y, dx, dy, _ = ball.course(here, int(next_touch[0]) if len(next_touch) else None, settings.line_s)
    return x, y, dx, dy


def _goes_in(i: int, touches: Touches, ball: BallInPlay, pitch: Pitch, settings: GoalSettings) -> bool:
    """True if the ball's straight line after touch ``i`` goes into the goal that the toucher attacks."""
    x, y, dx, dy = _course(i, touches, ball, settings)
    towards = 1 if touches.team[i] == HOME else -1
    left = towards * pitch.goal_x - x  # along x, until the goal line
    if left * towards > 0:
        if not dx * towards > 0:  # away from the goal, or not known
            return False
        y += dy * left / dx
    return abs(y) <= pitch.goal_width / 2


def _comes(i: int, touches: Touches, ball: BallInPlay, pitch: Pitch, settings: GoalSettings) -> bool:
    """True if the ball's straight line after touch ``i`` passes near the goal that the toucher attacks."""
    x, y, dx, dy = _course(i, touches, ball, settings)
    to_x, to_y = (1 if touches.team[i] == HOME else -1) * pitch.goal_x - x, -y
    length = np.hypot(dx, dy)
    if not (length > 0 and dx * to_x + dy * to_y > 0):  # away from the goal, or not known
        return False
    return bool(abs(dx * to_y - dy * to_x) / length <= settings.beside * pitch.goal_width / 2)
