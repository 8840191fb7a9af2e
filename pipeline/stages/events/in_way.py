"""Robots that stand between the ball and the adversary's goal."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.numbers.arrays import F64

#: Least distance to the goal line that the angle of the goal is taken from, metres.
_LEAST_M = 1e-3


def in_way(
    trajectories: pl.DataFrame, team: pl.Series, t_ns: pl.Series, x: F64, y: F64, pitch: Pitch
) -> pl.DataFrame:
    """The adversaries in the way of a ball to the goal at +x, of each moment asked for.

    Args:
        trajectories: rows of schema Trajectories of one match; suspect samples are left out.
        team: the team that attacks, [n].
        t_ns: time of a sample, ns, [n].
        x: place of the ball along the pitch, as that team sees it, metres, [n].
        y: the same across the pitch.
        pitch: pitch of the match.

    Returns:
        Columns in_way (Int16) and cover (Float32, m) as of schema Shots, [n]; null if no adversary is seen.
    """
    asked = pl.DataFrame({
        "t_ns": t_ns, "own": team.cast(pl.String), "ball_x": x, "ball_y": y}).with_row_index()
    others = trajectories.filter(pl.col("team") != "ball", ~pl.col("suspect")).select(
        "t_ns", pl.col("team").cast(pl.String), *(pl.col(name).cast(pl.Float64) for name in ("x", "y")))
    turn = pl.when(pl.col("own") == "home").then(1.0).otherwise(-1.0)
    pairs = asked.join(others, on="t_ns").filter(pl.col("team") != pl.col("own")).with_columns(
        to_x=pitch.goal_x - pl.col("ball_x"), to_y=-pl.col("ball_y"),
        ahead=turn * pl.col("x") - pl.col("ball_x"), aside=turn * pl.col("y") - pl.col("ball_y"))
    ahead, aside, to_x, to_y = (pl.col(name) for name in ("ahead", "aside", "to_x", "to_y"))
    # share of the way to the goal's middle at which a robot is nearest to it
    share = ((ahead * to_x + aside * to_y) / (to_x**2 + to_y**2).clip(lower_bound=1e-9)).clip(0, 1)
    cover = ((ahead - share * to_x) ** 2 + (aside - share * to_y) ** 2).sqrt()
    depth = ahead / to_x.clip(lower_bound=_LEAST_M)
    in_angle = (aside - depth * to_y).abs() <= depth * pitch.goal_width / 2
    between = (ahead > 0) & (ahead <= to_x + pitch.goal_depth) & in_angle
    seen = pairs.group_by("index").agg(
        in_way=between.sum().cast(pl.Int16), cover=cover.min().cast(pl.Float32))
    return asked.select("index").join(seen, on="index", how="left", maintain_order="left").drop("index")
