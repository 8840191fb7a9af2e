"""Outputs of stages: content-addressed files, and the receipts that name the current ones."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import polars as pl

from pipeline.errors import CorruptFile, PitchloreError
from pipeline.store.files import Files, pretty, read_model, safe, verified
from pipeline.store.receipts import SOFTWARE, FileRecord, Receipt, digest
from pipeline.store.tables import from_parquet, to_parquet
from schemas import Table

KEYED_FILE = re.compile(r"-[0-9a-f]{12}\.(?!receipt\.)[a-z0-9_-]+\.[a-z]+$")


class Outputs(Files):
    """Receipts and the files that they vouch for."""

    def receipt(self, noun: str, name: str) -> Receipt | None:
        """The receipt of an output, None if there is none.

        Raises:
            CorruptFile: if the receipt is not readable.
        """
        path = self._receipt_path(noun, name)
        return read_model(path, Receipt) if path.exists() else None

    def receipts(self, noun: str) -> Iterator[Receipt]:
        """All readable receipts of a noun, in order of name; see also :meth:`unreadable_receipts`."""
        for path in sorted((self.root / noun).glob("*.receipt.json")):
            with suppress(CorruptFile):
                yield read_model(path, Receipt)

    def unreadable_receipts(self, noun: str) -> dict[str, str]:
        """Receipts that cannot be read: name of the output to what is wrong."""
        found = {}
        for path in sorted((self.root / noun).glob("*.receipt.json")):
            try:
                read_model(path, Receipt)
            except CorruptFile as error:
                found[path.name.removesuffix(".receipt.json")] = str(error)
        return found

    def holding(self, noun: str, name: str, key: str) -> Receipt | None:
        """The receipt of an output if it stands for this very work and its files are there."""
        try:
            receipt = self.receipt(noun, name)
        except CorruptFile:
            return None
        if receipt is None or receipt.key != key:
            return None
        for record in receipt.files.values():
            path = self.root / record.path
            if not path.exists() or path.stat().st_size != record.size:
                return None
        return receipt

    def commit(
        self,
        noun: str,
        name: str,
        key: str,
        *,
        inputs: Mapping[str, str],
        settings: Mapping[str, Any],
        seed: int | None = None,
        tables: Mapping[str, tuple[pl.DataFrame, type[Table]]] | None = None,
        blobs: Mapping[str, tuple[str, bytes]] | None = None,
        details: Mapping[str, Any] | None = None,
    ) -> Receipt:
        """Write an output's files, then its receipt: the commit is the receipt's rename.

        Args:
            noun: the stage.
            name: the output.
            key: from :func:`key_of`.
            inputs: label to SHA-256.
            settings: of the stage, JSON-able.
            seed: of the stage.
            tables: what a file holds, to the table and its schema.
            blobs: what a file holds, to its suffix and bytes.
            details: JSON-able facts.

        Raises:
            SchemaMismatch: if a table breaks its schema; nothing is written then.
            StorageFailed: if the disk refuses; the old output stands.
        """
        payloads: dict[str, tuple[str, bytes, str | None, int | None]] = {}
        for role, (frame, schema) in sorted((tables or {}).items()):
            data = to_parquet(frame, schema, where=f"{noun} {name}")
            payloads[role] = ("parquet", data, schema.tag(), frame.height)
        for role, (suffix, data) in sorted((blobs or {}).items()):
            payloads[role] = (suffix, data, None, None)
        files = {}
        for role, (suffix, data, table, rows) in payloads.items():
            relative = f"{noun}/{safe(name)}-{key[:12]}.{role}.{suffix}"
            self.write_bytes(self.root / relative, data)
            files[role] = FileRecord(
                path=relative, sha256=digest(data), size=len(data), table=table, rows=rows
            )
        receipt = Receipt(
            noun=noun, name=name, key=key, inputs=dict(inputs), settings=dict(settings), seed=seed,
            software=SOFTWARE, files=files, details=dict(details or {}),
        )
        self.write_bytes(self._receipt_path(noun, name), pretty(receipt))
        return receipt

    def read(self, receipt: Receipt, role: str) -> bytes:
        """A file's bytes, checked against the receipt.

        Raises:
            NotFound: if the receipt has no such file.
            CorruptFile: if it is gone or its bytes are others.
        """
        return verified(self.root, receipt.files, role, f"{receipt.noun} {receipt.name}")

    def read_table(self, receipt: Receipt, role: str, schema: type[Table]) -> pl.DataFrame:
        """A table, its bytes checked against the receipt and its tag against the schema.

        Raises:
            NotFound, CorruptFile, SchemaMismatch: as for :meth:`read` and :func:`from_parquet`.
        """
        data = self.read(receipt, role)
        return from_parquet(data, schema, where=str(self.root / receipt.files[role].path))

    def intact(self, receipt: Receipt) -> bool:
        """Whether all files of a receipt are there, byte for byte."""
        try:
            for role in receipt.files:
                self.read(receipt, role)
        except CorruptFile:
            return False
        return True

    def forget(self, noun: str, name: str) -> bool:
        """Remove an output, its receipt first; whether there was one."""
        path = self._receipt_path(noun, name)
        if not path.exists():
            return False
        with suppress(CorruptFile):
            files = read_model(path, Receipt).files.values()
            path.unlink()
            for record in files:
                (self.root / record.path).unlink(missing_ok=True)
        path.unlink(missing_ok=True)
        return True

    def prune(self, noun: str) -> list[Path]:
        """Remove the files of a noun that no receipt names any more; which."""
        if self.unreadable_receipts(noun):
            return []
        named = {self.root / record.path
                 for receipt in self.receipts(noun) for record in receipt.files.values()}
        left = [path for path in sorted((self.root / noun).glob("*"))
                if path.is_file() and KEYED_FILE.search(path.name) and path not in named]
        for path in left:
            path.unlink()
        return left

    def verify_receipts(self, noun: str) -> list[str]:
        """What is wrong with the files that a noun's receipts name, one line each."""
        problems = []
        for path in sorted((self.root / noun).glob("*.receipt.json")):
            try:
                receipt = read_model(path, Receipt)
                for role in receipt.files:
                    self.read(receipt, role)
            except PitchloreError as error:
                problems.append(str(error))
        return problems

    def _receipt_path(self, noun: str, name: str) -> Path:
        return self.root / noun / f"{safe(name)}.receipt.json"
