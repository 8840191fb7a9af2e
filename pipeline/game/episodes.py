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
        Columns episode (int32), last_ns (int64: the segment's last sample), over_ns (int64: the event's
        time, or ``last_ns`` without an event), outcome (the event or null) and scorer ('home' or 'away' of a
        goal, else null), sorted by episode.
    """
    segments, starts, stops = _spans(trajectories)
    events = referee.filter(pl.col("event").is_in(FINAL)).select("t_ns", "event", "team").rows()
    following = [*starts[1:], np.inf][:len(starts)]
    rows = []
    for episode, start, stop, until in zip(segments, starts, stops, following, strict=True):
        within = [event for event in events if start < event[0] <= until]
        goals = [event for event in within if event[1] == "goal"]
        over_ns, outcome, team = next(iter([*goals, *within]), (stop, None, None))
        if outcome == "goal" and team is None:
            over_ns, outcome = stop, None
        rows.append((episode, stop, over_ns, outcome, team if outcome == "goal" else None))
    return pl.DataFrame(
        rows,
        schema={"episode": pl.Int32, "last_ns": pl.Int64, "over_ns": pl.Int64, "outcome": pl.String,
                "scorer": pl.String},
        orient="row",
    )


def _spans(trajectories: pl.DataFrame) -> tuple[list[int], list[int], list[int]]:
    """The segments of play in order, and the times of the first and last sample of each."""
    rows = trajectories.select("segment", "t_ns").drop_nulls("segment")
    segment, t_ns = rows["segment"].to_numpy(), rows["t_ns"].to_numpy()
    most = np.iinfo(np.int64).max
    start, stop = (np.full(segment.max(initial=-1) + 1, edge) for edge in (most, -most))
    np.minimum.at(start, segment, t_ns)
    np.maximum.at(stop, segment, t_ns)
    found = np.flatnonzero(start <= stop)
    return found.tolist(), start[found].tolist(), stop[found].tolist()
