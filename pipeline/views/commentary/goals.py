"""Goals in words: who made them, and what led to them."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.engine.tables import MatchTables
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.game.roles import roles
from pitchlore.pipeline.game.touches import touches
from pitchlore.pipeline.views.commentary.moments import Moment, Weight
from pitchlore.pipeline.views.commentary.settings import CommentarySettings
from pitchlore.pipeline.views.commentary.words import DONE, OTHER, percent, robot, score_words, story
from pitchlore.schemas import SIDES

#: Seconds from which on a team held the ball: what is shorter is a touch.
HELD_S = 0.5


def roles_at_goals(goals: pl.DataFrame, trajectories: pl.DataFrame) -> dict[tuple[int, str, int], str | None]:
    """The last role of each robot in play before each goal, by the goal's time, team and robot.

    A goal is told with these alone, so that a robot whose role changes meanwhile has one name.

    Args:
        goals: rows of schema Goals.
        trajectories: rows of schema Trajectories.
    """
    seen = trajectories.filter(pl.col("team") != "ball").drop_nulls(["role", "segment"]).select(
        "t_ns", pl.col("team", "role").cast(pl.String), "robot").sort("t_ns")
    asked = goals.select("t_ns").unique().join(seen.select("team", "robot").unique(), how="cross")
    found = asked.sort("t_ns").join_asof(
        seen, on="t_ns", by=("team", "robot"), allow_exact_matches=False, check_sortedness=False)
    return {(t_ns, team, number): role for t_ns, team, number, role in found.select(
        "t_ns", "team", "robot", "role").iter_rows()}


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


class _Done(NamedTuple):
    """A situation in which a robot of a team does something with the ball."""

    start_ns: int
    end_ns: int
    robot: int
    code: int


class _Names(NamedTuple):
    """Names of robots in the sentence of a goal.

    Attributes:
        t_ns: time of the goal.
        sides: name of each side.
        roles: by time of a goal, team and robot.
    """

    t_ns: int
    sides: Mapping[str, str]
    roles: Mapping[tuple[int, str, int], str | None]

    def of(self, team: str, number: int) -> str:
        """A robot's name."""
        return robot(self.sides[team], number, self.roles.get((self.t_ns, team, number)))


def of_goals(
    match: MatchTables, touched: pl.DataFrame, names: Mapping[str, str], settings: CommentarySettings
) -> Iterator[Moment]:
    """Goals: team, maker, kind, and the situations that led to them.

    A goal that a robot of the conceding team made is its own goal if it held the ball, else a ball that goes
    in off it. The touches are :func:`at_ball`; ``names`` are what the sides are called.
    """
    goals, referee, roles_then = match.goals, match.referee, roles_at_goals(match.goals, match.trajectories)
    held = match.possession.sort("start_ns").with_columns(pl.col("team").cast(pl.String)).to_dicts()
    given = referee.filter(pl.col("event") == "goal").sort("t_ns", maintain_order=True)
    scores = [score_words(row) for row in given.iter_rows(named=True)]
    made = goals.sort("t_ns", maintain_order=True).iter_rows(named=True)
    by_time = touched.select(_Touch._fields).sort("t_ns", maintain_order=True)
    touches = [_Touch(*row) for row in by_time.iter_rows()]
    times, done = [touch.t_ns for touch in touches], _done(match.situations)
    usual = usual_confidence(goals)
    for goal, now in zip(made, scores, strict=True):
        t_ns, team = goal["t_ns"], goal["team"]
        seen = touches[:bisect_left(times, t_ns)]
        head = f"GOAL{f' for {names[team]}' if team else ''}{f', {now}' if now else ''}!"
        named = _Names(t_ns, names, roles_then)
        if own := _held_until(goal, held):
            said = _own_goal(goal, own, done, named, settings)
        else:
            credit, scorer = _credit(goal, named)
            way = _way(goal, seen, done, scorer, named, settings)
            way = way if credit else way.replace("the ball goes", "The ball goes", 1)
            said = ": ".join(part for part in (credit, way) if part)
        said += _less_sure(goal["confidence"], usual)
        maker = None if goal["kind"] == "error" else goal["robot"]  # who errs is the other team's
        actor = OTHER[team] if own else team
        yield Moment(t_ns, "goal", team, maker, f"{head} {said}".strip(), Weight.ALWAYS, actor)


def _done(situations: pl.DataFrame) -> dict[tuple[int, str], list[_Done]]:
    """Spells of the robots with the ball, by segment and team, from its start on."""
    of = ("segment", "team")
    rows = situations.filter(pl.col("code").is_in(list(DONE))).select(*of, *_Done._fields)
    found = rows.sort("start_ns", "robot", "code").rows_by_key(of)
    return {key: [_Done(*row) for row in group] for key, group in found.items()}


def _held_until(goal: dict[str, Any], held: Sequence[dict[str, Any]]) -> dict[str, Any] | None:
    """The conceding team's possession that ended in a goal, if its maker held the ball; None else."""
    if goal["team"] is None or goal["kind"] != "error":
        return None
    last = next((row for row in reversed(held) if row["start_ns"] < goal["t_ns"]), None)
    if last is None or (last["team"], last["last_robot"]) != (OTHER[goal["team"]], goal["robot"]):
        return None
    return last if min(last["end_ns"], goal["t_ns"]) - last["start_ns"] >= HELD_S * 1e9 else None


def _own_goal(
    goal: dict[str, Any], own: dict[str, Any], done: Mapping[tuple[int, str], Sequence[_Done]], named: _Names,
    settings: CommentarySettings,
) -> str:
    """An own goal, and what its maker did with the ball that its team held."""
    name = named.of(own["team"], goal["robot"])
    lead = _without_repeats((name, it.code) for it in done.get((own["segment"], own["team"]), [])
                            if it.robot == goal["robot"] and it.end_ns > own["start_ns"]
                            and it.start_ns < goal["t_ns"])
    way = story(lead[-settings.lead_steps:], name)
    return f"Own goal of {name}: {way}; it is in." if way else f"Own goal of {name}."


def _without_repeats(steps: Iterable[tuple[str, int]]) -> list[tuple[str, int]]:
    return [step for before, step in pairwise([None, *steps]) if step is not None and step != before]


def _credit(goal: dict[str, Any], named: _Names) -> tuple[str, str]:
    """Maker and kind of a goal in words, and the maker's name; empty unless it plays for the scoring team."""
    team, number, kind = goal["team"], goal["robot"], goal["kind"]
    if team is None or number is None or kind is None or kind == "error":
        return "", ""
    name = named.of(team, number)
    return f"{name}, {kind} action", name


def _way(
    goal: dict[str, Any], seen: Sequence[_Touch], done: Mapping[tuple[int, str], Sequence[_Done]],
    scorer: str, named: _Names, settings: CommentarySettings,
) -> str:
    """The scoring team's actions with the ball before a goal, and the robot that touched it last."""
    if goal["team"] is None or not seen:
        return ""
    last, since_ns = seen[-1], goal["t_ns"] - round(settings.lead_s * 1e9)
    before_it = [it for it in done.get((last.segment, goal["team"]), [])
                 if it.end_ns > since_ns and it.start_ns < goal["t_ns"]]
    lead = _without_repeats((named.of(goal["team"], it.robot), it.code) for it in before_it)
    reported = story(lead[-settings.lead_steps:], scorer)
    toucher = named.of(last.team, last.robot)
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
    return f" (Only {percent(confidence)} sure.)" if known else ""
