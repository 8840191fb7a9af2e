"""The tables of one match by their names, over its inputs. Views take this, whatever holds the match."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Self, overload

import polars as pl

from pitchlore.pipeline.engine.inputs import Inputs, Seen, StoreInputs
from pitchlore.pipeline.engine.stage import ALL, Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.schemas import (
    Acts,
    Chances,
    Choices,
    Commands,
    Decisions,
    Efforts,
    GameEvents,
    Goals,
    Kicks,
    Matches,
    Moments,
    PassAttempts,
    Passes,
    Phases,
    Possession,
    Pressing,
    Pressure,
    Quality,
    Referee,
    Restarts,
    Sequences,
    Shots,
    Sides,
    Sights,
    Situations,
    Space,
    Stamina,
    Table,
    Trajectories,
    Values,
    Worths,
)

if TYPE_CHECKING:
    from pitchlore.pipeline.matches.frame import MatchLog


class TableOf:
    """A table of a match as an attribute; its docstring is made from the schema.

    Args:
        schema: schema of the table.
        nouns: the stages that make it; the rows of the first one come first.
        optional: whether a stage, or the match, may lack the table; it is empty then.
    """

    def __init__(self, schema: type[Table], *nouns: str, optional: bool = False) -> None:
        self.schema, self.nouns, self.optional = schema, nouns, optional
        self.__doc__ = columns_in_words(schema)

    @overload
    def __get__(self, match: None, owner: type) -> Self: ...

    @overload
    def __get__(self, match: MatchTables, owner: type) -> pl.DataFrame: ...

    def __get__(self, match: MatchTables | None, owner: type) -> Self | pl.DataFrame:
        return self if match is None else self.of(match)

    def of(self, match: MatchTables) -> pl.DataFrame:
        """The table of a match; of what is of many matches, its rows."""
        found = [match.inputs.table(noun, self.schema) for noun in self.nouns
                 if not self.optional or any(self.schema.NAME in it.files for it in match.inputs[noun])]
        table = pl.concat(found) if found else self.schema.empty()
        return table if STAGES[self.nouns[0]].per is Per.MATCH else table.filter(match_id=match.name)


def columns_in_words(schema: type[Table]) -> str:
    """A table in words: the meaning of a row, and each column with its dtype, meaning and unit."""
    lines = (f"    {name} ({dtype}): {schema.meanings()[name]}" for name, dtype in schema.dtypes().items())
    return "\n".join([f"{str(schema.__doc__).splitlines()[0]} A row each; columns:", "", *lines])


class MatchTables:
    """Tables of one match. Each is read, or computed, when it is asked for.

    Args:
        inputs: all nouns of the match; they decide what is kept in memory.
    """

    matches = TableOf(Matches, "matches")
    referee = TableOf(Referee, "matches")
    quality = TableOf(Quality, "matches", "trajectories")
    commands = TableOf(Commands, "matches", optional=True)
    game_events = TableOf(GameEvents, "matches", optional=True)
    kicks = TableOf(Kicks, "matches", optional=True)
    stamina = TableOf(Stamina, "matches", optional=True)
    sides = TableOf(Sides, "sides")
    trajectories = TableOf(Trajectories, "trajectories")
    situations = TableOf(Situations, "situations")
    goals = TableOf(Goals, "goals")
    possession = TableOf(Possession, "events")
    passes = TableOf(Passes, "events")
    shots = TableOf(Shots, "events")
    pressure = TableOf(Pressure, "events")
    restarts = TableOf(Restarts, "events")
    pass_attempts = TableOf(PassAttempts, "analysis", optional=True)
    efforts = TableOf(Efforts, "analysis", optional=True)
    phases = TableOf(Phases, "analysis", optional=True)
    pressing = TableOf(Pressing, "analysis", optional=True)
    space = TableOf(Space, "analysis", optional=True)
    moments = TableOf(Moments, "moments")
    chances = TableOf(Chances, "chances")
    values = TableOf(Values, "values")
    worths = TableOf(Worths, "values")
    acts = TableOf(Acts, "acts")
    sequences = TableOf(Sequences, "sequences")
    choices = TableOf(Choices, "sequences", optional=True)
    sights = TableOf(Sights, "sequences", optional=True)
    decisions = TableOf(Decisions, "decisions")

    def __init__(self, inputs: Inputs) -> None:
        self.inputs = inputs

    @property
    def name(self) -> str:
        """Id of the match."""
        return self.inputs.only("matches").name

    @property
    def pitch(self) -> Pitch:
        """Field of play, and its kind."""
        return self.inputs.pitch

    @property
    def log(self) -> MatchLog:
        """The match as it was recorded: axes of the pitch, no gaps filled."""
        return self.inputs.log()

    @property
    def recorded_quality(self) -> pl.DataFrame:
        """Rows of schema Quality that the import noted."""
        return self.inputs.table("matches", Quality)

    @property
    def gap_s(self) -> float:
        """Time between situations that are not consecutive, by the settings of its sequences, s."""
        return GramSettings.model_validate(self.inputs.settings("sequences")).gap_s


class _Found(Mapping[str, Sequence[Receipt]]):
    """The receipts of a match, by noun, looked up when they are asked for, and then kept.

    A noun of groups has the output of all matches, or else of the first group that holds the match.
    """

    def __init__(self, store: Store, match: str, known: Mapping[str, Sequence[Receipt]]) -> None:
        self._store, self._match, self._known = store, match, dict(known)

    def __getitem__(self, noun: str) -> Sequence[Receipt]:
        if noun not in self._known:
            of_match = STAGES[noun].per is Per.MATCH
            receipt = self._store.receipt(noun, self._match) if of_match else self._group(noun)
            self._known[noun] = () if receipt is None else (receipt,)
        return self._known[noun]

    def __iter__(self) -> Iterator[str]:
        return iter(STAGES.of_matches)

    def __len__(self) -> int:
        return len(STAGES.of_matches)

    def _group(self, noun: str) -> Receipt | None:
        receipts = sorted(self._store.receipts(noun), key=lambda receipt: (receipt.name != ALL, receipt.name))
        return next((each for each in receipts if self._match in each.details.get("matches", ())), None)


def stored_match(store: Store, match: Receipt, *, seen: Seen | None = None) -> StoreInputs:
    """All nouns of a match in a store.

    Args:
        store: the data folder.
        match: receipt of the match.
        seen: as for :class:`pipeline.engine.inputs.StoreInputs`.
    """
    return StoreInputs(store, _Found(store, match.name, {"matches": (match,)}), seen=seen)
