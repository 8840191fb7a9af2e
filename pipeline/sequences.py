"""The noun sequences: the situations of robots one after the other, valued (paper section 3.2.2)."""

from __future__ import annotations

import numpy as np
import polars as pl

from pipeline.settings import GramSettings
from pipeline.windows import followed
from schemas import SIDES, Sequences


def value(
    situations: pl.DataFrame, goals: pl.DataFrame, settings: GramSettings, *, start: str = "start_ns"
) -> pl.DataFrame:
    """Add the value of each situation: how soon the next goal of either side follows.

    Args:
        situations: rows of schema Situations of one match, or other rows with a team and a start.
        goals: columns t_ns and team (schema Goals) of the same match, in any order.
        settings: alpha and tick_s.
        start: name of the column with their start, ns.

    Returns:
        The situations with column ``value`` (float64): alpha^t if the next goal after the
        situation's start is for the robot's team, -alpha^t if it is against, 0 if none follows. If
        that goal's team is null, the value is 0, and no later goal counts. t is the time from the
        situation's start to the goal in ticks; it is not rounded, because samples need not come at
        the tick. A situation that starts at the very time of a goal is after it.
    """
    goals = goals.select("t_ns", "team").sort("t_ns")
    goal_ns = goals["t_ns"].to_numpy()
    unknown = len(SIDES)
    scorer = goals["team"].cast(pl.Enum(SIDES)).to_physical().fill_null(unknown).to_numpy()
    start_ns = situations[start].to_numpy()
    team = situations["team"].cast(pl.Enum(SIDES)).to_physical().to_numpy()
    values = np.zeros(len(start_ns), dtype=np.float64)
    following = np.searchsorted(goal_ns, start_ns, side="right")
    before = following < len(goal_ns)
    following = following[before]
    ticks = (goal_ns[following] - start_ns[before]) / (settings.tick_s * 1e9)
    sign = np.where(scorer[following] == team[before], 1.0, -1.0)
    sign[scorer[following] == unknown] = 0.0
    values[before] = sign * settings.alpha**ticks
    return situations.with_columns(pl.Series("value", values))


def sequences(
    situations: pl.DataFrame, goals: pl.DataFrame, worths: pl.DataFrame, settings: GramSettings
) -> pl.DataFrame:
    """The situations of a match as sequences, with what grams of them are valued by.

    Args:
        situations: rows of schema Situations of one match.
        goals: rows of schema Goals of the same match.
        worths: rows of schema Worths of the same match.
        settings: all of them decide.

    Returns:
        Rows of schema Sequences.
    """
    valued = followed(value(situations, goals, settings), settings.gap_s).hstack(
        worths.select("change", "x", "y"))
    if settings.outcome == "paper":
        valued = valued.with_columns(change=pl.lit(None, dtype=pl.Float64))
    return valued.select(list(Sequences.dtypes()))
