"""The ball's height beside its trajectory."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.matches.frame import Heights


def with_heights(trajectories: pl.DataFrame, heights: Heights) -> pl.DataFrame:
    """Trajectories with a column z, the ball's height in metres; null where not known, and for robots.

    Args:
        trajectories: rows of schema Trajectories of one match. Without any height they stay as they are.
        heights: heights of the match's log. If a time has two, the first counts.
    """
    if not len(heights.t_ns):
        return trajectories
    known = pl.DataFrame({"t_ns": heights.t_ns, "z": heights.z}).unique("t_ns", keep="first").with_columns(
        team=pl.lit("ball", dtype=trajectories.schema["team"]))
    return trajectories.join(known, on=["t_ns", "team"], how="left", maintain_order="left")
