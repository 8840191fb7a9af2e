"""A stage: its unit, its inputs, its outputs for a scope."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

import polars as pl
from pydantic import BaseModel, ConfigDict

from pipeline.pitch import Pitch
from pipeline.settings import Settings
from pipeline.store import Store
from pipeline.store.receipts import Manifest, Receipt
from pipeline.store.work import Made, Work
from schemas import Table

#: Name of the output of a group, where the group is all matches of the store.
ALL = "all"


class Scope(BaseModel):
    """The matches and gram lengths of a run.

    Attributes:
        matches: ids of the matches, sorted.
        lengths: lengths of the grams, longest first.
        group: None if behaviours are selected from all matches of the store; else the id of the group
            they are selected from. With groups, learning from a new match always costs the same.
    """

    model_config = ConfigDict(frozen=True)

    matches: tuple[str, ...]
    lengths: tuple[int, ...]
    group: str | None = None

    def of(self, output: Output) -> Scope:
        """What of the scope decides an output: of its matches that of the output, if it has one."""
        return self if output.match is None else self.model_copy(update={"matches": (output.match,)})

    def round(self, n: int) -> str:
        """Name of the output of the round for grams of length ``n``: ``n4``, ``<group>.n4``."""
        return f"n{n}" if self.group is None else f"{self.group}.n{n}"


class Output(NamedTuple):
    """One output of a stage.

    Attributes:
        name: unique in its noun.
        match: its match, None if it is of all matches of the scope.
        n: its length of grams, None if it has no single length.
    """

    name: str
    match: str | None = None
    n: int | None = None


class Per(Enum):
    """The unit for which a stage has one output."""

    MATCH = "match"
    GROUP = "group of matches"
    GRAMS = "match and gram length"
    ROUND = "gram length"
    VERSION = "version"
    OWN = "piece of work of a flow of its own"


class Longer(NamedTuple):
    """An input that is read only for greater gram lengths.

    Attributes:
        noun: the stage.
    """

    noun: str


class Inputs(Mapping[str, Sequence[Receipt]]):
    """The inputs of one output, by noun; a table is read when it is asked for.

    Args:
        store: holds the inputs.
        receipts: receipts by noun, in order. A manifest stands for a version.
        n: length of grams of the output, 0 if it has no single length.
        version: number of the version that is being made, 0 if the noun has no versions.
    """

    def __init__(
        self, store: Store, receipts: Mapping[str, Sequence[Receipt]], *, n: int = 0, version: int = 0
    ) -> None:
        self._store = store
        self._receipts = receipts
        self.n = n
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
            yield self._store.read_table(receipt, schema.NAME, schema)

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
    inputs: tuple[str | Longer, ...] = ()
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

    def outputs(
        self, scope: Scope, matches: Sequence[str] | None = None, lengths: Sequence[int] | None = None
    ) -> list[Output]:
        """The outputs of this stage for a scope, or for some of its matches and lengths."""
        matches = scope.matches if matches is None else matches
        lengths = scope.lengths if lengths is None else lengths
        match self.per:
            case Per.MATCH:
                return [Output(match, match) for match in matches]
            case Per.GROUP:
                return [Output(scope.group or ALL)]
            case Per.GRAMS:
                return [Output(f"{match}.n{n}", match, n) for n in lengths for match in matches]
            case Per.ROUND:
                return [Output(scope.round(n), n=n) for n in lengths]
            case _:
                return []
