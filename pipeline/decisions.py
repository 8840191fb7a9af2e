"""Decisions: the behaviour that a robot began in a state, with its reward and value.

If a team logged its choices, those are its decisions. Otherwise the behaviours found in a robot's
sequence of situations count as its choices (paper sections 3.2.2 and 4). The time between two of them
belongs to the first.
"""

from __future__ import annotations

import numpy as np
import polars as pl

from pipeline.arrays import I64
from pipeline.episodes import episodes
from pipeline.pitch import Pitch
from pipeline.settings import GramSettings
from pipeline.state import elements, encode
from pipeline.sums import exact
from pipeline.windows import followed, instances, side_of
from schemas import SIDES, Decisions


def observe(
    valued: pl.DataFrame,
    trajectories: pl.DataFrame,
    referee: pl.DataFrame,
    patterns: pl.DataFrame,
    pitch: Pitch,
    grams: GramSettings,
) -> pl.DataFrame:
    """Decisions of all robots of a match, read from their situations.

    Args:
        valued: rows of schema Situations with column ``value`` (``pipeline.sequences.value``).
        trajectories: rows of schema Trajectories of the same match.
        referee: rows of schema Referee of the same match, in order of time.
        patterns: rows of schema Patterns or Behaviours, of all rounds; with a column side, each is of that
            side.
        pitch: pitch of the match.
        grams: gap_s.

    Returns:
        Rows of schema Decisions, none of them chosen. A robot's behaviours do not overlap: longer
        ones have precedence, then earlier ones. Decisions in unknown states are left out. An episode is
        a segment. A robot's last decision in it ends at the event that ended the segment, with reward +1
        or -1 for a goal. If no event explains the segment's end, the decision is truncated and ends with
        the segment's last sample.
    """
    sequence = followed(valued, grams.gap_s)
    if "side" in patterns.columns:
        sequence = sequence.with_columns(who=side_of(valued["team"]))
        patterns = patterns.with_columns(who=side_of(patterns["side"]))
    first, last, pattern = resolve(sequence, patterns)
    begun = valued[first]
    team = begun["team"].cast(pl.Enum(SIDES)).to_physical().to_numpy().astype(np.int64)
    seen, known = elements(trajectories, referee, pitch, team, begun["start_ns"].to_numpy())
    total = np.append(0.0, np.cumsum(exact(valued["value"].to_numpy())))
    value = (total[last + 1] - total[first]) / (last + 1 - first)
    chosen = pl.DataFrame(
        {
            "match_id": begun["match_id"],
            "team": begun["team"],
            "robot": begun["robot"],
            "role": begun["role"],
            "t_ns": begun["start_ns"],
            "state": encode(seen, "full36"),
            "behaviour_id": patterns["behaviour_id"][pattern],
            "episode": begun["segment"],
            "value": exact(value),
            "done_ns": valued["end_ns"][last],
        }
    ).filter(pl.Series(known))
    following = pl.col("t_ns").shift(-1).over("team", "robot", "episode")
    scored = pl.when(pl.col("outcome") == "goal").then(
        pl.when(pl.col("scorer") == pl.col("team").cast(pl.String)).then(1.0).otherwise(-1.0)
    ).otherwise(0.0)
    final = following.is_null()
    return (
        chosen.join(episodes(trajectories, referee), on="episode", how="left", maintain_order="left")
        .with_columns(
            random=pl.lit(value=False),
            chosen=pl.lit(value=False),
            reward=pl.when(final).then(scored).otherwise(0.0),
            ends=pl.when(final).then(
                pl.when(pl.col("outcome").is_null()).then(pl.lit("truncated")).otherwise(pl.lit("terminal"))
            ),
            end_ns=following.fill_null(pl.max_horizontal("over_ns", "done_ns")),
        )
        .select(list(Decisions.dtypes()))
        .cast(pl.Schema(Decisions.dtypes()))
    )


def complete(seen: pl.DataFrame, logged: pl.DataFrame) -> pl.DataFrame:
    """The decisions of a match: logged ones for a team that has any, observed ones for the other.

    Args:
        seen: rows of schema Decisions from :func:`observe`.
        logged: rows of schema Decisions of the same match's log. Their column ``value`` was computed
            from the match's goals (``pipeline.sequences.value``), unknown when they were logged.

    Returns:
        Rows of schema Decisions.
    """
    chosen = logged.with_columns(pl.Series("value", exact(logged["value"].to_numpy())))
    others = seen.filter(~pl.col("team").is_in(logged["team"].unique().to_list()))
    return pl.concat([others, chosen]).sort("team", "robot", "t_ns")


def resolve(sequence: pl.DataFrame, patterns: pl.DataFrame) -> tuple[I64, I64, I64]:
    """Instances of behaviours, none sharing a situation with another.

    Longer patterns are matched first, shorter ones in the situations that these leave. Of overlapping
    instances of one length the earliest is kept.

    Args:
        sequence: a sequence of situations (:mod:`pipeline.windows`).
        patterns: as for :func:`pipeline.windows.instances`.

    Returns:
        Rows of each instance's first situation, increasing, of its last, and of its behaviour in the
        table of patterns, int64 [I] each.
    """
    first, last, pattern = [np.empty(0, dtype=np.int64) for _ in range(3)]
    for found in instances(sequence, patterns):
        free, free_from = np.zeros(len(found.first), dtype=np.bool_), 0
        for i, start in enumerate(found.first.tolist()):
            if start >= free_from:
                free[i], free_from = True, start + found.n
        first = np.append(first, found.first[free])
        last = np.append(last, found.first[free] + found.n - 1)
        pattern = np.append(pattern, found.pattern[free])
    order = np.argsort(first)
    return first[order], last[order], pattern[order]
