"""Options as sequences are made of them."""

from __future__ import annotations

import polars as pl


def as_done(options: pl.DataFrame) -> pl.DataFrame:
    """The options of robots as :func:`pipeline.stages.sequences.derive.sequences` takes situations.

    What a robot goes on doing is one row.

    Args:
        options: rows of schema Options of one match.

    Returns:
        Columns match_id, team, robot, role, code, start_ns, end_ns and segment, sorted as the options. Those
        of a robot whose role is unknown are left out.
    """
    # neighbours differ in their targets, or in what was logged
    goes_on = pl.all_horizontal(
        pl.col(name) == pl.col(name).shift() for name in ("team", "robot", "option", "segment")
    ) & (pl.col("start_ns") == pl.col("end_ns").shift())
    return options.drop_nulls("role").with_columns(run=(~goes_on).fill_null(value=True).cum_sum()).group_by(
        "run", maintain_order=True,
    ).agg(
        pl.col("match_id", "team", "robot", "role").first(), pl.col("option").first().alias("code"),
        pl.col("start_ns").first(), pl.col("end_ns").last(), pl.col("segment").first(),
    ).drop("run")
