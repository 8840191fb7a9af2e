"""Decisions: which behaviour a robot began in which state, and what came of it.

A robot whose team did not log what it chose is read as if it had chosen the behaviours that are found
in its sequence of situations (paper sections 3.2.2 and 4); what lies between two of them belongs to
the first.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from pipeline.pitch import Pitch
from pipeline.sequences import I64, exact, instances
from pipeline.settings import GramSettings
from pipeline.state import elements, encode
from schemas import TEAMS, Decisions

#: Referee events after which an episode has ended for good; "kick-off" alone does not tell why.
_FINAL = ("goal", "fault", "stop", "half", "end")


class Instance(NamedTuple):
    """Behaviours that a robot showed one after the other.

    Attributes:
        first: int64 [I], row of each one's first situation, increasing.
        last: int64 [I], row of its last situation.
        pattern: int64 [I], row of the behaviour in the table of patterns.
    """

    first: I64
    last: I64
    pattern: I64


def observe(
    valued: pl.DataFrame,
    trajectories: pl.DataFrame,
    referee: pl.DataFrame,
    patterns: pl.DataFrame,
    pitch: Pitch,
    grams: GramSettings,
) -> pl.DataFrame:
    """The decisions that all robots of a match show.

    Args:
        valued: rows of schema Situations with column ``value`` (``pipeline.grams.count.value``).
        trajectories: rows of schema Trajectories of the same match.
        referee: rows of schema Referee of the same match, in order of time.
        patterns: rows of schema Patterns or Behaviours, of all rounds.
        pitch: of the match.
        grams: gap_s.

    Returns:
        Rows of schema Decisions, none of them chosen. A robot's behaviours do not overlap: longer
        ones go first, then earlier ones. Decisions in unknown states are left out. An episode is a
        segment; a robot's last decision in it ends when the event does that ended the segment, with
        +1 or -1 for a goal. If the recording does not tell why the segment ended it is truncated,
        and ends with the segment's last sample.
    """
    shown = resolve(valued, patterns, grams.gap_s)
    begun = valued[shown.first]
    team = begun["team"].cast(pl.Enum(TEAMS)).to_physical().to_numpy().astype(np.int64)
    seen, known = elements(trajectories, referee, pitch, team, begun["start_ns"].to_numpy())
    total = np.append(0.0, np.cumsum(exact(valued["value"].to_numpy())))
    value = (total[shown.last + 1] - total[shown.first]) / (shown.last + 1 - shown.first)
    chosen = pl.DataFrame(
        {
            "match_id": begun["match_id"],
            "team": begun["team"],
            "robot": begun["robot"],
            "role": begun["role"],
            "t_ns": begun["start_ns"],
            "state": encode(seen, "full36"),
            "behaviour_id": patterns["behaviour_id"][shown.pattern],
            "episode": begun["segment"],
            "value": exact(value),
            "done_ns": valued["end_ns"][shown.last],
        }
    ).filter(pl.Series(known))
    following = pl.col("t_ns").shift(-1).over("team", "robot", "episode")
    scored = pl.when(pl.col("outcome") == "goal").then(
        pl.when(pl.col("scorer") == pl.col("team").cast(pl.String)).then(1.0).otherwise(-1.0)
    ).otherwise(0.0)
    last = following.is_null()
    return (
        chosen.join(episodes(trajectories, referee), on="episode", how="left", maintain_order="left")
        .with_columns(
            random=pl.lit(value=False),
            chosen=pl.lit(value=False),
            reward=pl.when(last).then(scored).otherwise(0.0),
            ends=pl.when(last).then(
                pl.when(pl.col("outcome").is_null()).then(pl.lit("truncated")).otherwise(pl.lit("terminal"))
            ),
            end_ns=following.fill_null(pl.max_horizontal("over_ns", "done_ns")),
        )
        .select(list(Decisions.dtypes()))
        .cast(pl.Schema(Decisions.dtypes()))
    )


def complete(seen: pl.DataFrame, logged: pl.DataFrame) -> pl.DataFrame:
    """All decisions of a match: of a team that logged what it chose those, of another those seen.

    Args:
        seen: rows of schema Decisions, what :func:`observe` returns.
        logged: rows of schema Decisions of the same match's log, whose column ``value`` was computed
            from its goals (``pipeline.grams.count.value``): while it was played nobody knew the next one.

    Returns:
        Rows of schema Decisions.
    """
    chosen = logged.with_columns(pl.Series("value", exact(logged["value"].to_numpy())))
    others = seen.filter(~pl.col("team").is_in(logged["team"].unique().to_list()))
    return pl.concat([others, chosen]).sort("team", "robot", "t_ns")


def resolve(situations: pl.DataFrame, patterns: pl.DataFrame, gap_s: float) -> Instance:
    """Instances of behaviours of which no two share a situation.

    Lengths come in the order of the rounds, each in what the longer ones did not cover; of
    overlapping instances of one length the earliest goes first.
    """
    first, last, pattern = [np.empty(0, dtype=np.int64) for _ in range(3)]
    for found in instances(situations, patterns, gap_s):
        free, free_from = np.zeros(len(found.first), dtype=np.bool_), 0
        for i, start in enumerate(found.first.tolist()):
            if start >= free_from:
                free[i], free_from = True, start + found.n
        first = np.append(first, found.first[free])
        last = np.append(last, found.first[free] + found.n - 1)
        pattern = np.append(pattern, found.pattern[free])
    order = np.argsort(first)
    return Instance(first[order], last[order], pattern[order])


def episodes(trajectories: pl.DataFrame, referee: pl.DataFrame) -> pl.DataFrame:
    """How each segment of play ended.

    The event that ended a segment is looked for after its start, up to the start of the next
    segment (included: some sources log a goal with the restart). If there is a goal it is the
    goal, else the first event that stops play; a goal whose scorer is unknown tells no reward,
    so that its segment counts as cut.

    Returns:
        Columns episode (int32), over_ns (int64: the event's time; the segment's last sample
        where nothing tells why it ended), outcome (the event or null) and scorer ('home',
        'away' or null), sorted by episode.
    """
    segments = (
        trajectories.lazy()
        .filter(pl.col("segment").is_not_null())
        .group_by(episode="segment")
        .agg(start=pl.col("t_ns").min(), stop=pl.col("t_ns").max())
        .sort("episode")
        .collect()
    )
    events = referee.filter(pl.col("event").is_in(_FINAL)).select("t_ns", "event", "team").rows()
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
