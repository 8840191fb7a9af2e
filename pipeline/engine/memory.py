"""A match in memory: each noun is computed by its stage when it is asked for, and kept."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.inputs import Inputs
from pitchlore.pipeline.engine.matches import made
from pitchlore.pipeline.engine.stage import ALL, Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store.tables import check
from pitchlore.pipeline.store.work import Made
from pitchlore.schemas import Table


@dataclass(frozen=True, slots=True)
class Computed:
    """An output in memory.

    Attributes:
        name: the match's id, or that of the group of all matches.
        settings: settings that it was made with.
        details: counts and facts that later stages and reports need.
        files: a table by its name, bytes by their role.
    """

    name: str
    settings: Mapping[str, Any]
    details: Mapping[str, Any]
    files: Mapping[str, Any]


class MemoryInputs(Inputs):
    """All nouns of one match, computed by the functions of ``STAGES``; a noun computes those it is made from.

    The tables are those of a data folder that holds this match alone, bit for bit: what is fitted to many
    matches, or selected from them, is fitted to this one. Versions (knowledge, policies) are not made.

    Args:
        match: the match.
        settings: settings of all stages.
        given: settings that the match was read or played with.
    """

    def __init__(
        self, match: MatchLog, settings: Settings = Settings(), given: Mapping[str, Any] | None = None
    ) -> None:
        self._match = match
        self._settings = settings
        self._made = {"matches": _checked(match.info.match_id, given or {}, made(match))}

    def __getitem__(self, noun: str) -> Sequence[Computed]:
        stage = STAGES.get(noun)
        if stage is None or stage.per not in (Per.MATCH, Per.GROUP):
            return ()
        if noun not in self._made:
            assert stage.compute is not None
            own = stage.settings(self._settings)
            name = self._match.info.match_id if stage.per is Per.MATCH else ALL
            self._made[noun] = _checked(name, own.model_dump(mode="json"), stage.compute(self, own))
        return (self._made[noun],)

    def settings(self, noun: str) -> Mapping[str, Any]:
        """As for the protocol; nothing is computed."""
        if noun in self._made:
            return self._made[noun].settings
        return STAGES[noun].settings(self._settings).model_dump(mode="json")

    def tables(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """As for the protocol."""
        for output in self[noun]:
            if schema.NAME not in output.files:
                raise NotFound(f"{noun} {output.name} has no {schema.NAME}",
                               next_step=f"There are: {', '.join(sorted(output.files)) or 'none'}")
            yield output.files[schema.NAME]

    def batches(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """As for the protocol."""
        found = [output.files[schema.NAME] for output in self[noun] if schema.NAME in output.files]
        yield pl.concat([schema.empty(), *found], rechunk=True)

    def blobs(self, noun: str, role: str) -> Iterator[bytes | None]:
        """As for the protocol."""
        for output in self[noun]:
            yield output.files.get(role)

    def log(self) -> MatchLog:
        """As for the protocol."""
        return self._match


def _checked(name: str, settings: Mapping[str, Any], made: Made) -> Computed:
    """An outcome as an output; its tables are checked against their schemas, as a store checks them.

    Raises:
        SchemaMismatch: if a table breaks its schema.
    """
    for frame, schema in made.tables:
        check(frame, schema, where=name)
    tables = {schema.NAME: frame.rechunk() for frame, schema in made.tables}
    blobs = {role: data for role, (_, data) in made.blobs.items()}
    return Computed(name, settings, made.details, tables | blobs)
