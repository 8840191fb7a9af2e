"""A piece of work: its key and its outcome."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import polars as pl

from pitchlore.pipeline.base.digests import Content, canonical, digest
from pitchlore.pipeline.store.receipts import FileRecord
from pitchlore.pipeline.store.tables import to_parquet
from pitchlore.schemas import Table


@dataclass(frozen=True)
class Work:
    """One piece of work: exactly the things that its outcome depends on.

    Attributes:
        noun: the stage.
        name: the output, unique in its noun.
        settings: settings of the stage, JSON-able.
        version: version of the stage. It is raised when the stage makes other bytes of the same inputs.
        inputs: label to SHA-256.
        seed: None where the stage draws nothing.
        schemas: schemas of the tables it makes.
        through: versions of other stages that it runs itself, and that its outcome depends on.
        deciding: the settings that decide the outcome, None if all do.
    """

    noun: str
    name: str
    settings: Mapping[str, Any]
    version: int
    inputs: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None
    schemas: tuple[type[Table], ...] = ()
    through: Mapping[str, int] = field(default_factory=dict)
    deciding: Mapping[str, Any] | None = None

    @property
    def versions(self) -> dict[str, int]:
        """The versions of all stages that the outcome depends on."""
        return {**self.through, self.noun: self.version}

    @cached_property
    def key(self) -> str:
        """16 hex digits that identify this work. They cover ``version``, not the code."""
        deciding = self.settings if self.deciding is None else self.deciding
        parts = [
            self.noun, self.name, dict(self.inputs), dict(deciding), self.seed,
            [schema.tag() for schema in self.schemas], self.versions,
        ]
        return digest(canonical(parts))[:16]


@dataclass(frozen=True, slots=True)
class Made:
    """The outcome of a piece of work.

    Attributes:
        tables: each with its schema; the file is named for the schema.
        blobs: other files, by what they hold: suffix and bytes.
        details: JSON-able facts that later stages and reports need.
    """

    tables: Sequence[tuple[pl.DataFrame, type[Table]]] = ()
    blobs: Mapping[str, tuple[str, Content]] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)


def contents(made: Made, *, where: str) -> dict[str, tuple[FileRecord, Content]]:
    """Record and bytes of each file of an outcome, by role; the record's path is ``role.suffix``.

    Raises:
        SchemaMismatch: if a table breaks its schema.
    """
    found: dict[str, tuple[FileRecord, Content]] = {}
    for frame, schema in made.tables:
        table = to_parquet(frame, schema, where=where)
        record = FileRecord.of(f"{schema.NAME}.parquet", table, table=schema.tag(), rows=frame.height)
        found[schema.NAME] = record, table
    for role, (suffix, data) in made.blobs.items():
        found[role] = FileRecord.of(f"{role}.{suffix}", data), data
    return found
