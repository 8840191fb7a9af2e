"""Shots and passes among the touches."""

from __future__ import annotations

from itertools import pairwise, zip_longest
from typing import Literal, NamedTuple

from pipeline.pitch import SCALES, Pitch
from pipeline.views.commentary.settings import CommentarySettings
from pipeline.views.commentary.touches import Touch

#: Outcome of a shot.
Outcome = Literal["goal", "saved", "blocked", "wide", "else"]


class Shot(NamedTuple):
    """A ball sent at the adversary's goal.

    Attributes:
        touch: touch of the shooter.
        left: metres from the ball to the goal line.
        outcome: outcome of the shot.
        by: touch that stopped it, None unless it was saved or blocked.
    """

    touch: Touch
    left: float
    outcome: Outcome
    by: Touch | None

    @property
    def on_target(self) -> bool:
        """Whether the ball went in, or would have."""
        return self.outcome != "wide"


def shots(
    touched: list[Touch], goals: list[tuple[str, int]], pitch: Pitch, settings: CommentarySettings
) -> list[Shot]:
    """Shots of a match, by time.

    A shot leaves a robot fast enough to reach the adversary's goal line within ``shot_s``. Between the
    posts it is on target; beside them it is wide if the ball reaches the goal line. It is a goal if its
    team scores before another robot touches the ball. It is saved if a goalkeeper of the other team
    touches the ball next, blocked if another robot of that team does.

    The touches are those of :func:`pipeline.views.commentary.touches.touches`; the goals are given by team
    and time, ns.
    """
    scales = SCALES[pitch.kind]
    found: list[Shot] = []
    for touch, after in zip_longest(touched, touched[1:]):
        following = after if after is not None and after.segment == touch.segment else None
        if not touch.speed >= settings.shot_speed * scales.speed:
            continue
        left = pitch.goal_x - touch.x
        near = left <= touch.speed * settings.shot_s
        if not near or not abs(touch.aim) <= settings.wide * pitch.goal_width:  # it may be NaN
            continue
        outcome = _outcome(touch, following, [t_ns for team, t_ns in goals if team == touch.team], settings)
        if abs(touch.aim) > pitch.goal_width / 2 and outcome != "goal":
            if touch.reach < pitch.goal_x - 2 * scales.ball_radius:
                continue
            outcome = "wide"
        stopped = outcome in ("saved", "blocked")
        shot = Shot(touch, left, outcome, following if stopped else None)
        if found and _one(found[-1].touch, touch, settings):
            found[-1] = shot
        else:
            found.append(shot)
    return found


def _one(earlier: Touch, later: Touch, settings: CommentarySettings) -> bool:
    """Whether two attempts count as one shot."""
    near = later.end_ns - earlier.end_ns <= round(settings.shot_apart_s * 1e9)
    return near and (earlier.team, earlier.segment) == (later.team, later.segment)


def _outcome(
    touch: Touch, following: Touch | None, goals_ns: list[int], settings: CommentarySettings
) -> Outcome:
    """Outcome of a shot that was not wide; ``following`` is the next touch in its segment."""
    until = touch.end_ns + round(2 * settings.shot_s * 1e9) if following is None else following.start_ns
    if any(touch.end_ns < t_ns <= until for t_ns in goals_ns):
        return "goal"
    if following is None or following.team == touch.team:
        return "else"
    return "saved" if following.role == "goalkeeper" else "blocked"


def passes(touched: list[Touch], pitch: Pitch, settings: CommentarySettings) -> list[tuple[Touch, Touch]]:
    """Passes of a match, by time: the next touch is a teammate's, and the ball went at least ``pass_m``."""
    least = settings.pass_m * SCALES[pitch.kind].close
    longest_ns = round(settings.pass_s * 1e9)
    return [
        (giver, taker) for giver, taker in pairwise(touched)
        if (giver.team, giver.segment) == (taker.team, taker.segment) and giver.robot != taker.robot
        and taker.start_ns - giver.end_ns <= longest_ns
        and (taker.start_x - giver.x) ** 2 + (taker.start_y - giver.y) ** 2 >= least**2
    ]
