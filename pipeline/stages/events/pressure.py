"""Pressure: robots close to the adversary that touches the ball."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.settings import EventSettings
from pitchlore.pipeline.stages.events.control import NOBODY, Control
from pitchlore.schemas import SIDES, Pressure


def pressure(
    control: Control, possession: pl.DataFrame, trajectories: pl.DataFrame, pitch: Pitch,
    settings: EventSettings,
) -> pl.DataFrame:
    """Rows of schema Pressure of one match.

    Args:
        control: control of the match.
        possession: rows of schema Possession of the match.
        trajectories: rows of schema Trajectories of the match.
        pitch: pitch of the match.
        settings: settings of the stage.
    """
    rows = np.flatnonzero((control.toucher != NOBODY) & (control.team != NOBODY))
    ball, contact = control.ball, control.toucher[rows]
    carried = pl.DataFrame({
        "t_ns": ball.t_ns[rows], "segment": ball.segment[rows],
        "carrier": control.contacts.robot[contact].astype(np.int16),
        "by": np.array(SIDES)[control.contacts.team[contact]], "x": ball.x[rows], "y": ball.y[rows],
    })
    robots = trajectories.filter(pl.col("team") != "ball", ~pl.col("suspect")).select(
        "match_id", "t_ns", pl.col("team").cast(pl.String), "robot", rx="x", ry="y")
    carriers = robots.select("t_ns", by="team", carrier="robot", cx="rx", cy="ry")
    near = (
        robots.join(carried, on="t_ns").filter(pl.col("team") != pl.col("by"))
        .join(carriers, on=("t_ns", "by", "carrier"))
        .filter((pl.col("rx") - pl.col("cx")) ** 2 + (pl.col("ry") - pl.col("cy")) ** 2
                < SCALES[pitch.kind].close ** 2)
        .sort("team", "robot", "t_ns", descending=[True, False, False])
    )
    own = ("team", "robot", "segment")
    apart = (pl.col("t_ns").diff() > round(settings.join_s * 1e9)).over(own).fill_null(value=True)
    turn = pl.when(pl.col("team") == SIDES[0]).then(1.0).otherwise(-1.0)
    runs = (
        near.with_columns(run=apart.cum_sum())
        .group_by("match_id", *own, "run", maintain_order=True)
        .agg(start_ns=pl.col("t_ns").first(), end_ns=pl.col("t_ns").last(), carrier=pl.col("carrier").first(),
             x=(pl.col("x") * turn).first(), y=(pl.col("y") * turn).first())
    )
    gains = possession.select("segment", pl.col("team").cast(pl.String), gained="start_ns").sort("gained")
    won = runs.join(gains, on=("segment", "team"), how="left").filter(
        pl.col("gained") > pl.col("start_ns"),
        pl.col("gained") <= pl.col("end_ns") + round(settings.won_s * 1e9),
    ).select("team", "robot", "start_ns").unique().with_columns(won=pl.lit(value=True))
    return (
        runs.join(won, on=("team", "robot", "start_ns"), how="left", maintain_order="left")
        .with_columns(pl.col("won").fill_null(value=False))
        .select(list(Pressure.dtypes())).cast(pl.Schema(Pressure.dtypes()))
    )
