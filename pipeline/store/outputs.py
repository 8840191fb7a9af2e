"""Outputs of stages: content-addressed files, and the receipts that name the current ones."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from pipeline.errors import CorruptFile, NotFound
from pipeline.store.paths import listed, remove, safe
from pipeline.store.reading import Reading
from pipeline.store.receipts import Receipt, software
from pipeline.store.sealed import read_model, sealed
from pipeline.store.work import Made, Work, contents

#: How the names of receipts end.
RECEIPT = ".receipt.json"
CONTENT_FILE = re.compile(r"-[0-9a-f]{12}\.(?!receipt\.)[a-z0-9_-]+\.[a-z]+$")


class Outputs(Reading):
    """Receipts and the files that they vouch for.

    Attributes:
        doubted: files that the last look at the folder found damaged or lost (:func:`flows.catalog.look`).
    """

    doubted: frozenset[Path] = frozenset()

    def receipt(self, noun: str, name: str) -> Receipt | None:
        """The receipt of an output, None if there is none.

        Raises:
            CorruptFile: if the receipt is not readable.
        """
        return read_model(self._receipt_path(noun, name), Receipt)

    def receipts(self, noun: str) -> Iterator[Receipt]:
        """All readable receipts of a noun, sorted by name; see also :meth:`unreadable_receipts`."""
        for path in listed(self.root / noun, RECEIPT):
            with suppress(CorruptFile):
                receipt = read_model(path, Receipt)
                if receipt is not None:
                    yield receipt

    def unreadable_receipts(self, noun: str) -> dict[str, str]:
        """Problems of unreadable receipts, by name of the output."""
        found = {}
        for path in listed(self.root / noun, RECEIPT):
            try:
                read_model(path, Receipt)
            except CorruptFile as error:
                found[Path(path).name.removesuffix(RECEIPT)] = str(error)
        return found

    def holding(self, work: Work) -> Receipt | None:
        """The receipt of an output, if it is of exactly this work and its files exist, none doubted."""
        receipt = self.readable(work.noun, work.name)
        if receipt is None or receipt.key != work.key:
            return None
        for record in receipt.files.values():
            try:
                size = os.stat(f"{self.root}/{record.path}").st_size  # noqa: PTH116 (see sealed.read_model)
            except OSError:
                return None
            if size != record.size or (self.doubted and self.root / record.path in self.doubted):
                return None
        return receipt

    def commit(self, work: Work, made: Made, sources: Iterable[Receipt] = ()) -> Receipt:
        """Write an output's files, then its receipt: the commit is the receipt's rename.

        A file is named by the SHA-256 of its bytes. A whole file is not written again: if work is done again
        with the same outcome, no file changes and no later stage runs. A receipt of the same work and
        outcome stays as it is, with the software that made it first.

        Args:
            work: that made it.
            made: its tables and other files.
            sources: the receipts of outputs that it was made from.

        Raises:
            SchemaMismatch: if a table breaks its schema; nothing is written then.
            StorageFailed: if the disk refuses; the old output stands.
            NotFound: if a source has been removed meanwhile; nothing is written then.
        """
        name = safe(work.name)
        written = contents(made, where=f"{work.noun} {name}")
        files = {role: record.model_copy(
            update={"path": f"{work.noun}/{name}-{record.sha256[:12]}.{record.path}"})
            for role, (record, _) in written.items()}
        receipt = Receipt(
            noun=work.noun, name=name, key=work.key, inputs=dict(work.inputs), settings=dict(work.settings),
            seed=work.seed, versions=work.versions, software=software(), files=files,
            details=dict(made.details),
        )
        with self.committing():
            for source in sources:
                if not Path(self._receipt_path(source.noun, source.name)).exists():
                    raise NotFound(f"{source.noun} {source.name} has been removed meanwhile",
                                   where=f"{work.noun} {name}", next_step="Run again")
            for role, (_, data) in written.items():
                if not self.whole(files[role], self.root):
                    self.write_bytes(self.root / files[role].path, data)
            before = self.readable(work.noun, name)
            if before is not None and before.model_copy(update={"software": receipt.software}) == receipt:
                return before
            self.write_bytes(Path(self._receipt_path(work.noun, name)), sealed(receipt))
        return receipt

    def mend(self, receipt: Receipt, made: Made) -> None:
        """Write the files of an output that are not whole, as far as an outcome has the same bytes."""
        for role, (record, data) in contents(made, where=f"{receipt.noun} {receipt.name}").items():
            held = receipt.files.get(role)
            if held is not None and held.sha256 == record.sha256 and not self.whole(held, self.root):
                self.write_bytes(self.root / held.path, data)

    def readable(self, noun: str, name: str) -> Receipt | None:
        """The receipt of an output, None if there is none that can be read."""
        with suppress(CorruptFile):
            return self.receipt(noun, name)
        return None

    def forget(self, noun: str, name: str) -> bool:
        """Remove an output, its receipt first. Returns whether it existed.

        Call it while :meth:`removing`, unless nobody else uses the folder.
        """
        path = Path(self._receipt_path(noun, name))
        if not path.exists():
            return False
        receipt = self.readable(noun, name)
        remove(path)
        for record in receipt.files.values() if receipt else ():
            remove(self.root / record.path)
        return True

    def prune(self, noun: str) -> list[Path]:
        """Remove the files of a noun that no receipt names any more. Returns their paths."""
        with self.removing():
            if self.unreadable_receipts(noun):
                return []
            named = {self.root / record.path
                     for receipt in self.receipts(noun) for record in receipt.files.values()}
            left = [path for path in map(Path, listed(self.root / noun))
                    if path.is_file() and CONTENT_FILE.search(path.name) and path not in named]
            for path in left:
                remove(path)
            return left

    def _receipt_path(self, noun: str, name: str) -> str:
        return f"{self.root}/{noun}/{safe(name)}{RECEIPT}"
