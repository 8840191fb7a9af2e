"""The noun sequences: the situations of robots one after the other, valued (paper section 3.2.2)."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.game.episodes import episodes
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.numbers.sums import exact
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.stages.sequences.follows import followed
from pitchlore.pipeline.state import elements, encode
from pitchlore.schemas import SIDES, Sequences


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
    situations: pl.DataFrame,
    goals: pl.DataFrame,
    worths: pl.DataFrame,
    trajectories: pl.DataFrame,
    referee: pl.DataFrame,
    pitch: Pitch,
    settings: GramSettings,
) -> pl.DataFrame:
    """The situations of a match as sequences: with their values, and with all that decisions say of them.

    Args:
        situations: rows of schema Situations of one match, or options, see
            :func:`pipeline.stages.options.runs.as_done`.
        goals: rows of schema Goals of the same match.
        worths: rows of schema Worths of the same match, of these situations.
        trajectories: rows of schema Trajectories of the same match.
        referee: rows of schema Referee of the same match, in order of time.
        pitch: pitch of the match.
        settings: all of them decide.

    Returns:
        Rows of schema Sequences. The reward of an episode's end is +1 or -1 if it is a goal. If no event
        explains the end, the episode is truncated.
    """
    team = situations["team"].cast(pl.Enum(SIDES)).to_physical().to_numpy().astype(np.int64)
    seen, known = elements(trajectories, referee, pitch, team, situations["start_ns"].to_numpy())
    scored = pl.col("outcome") == "goal"
    sign = pl.when(pl.col("scorer") == pl.col("team").cast(pl.String)).then(1.0).otherwise(-1.0)
    terminal = pl.col("outcome").is_not_null()
    return (
        followed(value(situations, goals, settings), settings.gap_s)
        .hstack(worths.select("change", "x", "y"))
        .rename({"segment": "episode"})
        .join(episodes(trajectories, referee), on="episode", how="left", maintain_order="left")
        .with_columns(
            pl.when(settings.outcome != "paper").then("change"),
            state=pl.Series(np.where(known, encode(seen, "full36"), -1)).replace(-1, None),
            reward=pl.when(scored).then(sign).otherwise(0.0),
            ends=pl.when(terminal).then(pl.lit("terminal")).otherwise(pl.lit("truncated")),
        )
        .select(list(Sequences.dtypes()))
        .cast(pl.Schema(Sequences.dtypes()))
    )


def choices(logged: pl.DataFrame, goals: pl.DataFrame, settings: GramSettings) -> pl.DataFrame:
    """The decisions that players logged, as rows of schema Choices.

    Args:
        logged: rows of schema Decisions of a match's log. Their values are computed anew: the match's goals
            were unknown when they were logged.
        goals: rows of schema Goals of the same match.
        settings: alpha and tick_s.
    """
    valued = value(logged, goals, settings, start="t_ns")
    return valued.with_columns(pl.Series("value", exact(valued["value"].to_numpy())))
