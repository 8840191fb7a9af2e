"""Decisions: the behaviour that a robot began in a state, with its reward and value.

If a team logged its choices, those are its decisions. Otherwise the behaviours found in a robot's
sequence of situations count as its choices (paper sections 3.2.2 and 4). The time between two of them
belongs to the first. All matches are one columnar pass: which behaviours there are depends on all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from hashlib import sha256

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import I64, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.numbers.sums import exact
from pitchlore.pipeline.stages.sequences.league import LeagueSequences, TeamsOfSides
from pitchlore.pipeline.stages.sequences.windows import instances
from pitchlore.schemas import Decisions

#: Decisions that are hashed at once, whole matches: this bounds memory.
_AT_ONCE = 1 << 17
_ORDER = ("match_id", "team", "robot", "t_ns")


def all_decisions(
    sequences: Callable[[], Iterable[pl.DataFrame]], sides: TeamsOfSides, patterns: pl.DataFrame,
    choices: pl.DataFrame,
) -> pl.DataFrame:
    """The decisions of all matches: logged ones for a team that has any, observed ones for the others.

    Args:
        sequences: as for :class:`pipeline.stages.sequences.league.LeagueSequences`.
        sides: as for it.
        patterns: rows of schema Patterns, of all rounds and teams.
        choices: rows of schema Choices of these matches.

    Returns:
        Rows of schema Decisions.
    """
    league = LeagueSequences(sequences, sides)
    teams = pl.DataFrame(league.teams, orient="row", schema={"team": pl.String, "kind": pl.String})
    owned = patterns.join(
        teams.with_columns(who=pl.int_range(pl.len(), dtype=pl.Int64)), on=("team", "kind"),
        maintain_order="left")
    names = pl.Series("match_id", league.matches, dtype=pl.String)
    seen = (
        found.with_columns(names.gather(found["match_id"])).cast(pl.Schema(Decisions.dtypes()))
        for found in (observed_decisions(chunk, owned) for chunk in league.once())
    )
    return complete(pl.concat([Decisions.empty(), *seen]), choices)


def observed_decisions(sequence: pl.DataFrame, patterns: pl.DataFrame) -> pl.DataFrame:
    """Decisions of robots, read from their situations.

    Args:
        sequence: columns of schema Sequences [S], of whole matches; with a column who, rows of several owners
            are distinguished.
        patterns: columns behaviour_id, role and codes, of all rounds; with a column who, each is of that
            owner.

    Returns:
        Columns of schema Decisions, none of them chosen; the match is named as in ``sequence``. A robot's
        behaviours do not overlap: longer ones have precedence, then earlier ones. Decisions in unknown states
        are left out. A robot's last decision in an episode ends with it, and has its reward.
    """
    first, last, pattern = disjoint_instances(sequence, patterns)
    total = np.append(0.0, np.cumsum(exact(sequence["value"].to_numpy())))
    value = (total[last + 1] - total[first]) / (last + 1 - first)
    following = pl.col("t_ns").shift(-1).over("match_id", "team", "robot", "episode")
    final = following.is_null()
    return sequence[first].rename({"start_ns": "t_ns"}).with_columns(
        behaviour_id=patterns["behaviour_id"][pattern], value=exact(value), done_ns=sequence["end_ns"][last],
        chosen=False, random=False,
    ).filter(pl.col("state").is_not_null()).with_columns(
        end_ns=following.fill_null(pl.max_horizontal("over_ns", "done_ns")),
        reward=pl.when(final).then("reward").otherwise(0.0),
        ends=pl.when(final).then("ends"),
    ).select(list(Decisions.dtypes()))


def complete(seen: pl.DataFrame, choices: pl.DataFrame) -> pl.DataFrame:
    """The decisions of matches: logged ones for a team that has any in a match, observed ones for the others.

    Args:
        seen: rows of schema Decisions from :func:`observed_decisions`.
        choices: rows of schema Choices of the same matches.

    Returns:
        Rows of schema Decisions.
    """
    if not choices.is_empty():
        seen = pl.concat([seen.join(choices, on=("match_id", "team"), how="anti"), choices])
    return seen.sort(_ORDER)


def decision_digests(decisions: pl.DataFrame) -> dict[str, str]:
    """SHA-256 of the rows of each match that has any, for rows of schema Decisions in order."""
    if decisions.is_empty():
        return {}
    names = decisions["behaviour_id"].unique().to_list()
    hashes = [-1 if name is None else int.from_bytes(sha256(name.encode()).digest()[:7]) for name in names]
    found, first = dict[str, str](), 0
    runs = decisions["match_id"].rle().struct.unnest().with_columns(end=pl.col("len").cum_sum())
    for _, block in runs.group_by(pl.col("end") // _AT_ONCE, maintain_order=True):
        columns = decisions[first:block["end"][-1]].drop("match_id").with_columns(
            pl.col("behaviour_id").replace_strict(names, hashes, return_dtype=pl.Int64),
            pl.col("ends").to_physical().cast(pl.Int64).fill_null(-1),
            pl.col("team", "role").to_physical(),
        )
        table = np.column_stack([
            column.to_numpy().view(np.int64) if column.dtype.is_float() else column.cast(pl.Int64).to_numpy()
            for column in columns
        ])
        of_match = np.split(table, block["end"].to_numpy()[:-1].astype(np.int64) - first)
        found |= {name: sha256(rows.tobytes()).hexdigest()
                  for name, rows in zip(block["value"], of_match, strict=True)}
        first = block["end"][-1]
    return found


def choosing(decisions: pl.DataFrame) -> dict[str, list[str]]:
    """The sides of each match of which decisions were logged, for rows of schema Decisions or Choices."""
    found: dict[str, list[str]] = {}
    logged = decisions.filter("chosen").select("match_id", pl.col("team").cast(pl.String)).unique(
        maintain_order=True)
    for match, team in logged.iter_rows():
        found.setdefault(match, []).append(team)
    return found


def disjoint_instances(sequence: pl.DataFrame, patterns: pl.DataFrame) -> tuple[I64, I64, I64]:
    """Instances of behaviours, none sharing a situation with another.

    Longer patterns are matched first, shorter ones in the situations that these leave. Of overlapping
    instances of one length the earliest is kept.

    Args:
        sequence: a sequence of situations (:mod:`pipeline.stages.sequences.windows`).
        patterns: as for :func:`pipeline.stages.sequences.windows.instances`.

    Returns:
        Rows of each instance's first situation, increasing, of its last, and of its behaviour in the
        table of patterns, int64 [I] each.
    """
    first, last, pattern = [np.empty(0, dtype=np.int64) for _ in range(3)]
    for found in instances(sequence, patterns):
        free = _apart(found.first, found.n)
        first = np.append(first, found.first[free])
        last = np.append(last, found.first[free] + found.n - 1)
        pattern = np.append(pattern, found.pattern[free])
    order = np.argsort(first)
    return first[order], last[order], pattern[order]


@njit(cache=True, nogil=True)
def _apart(first: I64, n: int) -> Bools:
    """Mask of the runs of n that are kept, so that none overlaps an earlier one that is, bool [I]."""
    free = np.zeros(len(first), dtype=np.bool_)
    free_from = 0
    for i in range(len(first)):
        if first[i] >= free_from:
            free[i] = True
            free_from = first[i] + n
    return free
