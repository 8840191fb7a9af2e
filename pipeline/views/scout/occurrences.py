"""Where behaviours occurred, in sequences of situations."""

from __future__ import annotations

import numpy as np
import polars as pl

from pipeline.windows import instances


def occurrences(sequence: pl.DataFrame, behaviours: pl.DataFrame) -> pl.DataFrame:
    """Every instance of behaviours in the sequences of one side of a match.

    Args:
        sequence: rows of schema Sequences of the side.
        behaviours: rows of schema Behaviours of its team.

    Returns:
        Columns behaviour_id, match_id, team, robot, t_ns, done_ns, and change (of V, goals included).
    """
    total = np.append(0.0, np.cumsum(sequence["change"].fill_null(0.0).to_numpy()))
    starts = sequence.select("match_id", pl.col("team").cast(pl.String), "robot", t_ns="start_ns")
    found = [starts.head(0).with_columns(
        pl.lit("").alias("behaviour_id"), done_ns=pl.lit(0, dtype=pl.Int64), change=pl.lit(0.0))]
    for each in instances(sequence, behaviours):
        last = each.first + each.n - 1
        found.append(starts[each.first].with_columns(
            behaviours["behaviour_id"][each.pattern], done_ns=sequence["end_ns"][last],
            change=pl.Series(total[last + 1] - total[each.first])))
    return pl.concat(found)
