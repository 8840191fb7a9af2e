"""The roles of robots at given times."""

from __future__ import annotations

import polars as pl

from pitchlore.schemas import ROLES


def roles(trajectories: pl.DataFrame, team: pl.Series, robot: pl.Series, t_ns: pl.Series) -> pl.Series:
    """The role of each robot asked for, null where the robot is not seen at that time, [n].

    Args:
        trajectories: rows of schema Trajectories of one match.
        team: 'home' or 'away', [n].
        robot: its number, [n].
        t_ns: time of a sample, ns, [n].
    """
    asked = pl.DataFrame({
        "t_ns": t_ns, "team": team.cast(pl.String), "robot": robot.cast(trajectories.schema["robot"])})
    then = trajectories.join(asked.select("t_ns").unique(), on="t_ns", how="semi")
    seen = then.filter(pl.col("team") != "ball").select(
        "t_ns", pl.col("team").cast(pl.String), "robot", pl.col("role").cast(pl.Enum(ROLES)))
    return asked.join(seen, on=("t_ns", "team", "robot"), how="left", maintain_order="left")["role"]
