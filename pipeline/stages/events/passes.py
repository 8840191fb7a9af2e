"""Passes: the ball goes from a robot to another of its team."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.events.control import Control
from pitchlore.pipeline.stages.events.views import place, shoots, tabled, towards
from pitchlore.schemas import SIDES, Passes
from pitchlore.schemas.events import DIRECTIONS

#: loganalyzer3's passes, metres on a pitch of 105 m: least way; of through passes forward, in the other half.
LEAST, _FORWARD, _DEEP, ON = 2.0, 5.0, 15.0, 105.0


def passes(
    control: Control, shots: pl.DataFrame, trajectories: pl.DataFrame, pitch: Pitch
) -> pl.DataFrame:
    """Rows of schema Passes of one match.

    Args:
        control: control of the match.
        shots: rows of schema Shots of the match.
        trajectories: rows of schema Trajectories of the match.
        pitch: pitch of the match.
    """
    here, there = control.gaps()
    robot = control.contacts.robot[control.toucher]
    ball, share = control.ball, pitch.length / ON
    far = np.hypot(ball.x[there] - ball.x[here], ball.y[there] - ball.y[here]) >= LEAST * share
    found = (there - here > 1) & (robot[here] != robot[there]) & far & ~shoots(ball.t_ns[here], shots)
    here, there = here[found], there[found]
    team = control.team[here]
    x, y = place(ball, here, team)
    to_x, to_y = place(ball, there, team)
    line = _offside(trajectories, ball.t_ns[here], team)
    return tabled(Passes, trajectories, {
        "team": np.array(SIDES)[team],
        "t_ns": ball.t_ns[here],
        "received_ns": ball.t_ns[there],
        "segment": ball.segment[here],
        "robot": robot[here],
        "receiver": robot[there],
        "x": x, "y": y, "to_x": to_x, "to_y": to_y,
        "direction": np.array(DIRECTIONS)[_quarter(to_x - x, to_y - y)],
        "through": (to_x - x > _FORWARD * share) & (to_x > _DEEP * share) & (to_x > line),
    })


def _quarter(dx: F64, dy: F64) -> I64:
    """The quarter of a way, index into DIRECTIONS."""
    angle = np.degrees(np.arctan2(dy, dx))
    return np.select([np.abs(angle) <= 45, np.abs(angle) >= 135, angle > 0], [0, 2, 1], 3)


def _offside(trajectories: pl.DataFrame, t_ns: I64, team: I64) -> F64:
    """The adversary's last robot but the goalkeeper at some times, along the pitch as the team sees it.

    float64 [n], metres; at least 0, the half-way line.
    """
    defenders = trajectories.filter(pl.col("team") != "ball", pl.col("role") != "goalkeeper").select(
        "t_ns", pl.col("x").cast(pl.Float64), side=pl.col("team").cast(pl.String))
    asked = pl.DataFrame({
        "t_ns": t_ns, "side": np.array(SIDES)[1 - team] if len(team) else np.array([], dtype=str),
        "towards": towards(team),
    }).with_row_index("at")
    found = asked.join(defenders, on=("t_ns", "side"), how="left").group_by("at", maintain_order=True).agg(
        (pl.col("x") * pl.col("towards")).max())
    line: F64 = found["x"].fill_null(0.0).to_numpy()
    return np.maximum(line, 0.0)
