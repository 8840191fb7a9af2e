"""Situations of one robot that follow each other without a break."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.numbers.arrays import Bools


def followed(situations: pl.DataFrame, gap_s: float) -> pl.DataFrame:
    """Add the column ``follows``: whether a situation follows the one of the row before without a break.

    Then both have the same robot and segment, and lie less than ``gap_s`` seconds apart.

    Args:
        situations: rows of schema Situations of one match, in the schema's order.
        gap_s: two situations at least so far apart are not consecutive, seconds.

    Raises:
        SchemaMismatch: if situations of one robot overlap or are not in order of time.
    """
    same = np.ones(max(situations.height - 1, 0), dtype=np.bool_)
    for name in ("team", "robot"):
        column = situations[name].to_physical().to_numpy()
        same &= column[1:] == column[:-1]
    gap = situations["start_ns"].to_numpy()[1:] - situations["end_ns"].to_numpy()[:-1]
    if (same & (gap < 0)).any():
        raise SchemaMismatch(
            "situations of one robot overlap or are out of order",
            where=f"situations, row {int(np.flatnonzero(same & (gap < 0))[0]) + 1}",
            next_step="Recognise them again",
        )
    segment = situations["segment"].to_numpy()
    linked: Bools = same & (segment[1:] == segment[:-1]) & (gap < gap_s * 1e9)
    follows = np.concatenate((np.zeros(min(situations.height, 1), dtype=np.bool_), linked))
    return situations.with_columns(pl.Series("follows", follows, dtype=pl.Boolean))
