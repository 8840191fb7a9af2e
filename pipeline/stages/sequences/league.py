"""The sequences of all matches, in chunks that suit columnar work and memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import I32
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.schemas import SIDES, Sequences

#: Situations of a chunk: numpy's calls cost little then.
_CHUNK = 1 << 17
#: Situations that are kept in memory from pass to pass, some 450 MB of the columns that behaviours need; more
#: are read anew for each, five times.
_KEPT = 3 << 22
#: The owner of rows that do not count.
_NOBODY = -1

#: By match, the team that each of its sides counts for; a side that does not count is missing.
TeamsOfSides = Mapping[str, Mapping[str, Team]]


class LeagueSequences:
    """Sequences of many matches in chunks of whole matches, for passes over all of them.

    A chunk has some columns of schema Sequences; ``match_id`` is int32, the match's place in ``matches``.
    Column ``who``, int32, is the team's place in ``teams``. Rows of sides that do not count are left out.

    Args:
        sequences: a function that gives the rows of schema Sequences of the matches, whole matches in each
            table. It is called again for each pass if they are too many to be kept.
        sides: by match, the team that each of its sides counts for; a side that does not count is missing.
        columns: columns of schema Sequences; None: all.

    Attributes:
        matches: ids of the matches, sorted.
        teams: the teams, sorted.
    """

    def __init__(
        self, sequences: Callable[[], Iterable[pl.DataFrame]], sides: TeamsOfSides,
        columns: Sequence[str] | None = None,
    ) -> None:
        self._sequences = sequences
        self._columns = columns or list(Sequences.dtypes())
        self._kept: list[pl.DataFrame] | None = None
        self.matches = sorted(sides)
        self.teams = sorted({team for own in sides.values() for team in own.values()})
        places = {team: place for place, team in enumerate(self.teams)}
        self._places = {match: place for place, match in enumerate(self.matches)}
        # the last row is of matches without sides
        self._owners: I32 = np.array([
            [places[own[side]] if side in own else _NOBODY for side in SIDES]
            for own in (*(sides[match] for match in self.matches), {})], dtype=np.int32)

    def __iter__(self) -> Iterator[pl.DataFrame]:
        if self._kept is not None:
            yield from self._kept
            return
        kept, rows = list[pl.DataFrame](), 0
        for chunk in self.once():
            rows += chunk.height
            kept.append(chunk)
            if rows > _KEPT:
                kept.clear()
            yield chunk
        if rows <= _KEPT:
            self._kept = kept

    def once(self) -> Iterator[pl.DataFrame]:
        """The chunks for a single pass: none is kept."""
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
        runs = sequence["match_id"].rle().struct.unnest()
        of_run = np.array([self._places.get(name, -1) for name in runs["value"]], dtype=np.int32)
        match = np.repeat(of_run, runs["len"].to_numpy())
        who = self._owners[match, sequence["team"].to_physical().to_numpy()]
        owned = sequence.with_columns(match_id=pl.Series(match), who=pl.Series(who))
        return owned.select(*self._columns, "who").filter(pl.Series(who != _NOBODY))
