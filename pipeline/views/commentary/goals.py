"""Goals in words: who made them, and what led to them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import polars as pl

from pipeline.pitch import SCALES, Pitch
from pipeline.roles import roles
from pipeline.touches import touches
from pipeline.views.commentary.moments import Moment, Weight
from pipeline.views.commentary.settings import CommentarySettings
from pipeline.views.commentary.words import DONE, OTHER, robot, score, story
from schemas import SIDES


def at_ball(trajectories: pl.DataFrame, pitch: Pitch) -> pl.DataFrame:
    """Touches of the ball, sample by sample (:func:`pipeline.touches.touches`).

    Returns:
        Columns t_ns, segment, team, robot and role.
    """
    in_play = trajectories.filter(pl.col("segment").is_not_null(), ~pl.col("suspect"))
    ball, found = touches(in_play, SCALES[pitch.kind].contact, pitch.goal_x)
    rows = pl.DataFrame({
        "t_ns": found.t_ns, "segment": ball.segment[found.ball],
        "team": np.array(SIDES)[found.team], "robot": found.robot,
    })
    return rows.with_columns(role=roles(trajectories, *rows.select("team", "robot", "t_ns")))


def of_goals(
    goals: pl.DataFrame, referee: pl.DataFrame, situations: pl.DataFrame, touched: pl.DataFrame,
    names: Mapping[str, str], settings: CommentarySettings,
) -> Iterator[Moment]:
    """Goals: team, maker, kind, and the situations that led to them.

    The touches are :func:`at_ball`; ``names`` are what the sides are called.
    """
    given = referee.filter(pl.col("event") == "goal").sort("t_ns", maintain_order=True)
    scores = [score(row) for row in given.iter_rows(named=True)]
    made = goals.sort("t_ns", maintain_order=True).iter_rows(named=True)
    for goal, now in zip(made, scores, strict=True):
        t_ns, team = goal["t_ns"], goal["team"]
        seen = touched.filter(pl.col("t_ns") < t_ns)
        head = f"GOAL{f' for {names[team]}' if team else ''}{f', {now}' if now else ''}!"
        credit, scorer = _credit(goal, seen, names)
        way = _way(goal, seen, situations, scorer, names, settings)
        said = ": ".join(part for part in (credit, way) if part)
        maker = None if goal["kind"] == "error" else goal["robot"]  # who errs is the other team's
        actor = OTHER[team] if team and goal["kind"] == "error" else team
        yield Moment(t_ns, "goal", team, maker, f"{head} {said}".strip(), Weight.ALWAYS, actor)


def _credit(goal: dict[str, Any], seen: pl.DataFrame, names: Mapping[str, str]) -> tuple[str, str]:
    """Maker and kind of a goal in words, and the maker's name if it plays for the scoring team."""
    team, number, kind = goal["team"], goal["robot"], goal["kind"]
    if team is None or number is None or kind is None:
        return "", ""
    side = OTHER[team] if kind == "error" else team
    own = seen.filter(pl.col("team") == side, pl.col("robot") == number)["role"]
    name = robot(names[side], number, None if own.is_empty() else own[-1])
    return (f"Error of {name}", "") if kind == "error" else (f"{name}, {kind} action", name)


def _way(
    goal: dict[str, Any], seen: pl.DataFrame, situations: pl.DataFrame, scorer: str,
    names: Mapping[str, str], settings: CommentarySettings,
) -> str:
    """The scoring team's actions with the ball before a goal, and the robot that touched it last."""
    if goal["team"] is None or seen.is_empty():
        return ""
    last = seen.row(-1, named=True)
    done = situations.filter(
        pl.col("team") == goal["team"], pl.col("code").is_in(list(DONE)),
        pl.col("segment") == last["segment"],
        pl.col("end_ns") > goal["t_ns"] - round(settings.lead_s * 1e9), pl.col("start_ns") < goal["t_ns"],
    ).sort("start_ns", "robot").select("team", "robot", "role", "code")
    steps = [(robot(names[team], *rest), code) for team, *rest, code in done.iter_rows()]
    lead = [step for before, step in pairwise([None, *steps]) if step is not None and step != before]
    told = story(lead[-settings.lead_steps:], scorer)
    toucher = robot(names[last["team"]], last["robot"], last["role"])
    if last["team"] != goal["team"]:
        return f"{told}; it goes in off {toucher}." if told else f"the ball goes in off {toucher}."
    return f"{told}; it is in." if told else f"{toucher} touches the ball last."
