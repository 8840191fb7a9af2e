"""Options as sequences and habits take them: where a team logged what it did, that is what it did."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.schemas.options import OPTIONS

#: Logarithm of how much more probable a logged option is than others.
_KNOWN = 50.0
#: What a team logged, if it is an option; else null.
LOGGED = pl.when(pl.col("logged").is_in(OPTIONS)).then("logged")


def as_done(options: pl.DataFrame) -> pl.DataFrame:
    """The options of robots as :func:`pipeline.stages.sequences.derive.sequences` takes situations.

    What a robot goes on doing is one row.

    Args:
        options: rows of schema Options of one match.

    Returns:
        Columns match_id, team, robot, role, code, start_ns, end_ns and segment, sorted as the options. Those
        of a robot whose role is unknown are left out.
    """
    # neighbours may differ in their targets
    goes_on = pl.all_horizontal(
        pl.col(name) == pl.col(name).shift() for name in ("team", "robot", "option", "segment")
    ) & (pl.col("start_ns") == pl.col("end_ns").shift())
    done = options.drop_nulls("role").with_columns(option=pl.coalesce(LOGGED, "option"))
    return done.with_columns(run=(~goes_on).fill_null(value=True).cum_sum()).group_by(
        "run", maintain_order=True,
    ).agg(
        pl.col("match_id", "team", "robot", "role").first(), pl.col("option").first().alias("code"),
        pl.col("start_ns").first(), pl.col("end_ns").last(), pl.col("segment").first(),
    ).drop("run")


def as_logged(clues: pl.DataFrame, options: pl.DataFrame) -> pl.DataFrame:
    """Clues in which the options that a team logged are beyond doubt.

    Args:
        clues: rows of schema Clues of one match.
        options: rows of schema Options of the same match.
    """
    known = options.select("team", "robot", "start_ns", over_ns="end_ns", code=LOGGED).sort("start_ns")
    found = clues.select("team", "robot", "start_ns").with_row_index("row").sort("start_ns").join_asof(
        known, on="start_ns", by=["team", "robot"], check_sortedness=False,
    ).filter(pl.col("start_ns") < pl.col("over_ns"), pl.col("code").is_not_null())
    ratios = clues["ratios"].to_numpy().copy()
    rows = found["row"].to_numpy()
    ratios[rows] = 0
    ratios[rows, np.searchsorted(OPTIONS, found["code"].to_numpy())] = _KNOWN
    return clues.with_columns(pl.Series("ratios", ratios, dtype=clues.schema["ratios"]))
