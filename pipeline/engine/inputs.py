"""Inputs of a stage: a protocol. A store fulfils it, and so does a match in memory (:mod:`.memory`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import polars as pl

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.parts import read_joined
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.schemas import Table

if TYPE_CHECKING:
    from pitchlore.pipeline.matches.frame import MatchLog

#: Tables by the SHA-256 of their files.
Seen = dict[str, pl.DataFrame]


class Held(Protocol):
    """An output that others are made from. A receipt is one."""

    @property
    def name(self) -> str:
        """Its name, unique in its noun; of a match's output, the match's id."""

    @property
    def settings(self) -> Mapping[str, Any]:
        """The settings that it was made with."""

    @property
    def details(self) -> Mapping[str, Any]:
        """Counts and facts that later stages and reports need."""

    @property
    def files(self) -> Mapping[str, object]:
        """Its tables and other files, by role; a table's role is its name."""


def by_day(log: Held) -> tuple[str, str]:
    """Sort key of a league's matches: day and time, those without one first, then the id."""
    return log.details.get("started_at", ""), log.name


class Inputs(Protocol):
    """The inputs of one output, by noun. A table is read, or computed, when it is asked for.

    The inputs of a match are those of all its nouns, each with one output.

    Attributes:
        version: number of the version that is being made, 0 if the noun has no versions.
    """

    version: int = 0

    def __getitem__(self, noun: str) -> Sequence[Held]:
        """The outputs of a noun, in order; none if the noun is no input."""

    def tables(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """The tables of all outputs of a noun, each when its turn comes.

        Raises:
            NotFound: if an output has no such table.
            CorruptFile, SchemaMismatch: as for :meth:`pipeline.store.Store.read_table`.
        """

    def batches(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """The tables of the outputs of a noun that have one, many in each, in any order; at least one."""

    def pieces(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """The large tables of all outputs of a noun, in pieces; errors as for :meth:`tables`."""
        return self.tables(noun, schema)

    def blobs(self, noun: str, role: str) -> Iterator[bytes | None]:
        """A file other than a table, of each output of a noun; None where there is none."""

    def log(self) -> MatchLog:
        """The log of the match."""

    def settings(self, noun: str) -> Mapping[str, Any]:
        """Settings of the only output of a noun; empty if there is none."""
        return next((held.settings for held in self[noun]), {})

    def only(self, noun: str) -> Held:
        """The only output of a noun.

        Raises:
            NotFound: if there is none.
        """
        for held in self[noun]:
            return held
        names = [held.name for held in self["matches"]]
        raise NotFound(f"{', '.join(names)} has no {noun} yet" if names else f"there are no {noun} yet",
                       next_step="Run `pitchlore run` first")

    def table(self, noun: str, schema: type[Table]) -> pl.DataFrame:
        """The table of the only output of a noun; errors as for :meth:`tables` and :meth:`only`."""
        self.only(noun)
        return next(self.tables(noun, schema))

    def blob(self, noun: str, role: str) -> bytes | None:
        """A file other than a table, of the only output of a noun; None if there is none."""
        self.only(noun)
        return next(self.blobs(noun, role))

    def details(self, noun: str) -> Mapping[str, Any]:
        """Details of the only output of a noun."""
        return self.only(noun).details

    @property
    def pitch(self) -> Pitch:
        """The pitch of the match that the output is of."""
        return Pitch.model_validate(self.details("matches")["pitch"])


class StoreInputs(Inputs):
    """Inputs that a store holds.

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
        self._seen = seen
        self.receipts = receipts
        self.version = version

    @property
    def root(self) -> Path:
        """The data folder of the store."""
        return self._store.root

    def __getstate__(self) -> dict[str, Any]:
        """Without store and tables: another process opens its own store (:meth:`at`)."""
        return {"receipts": dict(self.receipts), "version": self.version}

    def at(self, store: Store, *, seen: Seen | None = None) -> StoreInputs:
        """The same inputs, read through another store of the same data."""
        return StoreInputs(store, self.receipts, version=self.version, seen=seen)

    def of_match(self, name: str) -> StoreInputs:
        """The inputs that are outputs of this name."""
        return StoreInputs(self._store, {
            noun: [receipt for receipt in receipts if receipt.name == name]
            for noun, receipts in self.receipts.items()})

    def __getitem__(self, noun: str) -> Sequence[Receipt]:
        return self.receipts.get(noun, ())

    def tables(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """As for the protocol."""
        for receipt in self[noun]:
            sha256 = receipt.files[schema.NAME].sha256 if schema.NAME in receipt.files else ""
            table = None if self._seen is None else self._seen.get(sha256)
            if table is None:
                table = self._store.read_table(receipt, schema.NAME, schema)
                if self._seen is not None:
                    self._seen[sha256] = table
            yield table

    def batches(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """As for the protocol."""
        return read_joined(self._store, self[noun], schema)

    def pieces(self, noun: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """As for the protocol."""
        for receipt in self[noun]:
            yield from self._store.read_pieces(receipt, schema.NAME, schema)

    def blobs(self, noun: str, role: str) -> Iterator[bytes | None]:
        """As for the protocol."""
        for receipt in self[noun]:
            yield self._store.read(receipt, role) if role in receipt.files else None

    def log(self) -> MatchLog:
        """As for the protocol."""
        from pitchlore.pipeline import matches  # noqa: PLC0415 (see pipeline.engine.stages)

        (receipt,) = self["matches"]
        where = self._store.root / receipt.files["log"].path
        return matches.read(self._store.read(receipt, "log"), where=str(where))
