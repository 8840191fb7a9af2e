"""Goals in words: who made them, and what led to them."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.game.roles import roles
from pitchlore.pipeline.game.touches import touches
from pitchlore.pipeline.views.commentary.moments import Moment, Weight
from pitchlore.pipeline.views.commentary.settings import CommentarySettings
from pitchlore.pipeline.views.commentary.words import DONE, OTHER, robot, score_words, story
from pitchlore.schemas import SIDES


def at_ball(trajectories: pl.DataFrame, pitch: Pitch) -> pl.DataFrame:
    """Touches of the ball, sample by sample (:func:`pipeline.game.touches.touches`).

    Returns:
        Columns t_ns, segment, team, robot and role.
    """
    in_play = trajectories.filter(pl.col("segment").is_not_null(), ~pl.col("suspect"))
    scales = SCALES[pitch.kind]
    ball, found = touches(in_play, scales.contact, pitch.goal_x, scales.reach)
    rows = pl.DataFrame({
        "t_ns": found.t_ns, "segment": ball.segment[found.ball],
        "team": np.array(SIDES)[found.team], "robot": found.robot,
    })
    return rows.with_columns(role=roles(trajectories, *rows.select("team", "robot", "t_ns")))


class _Touch(NamedTuple):
    """A row of :func:`at_ball`."""

    t_ns: int
    segment: int
    team: str
    robot: int
    role: str | None


class _Done(NamedTuple):
    """A situation in which a robot of a team does something with the ball."""

    start_ns: int
    end_ns: int
    robot: int
    role: str | None
    code: int


def of_goals(
    goals: pl.DataFrame, referee: pl.DataFrame, situations: pl.DataFrame, touched: pl.DataFrame,
    names: Mapping[str, str], settings: CommentarySettings,
) -> Iterator[Moment]:
    """Goals: team, maker, kind, and the situations that led to them.

    The touches are :func:`at_ball`; ``names`` are what the sides are called.
    """
    given = referee.filter(pl.col("event") == "goal").sort("t_ns", maintain_order=True)
    scores = [score_words(row) for row in given.iter_rows(named=True)]
    made = goals.sort("t_ns", maintain_order=True).iter_rows(named=True)
    by_time = touched.select(_Touch._fields).sort("t_ns", maintain_order=True)
    touches = [_Touch(*row) for row in by_time.iter_rows()]
    times, done = [touch.t_ns for touch in touches], _done(situations)
    usual = usual_confidence(goals)
    for goal, now in zip(made, scores, strict=True):
        t_ns, team = goal["t_ns"], goal["team"]
        seen = touches[:bisect_left(times, t_ns)]
        head = f"GOAL{f' for {names[team]}' if team else ''}{f', {now}' if now else ''}!"
        credit, scorer = _credit(goal, seen, names)
        way = _way(goal, seen, done, scorer, names, settings)
        said = ": ".join(part for part in (credit, way) if part)
        said += _less_sure(goal["confidence"], usual)
        maker = None if goal["kind"] == "error" else goal["robot"]  # who errs is the other team's
        actor = OTHER[team] if team and goal["kind"] == "error" else team
        yield Moment(t_ns, "goal", team, maker, f"{head} {said}".strip(), Weight.ALWAYS, actor)


def _done(situations: pl.DataFrame) -> dict[tuple[int, str], list[_Done]]:
    """Spells of the robots with the ball, by segment and team, from its start on."""
    of = ("segment", "team")
    rows = situations.filter(pl.col("code").is_in(list(DONE))).select(*of, *_Done._fields)
    found = rows.sort("start_ns", "robot", "code").rows_by_key(of)
    return {key: [_Done(*row) for row in group] for key, group in found.items()}


def _credit(goal: dict[str, Any], seen: Sequence[_Touch], names: Mapping[str, str]) -> tuple[str, str]:
    """Maker and kind of a goal in words, and the maker's name if it plays for the scoring team."""
    team, number, kind = goal["team"], goal["robot"], goal["kind"]
    if team is None or number is None or kind is None:
        return "", ""
    side = OTHER[team] if kind == "error" else team
    role = next((touch.role for touch in reversed(seen) if (touch.team, touch.robot) == (side, number)), None)
    name = robot(names[side], number, role)
    return (f"Error of {name}", "") if kind == "error" else (f"{name}, {kind} action", name)


def _way(
    goal: dict[str, Any], seen: Sequence[_Touch], done: Mapping[tuple[int, str], Sequence[_Done]],
    scorer: str, names: Mapping[str, str], settings: CommentarySettings,
) -> str:
    """The scoring team's actions with the ball before a goal, and the robot that touched it last."""
    if goal["team"] is None or not seen:
        return ""
    last, since_ns = seen[-1], goal["t_ns"] - round(settings.lead_s * 1e9)
    before_it = [it for it in done.get((last.segment, goal["team"]), [])
                 if it.end_ns > since_ns and it.start_ns < goal["t_ns"]]
    # a robot whose role changes meanwhile keeps one name: two would read as two robots
    called = {it.robot: robot(names[goal["team"]], it.robot, it.role) for it in before_it}
    if scorer:
        called[goal["robot"]] = scorer
    steps = [(called[it.robot], it.code) for it in before_it]
    lead = [step for before, step in pairwise([None, *steps]) if step is not None and step != before]
    reported = story(lead[-settings.lead_steps:], scorer)
    toucher = robot(names[last.team], last.robot, last.role)
    if last.team == goal["team"]:
        toucher = called.get(last.robot, toucher)
    if last.team != goal["team"]:
        return f"{reported}; it goes in off {toucher}." if reported else f"the ball goes in off {toucher}."
    return f"{reported}; it is in." if reported else f"{toucher} touches the ball last."


def usual_confidence(goals: pl.DataFrame) -> float | None:
    """How sure half of the goals that were found from the ball are, to the percent; None without one."""
    middle = goals["confidence"].median()
    return round(middle, 2) if isinstance(middle, float) else None


def _less_sure(confidence: float | None, usual: float | None) -> str:
    """How sure a goal is, where that is less than is usual in the match, which is said once."""
    known = confidence is not None and usual is not None and round(confidence, 2) < usual
    return f" (Only {confidence:.0%} sure.)" if known else ""
