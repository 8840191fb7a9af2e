"""The rounds of the selection: the grams of all matches are counted anew in each, the longest first.

What is worth keeping of a gram depends on all matches, and what is left for shorter grams on that. Sequences
of situations are small, so each round is one columnar pass over all of them, a microsecond a situation: one
more match changes no output of another.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import Bools
from pitchlore.pipeline.settings import BehaviourSettings
from pitchlore.pipeline.stages.behaviours.grams import cover, grams, merge, spelt
from pitchlore.pipeline.stages.behaviours.select import select
from pitchlore.pipeline.stages.behaviours.som import SelfOrganisingMap
from pitchlore.pipeline.stages.sequences.league import LeagueSequences, TeamsOfSides
from pitchlore.pipeline.stages.sides.teams import Team, as_of
from pitchlore.schemas import ROLES, Grams, Neurons, Patterns

#: Columns of schema Sequences that behaviours are learned from.
_COLUMNS = ("match_id", "role", "code", "follows", "value", "change", "x", "y")


class RoundsOutcome(NamedTuple):
    """Outcome of all rounds.

    Attributes:
        patterns: rows of schema Patterns.
        grams: rows of schema Grams.
        neurons: rows of schema Neurons.
        maps: the trained maps of each length, by team.
        reports: counts of each round and team, JSON-able.
    """

    patterns: pl.DataFrame
    grams: pl.DataFrame
    neurons: pl.DataFrame
    maps: dict[int, dict[Team, SelfOrganisingMap]]
    reports: list[dict[str, Any]]


def learn(
    sequences: Callable[[], Iterable[pl.DataFrame]], sides: TeamsOfSides, settings: BehaviourSettings
) -> RoundsOutcome:
    """Select the behaviours of all lengths, for each team by itself.

    The result does not depend on the order of the matches. Memory is bounded by the distinct grams.

    Args:
        sequences: as for :class:`pipeline.stages.sequences.league.LeagueSequences`.
        sides: as for it.
        settings: settings of the rounds.
    """
    chunks = LeagueSequences(sequences, sides, _COLUMNS)
    recognised = np.zeros(len(chunks.teams), dtype=np.int64)
    for chunk in chunks:
        recognised += np.bincount(chunk["who"].to_numpy(), minlength=len(recognised))
    known, counted, neurons = [_owned(Patterns.empty(), 0)], [Grams.empty()], [Neurons.empty()]
    maps: dict[int, dict[Team, SelfOrganisingMap]] = {}
    reports: list[dict[str, Any]] = []
    last = settings.rounds[-1] if settings.usual else None
    taken = dict[int, Bools]()
    for round_ in settings.rounds:
        before, newest = (pl.concat(each).filter("kept")
                          for each in (known, [known[0], *known[-len(chunks.teams):]]))
        merged = spelt(merge(_left(chunks, round_.n, newest, taken)), round_.n)
        for who, team in enumerate(chunks.teams):
            own = merged.filter(pl.col("who") == who).drop("who")
            paying = before.filter(pl.col("who") == who)["role"].to_list() if round_ is last else ROLES
            selection = select(own, int(recognised[who]), settings, round_, paying)
            known.append(_owned(as_of(selection.patterns, team), who))
            neurons.append(as_of(selection.neurons, team))
            lies = own.with_columns(pl.Series("neuron", selection.neuron, dtype=pl.Int16))
            often = lies.filter(pl.col("count") >= settings.support_at_least)
            counted.append(as_of(often, team).select(list(Grams.dtypes())))
            if selection.map is not None:
                maps.setdefault(round_.n, {})[team] = selection.map
            reports.append(team._asdict() | selection.report._asdict())
    return RoundsOutcome(pl.concat(known).drop("who"), pl.concat(counted), pl.concat(neurons), maps, reports)


def _left(
    chunks: LeagueSequences, n: int, newest: pl.DataFrame, taken: dict[int, Bools]
) -> Iterator[pl.DataFrame]:
    """Grams of each chunk in what the patterns so far leave.

    Args:
        chunks: the sequences.
        n: length of the grams.
        newest: patterns of the round before.
        taken: masks of what earlier patterns cover, by number of the chunk; brought up to date.
    """
    for number, chunk in enumerate(chunks):
        taken[number] = cover(chunk, newest, taken.get(number))
        yield grams(chunk, n, taken[number])


def _owned(patterns: pl.DataFrame, who: int) -> pl.DataFrame:
    return patterns.with_columns(who=pl.lit(who, dtype=pl.Int64))
