"""Episodes: the segments of play, and what ended each."""

from __future__ import annotations

import numpy as np
import polars as pl

#: Referee events that end an episode; "kick-off" alone does not explain the end.
FINAL = ("goal", "fault", "stop", "half", "end")


def episodes(trajectories: pl.DataFrame, referee: pl.DataFrame) -> pl.DataFrame:
    """The end of each segment of play, and the event that caused it.

    The event lies after the segment's start, up to the start of the next segment. That start is
    included, because some sources log a goal with the restart. A goal has precedence; otherwise the
    first event that stops play counts. A goal without a known team gives no reward, so its segment
    counts as truncated.

    Returns:
        Columns episode (int32), over_ns (int64: the event's time, or the segment's last sample
        without an event), outcome (the event or null) and scorer ('home', 'away' or null), sorted
        by episode.
    """
    segments = (
        trajectories.lazy()
        .filter(pl.col("segment").is_not_null())
        .group_by(episode="segment")
        .agg(start=pl.col("t_ns").min(), stop=pl.col("t_ns").max())
        .sort("episode")
        .collect()
    )
    events = referee.filter(pl.col("event").is_in(FINAL)).select("t_ns", "event", "team").rows()
    starts = segments["start"].to_list()
    rows = []
    for episode, start, stop, until in zip(
        segments["episode"], starts, segments["stop"], [*starts[1:], np.inf], strict=True
    ):
        within = [event for event in events if start < event[0] <= until]
        goals = [event for event in within if event[1] == "goal"]
        over_ns, outcome, scorer = next(iter([*goals, *within]), (stop, None, None))
        if outcome == "goal" and scorer is None:
            over_ns, outcome = stop, None
        rows.append((episode, over_ns, outcome, scorer))
    return pl.DataFrame(
        rows,
        schema={"episode": pl.Int32, "over_ns": pl.Int64, "outcome": pl.String, "scorer": pl.String},
        orient="row",
    )
