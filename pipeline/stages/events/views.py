"""A team's view of the pitch, and rows of events."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.game.touches import BallInPlay
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.schemas import Table


def towards(team: I64) -> F64:
    """+1 for home, which attacks +x in trajectories, -1 for away."""
    return np.where(team == 0, 1.0, -1.0)


def place(ball: BallInPlay, row: I64, team: I64) -> tuple[F64, F64]:
    """The ball's place at some rows, x and y as a team sees it, float64 [n] each, metres."""
    turn = towards(team)
    return ball.x[row] * turn, ball.y[row] * turn


def shoots(t_ns: I64, shots: pl.DataFrame) -> Bools:
    """Mask of touches at some times, [n]: shots (schema Shots) that no other robot of the team receives."""
    return np.isin(t_ns, shots.filter(pl.col("outcome") != "own")["t_ns"].to_numpy())


def tabled(
    schema: type[Table], trajectories: pl.DataFrame, columns: Mapping[str, npt.NDArray[Any] | pl.Series],
    kept: Bools | None = None,
) -> pl.DataFrame:
    """Rows of a schema from its columns, those that are kept; the match is that of the trajectories."""
    match = trajectories["match_id"].head(1)
    frame = pl.DataFrame(dict(columns))
    if kept is not None:
        frame = frame.filter(kept)
    if frame.is_empty():
        return schema.empty()
    return frame.with_columns(match_id=pl.lit(match.item())).select(list(schema.dtypes())).cast(
        pl.Schema(schema.dtypes()))
