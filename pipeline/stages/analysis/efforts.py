"""Running: distance covered, and sprints."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import AnalysisSettings
from pitchlore.pipeline.stages.analysis.paces import crossings_ns, paces
from pitchlore.schemas import Efforts


def efforts(
    trajectories: pl.DataFrame, spaces: pl.DataFrame, pitch: Pitch, settings: AnalysisSettings
) -> pl.DataFrame:
    """Rows of schema Efforts of one match.

    Args:
        trajectories: rows of schema Trajectories of the match, sorted as it says.
        spaces: columns team, robot and space: the mean share of the pitch that a robot reaches first.
        pitch: pitch of the match.
        settings: settings of the stage.
    """
    fast, sprint = paces(pitch.kind)
    own = ("team", "robot", "segment")
    lasts = (pl.col("t_ns").shift(-1) - pl.col("t_ns")).over(own) / 1e9
    moving = (
        trajectories.filter(pl.col("team") != "ball", pl.col("segment").is_not_null(), ~pl.col("suspect"))
        .with_columns(pl.col("team").cast(pl.String), pl.col("role").cast(pl.String),
                      speed=(pl.col("vx").cast(pl.Float64) ** 2 + pl.col("vy").cast(pl.Float64) ** 2).sqrt(),
                      lasts=lasts)
        .with_columns(lasts=pl.when(pl.col("lasts") <= settings.hole_s).then("lasts"))
        .with_columns(way=pl.col("speed") * pl.col("lasts"), quick=pl.col("speed") >= sprint)
        .with_columns(stretch=(pl.col("quick") != pl.col("quick").shift())
                      .fill_null(value=True).over(own).cum_sum())
    )
    stretches = moving.filter("quick").group_by("team", "robot", "stretch", maintain_order=True).agg(
        pl.col("lasts", "way").sum()).filter(pl.col("lasts") * 1e9 >= crossings_ns(pitch, settings.sprint))
    sprints = stretches.group_by("team", "robot").agg(sprints=pl.len(), sprinted=pl.col("way").sum())
    roles = moving.drop_nulls("role").group_by("team", "robot", "role").len().sort(
        "len", "role", descending=[True, False]).group_by("team", "robot", maintain_order=True).first()
    return (
        moving.group_by("match_id", "team", "robot")
        .agg(seconds=pl.col("lasts").sum(), distance=pl.col("way").sum(),
             fast=pl.col("way").filter(pl.col("speed") >= fast).sum(),
             top_speed=pl.col("speed").quantile(0.99, "nearest"))
        .join(sprints, on=("team", "robot"), how="left").join(roles, on=("team", "robot"), how="left")
        .join(spaces, on=("team", "robot"), how="left")
        .with_columns(pl.col("sprints", "sprinted", "top_speed").fill_null(0))
        .select(list(Efforts.dtypes())).cast(pl.Schema(Efforts.dtypes())).sort("team", "robot")
    )
