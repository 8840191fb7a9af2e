"""Where behaviours occurred, in sequences of situations."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.stages.sequences.windows import instances
from pitchlore.schemas import SIDES


def occurrences(sequence: pl.DataFrame, behaviours: pl.DataFrame) -> pl.DataFrame:
    """Every instance of behaviours in the sequences of one side of a match.

    Args:
        sequence: rows of schema Sequences of the side.
        behaviours: rows of schema Behaviours of its team.

    Returns:
        Columns behaviour_id, match_id, team, robot, episode, t_ns, done_ns, and change (of V, goals
        included).
    """
    total = np.append(0.0, np.cumsum(sequence["change"].fill_null(0.0).to_numpy()))
    starts = sequence.select("match_id", pl.col("team").cast(pl.String), "robot", "episode", t_ns="start_ns")
    found = [starts.head(0).with_columns(
        pl.lit("").alias("behaviour_id"), done_ns=pl.lit(0, dtype=pl.Int64), change=pl.lit(0.0))]
    for each in instances(sequence, behaviours):
        last = each.first + each.n - 1
        found.append(starts[each.first].with_columns(
            behaviours["behaviour_id"][each.pattern], done_ns=sequence["end_ns"][last],
            change=pl.Series(total[last + 1] - total[each.first])))
    return pl.concat(found)


def occurrence_places(found: pl.DataFrame, trajectories: pl.DataFrame) -> pl.DataFrame:
    """Where occurrences began and ended.

    Args:
        found: from :func:`occurrences`, of one match.
        trajectories: rows of schema Trajectories of the match.

    Returns:
        The occurrences with columns x and y (m; the robot's place at its last sample at or before t_ns) and
        to_x and to_y (the same before done_ns), each robot's team attacks +x; null where there is no such
        sample, or no place in it.
    """
    turn = pl.when(pl.col("team") == SIDES[0]).then(1).otherwise(-1)
    at = trajectories.filter(pl.col("team") != "ball").select(
        pl.col("team").cast(pl.String), "robot", "t_ns",
        *((turn * pl.col(name).cast(pl.Float64).fill_nan(None)).alias(name) for name in ("x", "y")),
    ).sort("t_ns")
    ends = at.rename({"t_ns": "sample_ns", "x": "to_x", "y": "to_y"})
    return (
        found.sort("t_ns")
        .join_asof(at, on="t_ns", by=("team", "robot"), strategy="backward", check_sortedness=False)
        .with_columns(last_ns=pl.col("done_ns") - 1).sort("last_ns")
        .join_asof(ends, left_on="last_ns", right_on="sample_ns", by=("team", "robot"), strategy="backward",
                   check_sortedness=False)
        .drop("last_ns", "sample_ns"))
