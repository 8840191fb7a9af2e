"""Possession: the stretches in which a team has the ball."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.stages.events.control import NOBODY, Control
from pitchlore.pipeline.stages.events.views import place, shoots, tabled
from pitchlore.schemas import SIDES, Possession


def possession(
    control: Control, passes: pl.DataFrame, shots: pl.DataFrame, trajectories: pl.DataFrame,
    over: pl.DataFrame,
) -> pl.DataFrame:
    """Rows of schema Possession of one match.

    Args:
        control: control of the match.
        passes: rows of schema Passes of the match.
        shots: rows of schema Shots of the match.
        trajectories: rows of schema Trajectories of the match.
        over: how its segments ended (:func:`pipeline.game.episodes.episodes`).
    """
    begins = np.append(0, np.flatnonzero(np.diff(control.stretch)) + 1)
    ends = np.append(begins[1:], len(control.team)) - 1  # the last row
    owned = control.team[begins] != NOBODY
    first, last = begins[owned], ends[owned]
    team, ball = control.team[first], control.ball
    following = np.minimum(last + 1, len(control.team) - 1)
    goes_on = (following > last) & (ball.segment[following] == ball.segment[last])
    toucher, robot = control.toucher, control.contacts.robot
    last_touch = np.maximum.accumulate(np.where(toucher == NOBODY, -1, np.arange(len(toucher))))[last]
    start_x, start_y = place(ball, first, team)
    end_x, end_y = place(ball, last, team)
    began = np.sort(control.stretch[control.contacts.first])
    lost = control.team[following] != NOBODY
    ended = np.where(goes_on, np.where(lost, "lost", "contested"), _stopped(ball.segment[last], team, over))
    shot = shoots(ball.t_ns[last_touch], shots)
    ended = np.where(shot & np.isin(ended, ("lost", "contested", "stopped")), "shot", ended)
    return tabled(Possession, trajectories, {
        "team": np.array(SIDES)[team],
        "start_ns": ball.t_ns[first],
        "end_ns": np.where(goes_on, ball.t_ns[following], ball.t_ns[last] + 1),
        "segment": ball.segment[first],
        "robot": robot[toucher[first]],
        "last_robot": robot[toucher[last_touch]],
        "touches": np.maximum(_within(began, control.stretch[first], control.stretch[first]), 1),
        "passes": _within(passes["t_ns"].to_numpy(), ball.t_ns[first], ball.t_ns[last]),
        "x": start_x, "y": start_y, "end_x": end_x, "end_y": end_y,
        "ended": ended,
    })


def _within(times: I64, first: I64, last: I64) -> I64:
    """How many of some times lie in each of the intervals, ends included."""
    return np.searchsorted(times, last, "right") - np.searchsorted(times, first)


def _stopped(segment: I64, team: I64, over: pl.DataFrame) -> npt.NDArray[np.str_]:
    """How the possession of teams ended that lasted as long as their segments, [n]."""
    ends = pl.DataFrame({"episode": segment, "side": team}).with_columns(pl.col("episode").cast(pl.Int32))
    outcome, scorer = pl.col("outcome"), pl.col("scorer")
    goal = pl.when(scorer == pl.Series(SIDES).gather(ends["side"])).then(pl.lit("goal")).otherwise(
        pl.lit("conceded"))
    return ends.join(over, on="episode", how="left", maintain_order="left").select(
        pl.when(outcome == "goal").then(goal).when(outcome.is_null()).then(pl.lit("end"))
        .otherwise(pl.lit("stopped")))["literal"].to_numpy()
