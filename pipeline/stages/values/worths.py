"""V at moments of a match, and what its situations change of V."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.game.episodes import episodes
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.settings import ValueSettings
from pitchlore.pipeline.stages.values.models import Models
from pitchlore.schemas import SIDES, Values, Worths


class _Path(NamedTuple):
    """V to home in one segment of play: times, int64 [n], increasing, and values, float64 [n]."""

    t_ns: I64
    value: F64

    def at(self, t_ns: I64) -> F64:
        """V at times [k], between moments on a straight line, beyond them that of the nearest."""
        return np.interp(t_ns, self.t_ns, self.value)


def values(moments: pl.DataFrame, models: Models) -> pl.DataFrame:
    """V at each moment: rows of schema Values from rows of schema Moments of one match."""
    chances = {
        team: models.chances(part) if (part := moments.filter(pl.col("team") == team)).height else np.empty(0)
        for team in SIDES
    }
    return moments.filter(pl.col("team") == "home").select(
        "match_id", "t_ns", "segment", pl.Series("home", chances["home"]), pl.Series("away", chances["away"]),
        pl.Series("value", chances["home"] - chances["away"]),
    ).cast(pl.Schema(Values.dtypes()))


def worths(
    situations: pl.DataFrame, moments: pl.DataFrame, referee: pl.DataFrame, trajectories: pl.DataFrame,
    settings: ValueSettings,
) -> pl.DataFrame:
    """Changes of V by each situation, for its team.

    Where a segment of play ends with a goal, V after each robot's last situation in it is 1 or -1, if the
    robot was there until ``goal_s`` before the segment's end.

    Args:
        situations: rows of schema Situations of one match.
        moments: rows of schema Values of that match; none if V is not known.
        referee: rows of schema Referee of that match.
        trajectories: rows of schema Trajectories of that match.
        settings: settings of the stage.

    Returns:
        Rows of schema Worths, in the order of the situations.
    """
    if situations.is_empty():
        return Worths.empty()
    paths = {
        segment: _Path(part["t_ns"].to_numpy(), part["value"].to_numpy())
        for (segment,), part in moments.group_by("segment", maintain_order=True)
    }
    side = np.where((situations["team"] == "home").to_numpy(), 1.0, -1.0)
    segment = situations["segment"].to_numpy()
    ends = {name: situations[f"{name}_ns"].to_numpy() for name in ("start", "end")}
    found = {name: np.full(len(segment), np.nan) for name in ends}
    for number, path in paths.items():
        rows = segment == number
        for name, times in ends.items():
            found[name][rows] = side[rows] * path.at(times[rows])
    goal = side * _goals(situations, trajectories, referee, round(settings.goal_s * 1e9))
    after = np.where(goal != 0, goal, found["end"])
    change = np.nan_to_num(after - found["start"], nan=0.0)
    places = trajectories.select("team", "robot", "t_ns", "x", "y").with_columns(
        pl.col("team").cast(pl.String).cast(pl.Enum(SIDES), strict=False))
    return situations.select("match_id", "team", "robot", "start_ns").with_columns(
        pl.Series("before", found["start"]).fill_nan(None), pl.Series("after", after).fill_nan(None),
        pl.Series("change", change), pl.Series("side", side),
    ).join(
        places, left_on=("team", "robot", "start_ns"), right_on=("team", "robot", "t_ns"), how="left",
        maintain_order="left",
    ).with_columns(pl.col("x", "y") * pl.col("side")).select(*Worths.dtypes()).cast(
        pl.Schema(Worths.dtypes()))


def _goals(
    situations: pl.DataFrame, trajectories: pl.DataFrame, referee: pl.DataFrame, goal_ns: int
) -> F64:
    """Goals with which situations end: 1 for home, -1 for away, 0 without, float64 [S]."""
    scored = episodes(trajectories, referee).filter(pl.col("outcome") == "goal").select(
        "scorer", segment="episode", last="last_ns")
    looked = situations.select("team", "robot", "segment", "end_ns").join(
        scored, on="segment", how="left", maintain_order="left"
    ).select(
        last_of_robot=pl.col("end_ns") == pl.col("end_ns").max().over("team", "robot", "segment"),
        near=pl.col("last") - pl.col("end_ns") <= goal_ns,
        sign=pl.when(pl.col("scorer") == "home").then(1.0).when(pl.col("scorer") == "away").then(-1.0),
    )
    return looked.select(
        pl.when(pl.col("last_of_robot") & pl.col("near")).then("sign").otherwise(0.0).fill_null(0.0)
    ).to_series().to_numpy()
