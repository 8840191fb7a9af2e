"""A stage: its unit, its inputs, its outputs for a scope."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

import polars as pl
from pydantic import BaseModel, ConfigDict

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Manifest, Receipt
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import Table

#: Tables by the SHA-256 of their files.
Seen = dict[str, pl.DataFrame]

#: Files that are read together, bytes.
_TOGETHER = 8 << 20

#: Name of the output of a group, where the group is all matches of the store.
ALL = "all"


class Scope(BaseModel):
    """The matches of a run.

    Attributes:
        matches: ids of the matches, sorted.
        group: None if behaviours are selected from all matches of the store; else the id of the group
            they are selected from. With groups, learning from a new match always costs the same.
    """

    model_config = ConfigDict(frozen=True)

    matches: tuple[str, ...]
    group: str | None = None

    def of(self, output: Output) -> Scope:
        """The part of the scope that decides an output: its match, if it has one."""
        return self if output.match is None else self.model_copy(update={"matches": (output.match,)})

    @property
    def name(self) -> str:
        """Name of an output that is of all matches of the scope."""
        return self.group or ALL


class Output(NamedTuple):
    """One output of a stage.

    Attributes:
        name: unique in its noun.
        match: its match, None if it is of all matches of the scope.
    """

    name: str
    match: str | None = None


class Per(Enum):
    """The unit for which a stage has one output."""

    MATCH = "match"
    GROUP = "group of matches"
    VERSION = "version"
    OWN = "piece of work of a flow of its own"


class Inputs(Mapping[str, Sequence[Receipt]]):
    """The inputs of one output, by noun; a table is read when it is asked for.

    Args:
        store: holds the inputs.
        receipts: receipts by noun, in order. A manifest stands for a version.
        version: number of the version that is being made, 0 if the noun has no versions.
        seen: tables that were read before, by their SHA-256; those that are read now are added. None: each is
            read when it is asked for, and none is kept.
    """

    def __init__(
        self, store: Store, receipts: Mapping[str, Sequence[Receipt]], *, version: int = 0,
        seen: Seen | None = None,
    ) -> None:
        self._store = store
        self._receipts = receipts
        self._seen = seen
        self.version = version

    def __getitem__(self, noun: str) -> Sequence[Receipt]:
        return self._receipts[noun]

    def __iter__(self) -> Iterator[str]:
        return iter(self._receipts)

    def __len__(self) -> int:
        return len(self._receipts)

    def table(self, noun: str, schema: type[Table]) -> pl.DataFrame:
        """The table of the only output of a noun.

        Raises:
            CorruptFile, SchemaMismatch: as for :meth:`pipeline.store.Store.read_table`.
        """
        (found,) = self.tables(noun, schema)
        return found

    def tables(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """The tables of all outputs of a noun, each read when its turn comes."""
        for receipt in self[noun]:
            sha256 = receipt.files[schema.NAME].sha256 if schema.NAME in receipt.files else None
            if self._seen is None or sha256 is None:
                yield self._store.read_table(receipt, schema.NAME, schema)
                continue
            if sha256 not in self._seen:
                self._seen[sha256] = self._store.read_table(receipt, schema.NAME, schema)
            yield self._seen[sha256]

    def batches(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """The tables of the outputs of a noun that have one, many of them joined in each."""
        batch, size = list[Receipt](), 0
        for receipt in self[noun]:
            if schema.NAME in receipt.files:
                batch.append(receipt)
                size += receipt.files[schema.NAME].size
            if size > _TOGETHER:
                yield self._store.read_tables(batch, schema.NAME, schema)
                batch, size = [], 0
        yield self._store.read_tables(batch, schema.NAME, schema)

    def blob(self, noun: str, role: str) -> bytes | None:
        """A file other than a table, of the only output of a noun; None if there is none."""
        (found,) = self.blobs(noun, role)
        return found

    def blobs(self, noun: str, role: str) -> Iterator[bytes | None]:
        """A file other than a table, of each output of a noun."""
        for receipt in self[noun]:
            yield self._store.read(receipt, role) if role in receipt.files else None

    def details(self, noun: str) -> dict[str, Any]:
        """Details of the only output of a noun."""
        (receipt,) = self[noun]
        return receipt.details

    def where(self, noun: str, role: str) -> str:
        """Path of a file of the only output of a noun, for error messages."""
        (receipt,) = self[noun]
        return str(self._store.root / receipt.files[role].path)

    @property
    def pitch(self) -> Pitch:
        """The pitch of the match that the output is of."""
        return Pitch.model_validate(self.details("matches")["pitch"])


class Plan(NamedTuple):
    """The inputs of a version that may be made.

    Attributes:
        receipts: receipts by noun, for :class:`Inputs`.
        inputs: label to SHA-256, for the key.
        parent: the version that it follows or is made from, None for the first.
        standing: the version that already holds this work, None to look for it by the key.
        seed: seed of the work.
    """

    receipts: Mapping[str, Sequence[Receipt]]
    inputs: Mapping[str, str]
    parent: int | None = None
    standing: Manifest | None = None
    seed: int | None = None


@dataclass(frozen=True, slots=True)
class Stage:
    """How one noun is made from others.

    Attributes:
        noun: the stage.
        per: the unit that has one output.
        inputs: the nouns that it is made from, each once.
        schemas: schemas of the tables that it makes.
        version: raised when the stage makes other bytes from the same inputs; the goldens say when.
        compute: function from inputs and settings to tables; None if the noun has a flow of its own.
        choose: for a noun with one output a group, the function from store, output, scope and settings to the
            matches of the scope that it is made from; None: all.
        plan: for a versioned noun, the function from store, scope, settings and stage to the inputs of
            the next version.
    """

    noun: str
    per: Per
    inputs: tuple[str, ...] = ()
    schemas: tuple[type[Table], ...] = ()
    version: int = 1
    compute: Callable[[Inputs, Any], Made] | None = None
    plan: Callable[[Store, Scope, Any, Stage], Plan] | None = None
    choose: Callable[[Store, Output, Scope, Any], tuple[str, ...]] | None = None

    def settings(self, settings: Settings) -> BaseModel:
        """The settings of this stage among those of a run."""
        found = getattr(settings, self.noun)
        assert isinstance(found, BaseModel)
        return found

    def work(
        self, name: str, settings: BaseModel, inputs: Mapping[str, str], *, seed: int | None = None,
        through: Mapping[str, int] | None = None,
    ) -> Work:
        """The piece of work that makes an output from these inputs (label to SHA-256)."""
        return Work(
            noun=self.noun, name=name, settings=settings.model_dump(mode="json"), version=self.version,
            inputs=inputs, seed=seed, schemas=self.schemas, through=through or {},
        )

    def outputs(self, scope: Scope, matches: Sequence[str] | None = None) -> list[Output]:
        """The outputs of this stage for a scope, or for some of its matches."""
        match self.per:
            case Per.MATCH:
                return [Output(match, match) for match in (scope.matches if matches is None else matches)]
            case Per.GROUP:
                return [Output(scope.name)]
            case _:
                return []
