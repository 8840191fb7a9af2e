"""The rounds of the selection: the grams of all matches are counted anew in each, the longest first.

What is worth keeping of a gram depends on all matches, and what is left for shorter grams on that. Sequences
of situations are small, so each round is one columnar pass over all of them, a microsecond a situation: one
more match changes no output of another match but that of decisions for which other behaviours were selected.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from pipeline.behaviours.grams import cover, grams, merge, spelt
from pipeline.behaviours.select import select
from pipeline.behaviours.som import SelfOrganisingMap
from pipeline.settings import BehaviourSettings
from pipeline.store.receipts import digest
from pipeline.teams import Team, as_of
from pipeline.windows import instances, owned_by, side_of
from schemas import Grams, Patterns, Sequences

#: Situations of a chunk: numpy's calls cost little then.
_CHUNK = 1 << 17
#: Situations that are kept in memory from round to round, some 200 MB; more are read anew for each.
_KEPT = 1 << 22


class Learned(NamedTuple):
    """Outcome of all rounds.

    Attributes:
        patterns: rows of schema Patterns.
        grams: rows of schema Grams.
        maps: the trained maps of each length, by team.
        reports: counts of each round and team, JSON-able.
        held: by match, SHA-256 of the patterns that have instances in it, which is all that its decisions
            depend on.
    """

    patterns: pl.DataFrame
    grams: pl.DataFrame
    maps: dict[int, dict[Team, SelfOrganisingMap]]
    reports: list[dict[str, Any]]
    held: dict[str, str]


def learn(
    sequences: Callable[[], Iterable[pl.DataFrame]], sides: Mapping[str, Mapping[str, Team]],
    settings: BehaviourSettings,
) -> Learned:
    """Select the behaviours of all lengths, for each team by itself.

    The result does not depend on the order of the matches. Memory is bounded by the distinct grams.

    Args:
        sequences: a function that gives the rows of schema Sequences of the matches, a table each. It is
            called again for each round if they are too many to be kept.
        sides: by match, the team that each of its sides counts for; a side that does not count is missing.
        settings: of the rounds.
    """
    teams = sorted({team for own in sides.values() for team in own.values()})
    chunks = _Chunks(sequences, sides, teams)
    recognised = Counter[int]()
    for chunk in chunks:
        recognised.update(chunk["who"].to_list())
    known, counted = [_owned(Patterns.empty(), 0)], [Grams.empty()]
    maps: dict[int, dict[Team, SelfOrganisingMap]] = {}
    reports: list[dict[str, Any]] = []
    for round_ in settings.rounds:
        before = pl.concat(known)
        merged = spelt(merge(grams(chunk, round_.n, cover(chunk, before)) for chunk in chunks), round_.n)
        for who, team in enumerate(teams):
            own = merged.filter(pl.col("who") == who).drop("who")
            selection = select(own, recognised[who], settings, round_)
            known.append(_owned(as_of(selection.patterns, team), who))
            often = own.filter(pl.col("count") >= settings.support_at_least)
            counted.append(as_of(often, team).select(list(Grams.dtypes())))
            if selection.map is not None:
                maps.setdefault(round_.n, {})[team] = selection.map
            reports.append(team._asdict() | selection.report._asdict())
    patterns = pl.concat(known)
    held = dict.fromkeys(chunks.matches, digest(b""))
    held |= {chunks.matches[number]: found for chunk in chunks for number, found in _held(chunk, patterns)}
    return Learned(patterns.drop("who"), pl.concat(counted), maps, reports, held)


class _Chunks:
    """Sequences of many matches in chunks, with columns match_id (int64, from 0), side and who (int64).

    Rows of sides that do not count are left out.
    """

    def __init__(
        self, sequences: Callable[[], Iterable[pl.DataFrame]], sides: Mapping[str, Mapping[str, Team]],
        teams: list[Team],
    ) -> None:
        self._sequences = sequences
        self._kept: list[pl.DataFrame] | None = None
        self.matches = sorted(sides)
        rows = [(match, index, side, teams.index(team)) for index, match in enumerate(self.matches)
                for side, team in sides[match].items()]
        self._owners = pl.DataFrame(rows, orient="row", schema={
            "match_id": pl.String, "index": pl.Int64, "team": pl.String, "who": pl.Int64})

    def __iter__(self) -> Iterator[pl.DataFrame]:
        if self._kept is not None:
            yield from self._kept
            return
        kept, rows = list[pl.DataFrame](), 0
        for chunk in self._read():
            rows += chunk.height
            kept.append(chunk)
            if rows > _KEPT:
                kept.clear()
            yield chunk
        if rows <= _KEPT:
            self._kept = kept

    def _read(self) -> Iterator[pl.DataFrame]:
        part, rows = [Sequences.empty()], 0
        for table in self._sequences():
            part.append(table)
            rows += table.height
            if rows >= _CHUNK:
                yield self._owned(part)
                part, rows = [Sequences.empty()], 0
        yield self._owned(part)

    def _owned(self, tables: list[pl.DataFrame]) -> pl.DataFrame:
        sequence = pl.concat(tables)
        return sequence.with_columns(
            pl.col("team").cast(pl.String), side=pl.Series(side_of(sequence["team"])),
        ).join(self._owners, on=("match_id", "team"), maintain_order="left").select(
            pl.col("index").alias("match_id"), "side", "who", "role", "code", "follows", "value", "change",
            "x", "y")


def _owned(patterns: pl.DataFrame, who: int) -> pl.DataFrame:
    return patterns.with_columns(who=pl.lit(who, dtype=pl.Int64))


def _held(chunk: pl.DataFrame, patterns: pl.DataFrame) -> Iterator[tuple[int, str]]:
    """Each match of a chunk by its number, and the digest of the patterns that have instances in it."""
    match, side = (chunk[name].to_numpy() for name in ("match_id", "side"))
    found = [(match[each.first], owned_by(side[each.first], each.key)) for each in instances(chunk, patterns)]
    pairs = pl.DataFrame({
        "match": np.concatenate([np.empty(0, dtype=np.int64), *(of for of, _ in found)]),
        "key": np.concatenate([np.empty(0, dtype=np.int64), *(key for _, key in found)]),
    }).unique().sort("match", "key")
    for (number,), keys in pairs.group_by("match", maintain_order=True):
        yield int(str(number)), digest(keys["key"].to_numpy().tobytes())
