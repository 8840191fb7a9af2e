"""Reading of the files that receipts and manifests name, for outputs and versions alike."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from stat import S_ISREG
from typing import TypeVar

import polars as pl
from pydantic import BaseModel

from pitchlore.pipeline.base.digests import digest, digest_of_file
from pitchlore.pipeline.base.errors import CorruptFile, NotFound, StorageFailed, not_readable
from pitchlore.pipeline.base.system import whole
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.meter import count_read
from pitchlore.pipeline.store.receipts import FileRecord, Manifest, Receipt
from pitchlore.pipeline.store.sealed import REMEDY_OF_VERSION, read_model, remedy_of
from pitchlore.pipeline.store.tables import from_parquet, in_pieces, joined
from pitchlore.schemas import Table

M = TypeVar("M", bound=BaseModel)
#: Bytes of files that are read together: this bounds memory.
_TOGETHER = 8 << 20


def remedy_for(receipt: Receipt) -> str:
    """Advice on a damaged file that a receipt or manifest names."""
    return REMEDY_OF_VERSION if isinstance(receipt, Manifest) else remedy_of(receipt.noun)


class Reading(Files):
    """A folder whose files are checked against their receipt or manifest when they are read.

    Attributes:
        leave_out: receives the error of each damaged file that an answer goes on without; None: it is raised.
    """

    leave_out: Callable[[CorruptFile], None] | None = None

    def go_on_without(self, error: CorruptFile) -> None:
        """Leave a damaged file out of an answer, or raise its error: no answer is smaller without a word."""
        if self.leave_out is None:
            raise error
        self.leave_out(error)

    def record(self, path: str, model: type[M]) -> M | None:
        """A receipt or manifest, read by :func:`pipeline.store.sealed.read_model`.

        One that is damaged in the copy of a bucket is brought anew.
        """
        try:
            return read_model(path, model)
        except CorruptFile:
            if self.mirror is None:
                raise
            with suppress(NotFound, CorruptFile, StorageFailed):
                self.mirror.fetch(Path(path))
            return read_model(path, model)

    def version_folder(self, noun: str, version: int) -> Path:
        """The folder of a version's files."""
        return self.root / noun / f"v{version:04d}"

    def folder(self, receipt: Receipt) -> Path:
        """The folder that the paths of a receipt or manifest are relative to."""
        if isinstance(receipt, Manifest):
            return self.version_folder(receipt.noun, receipt.version)
        return self.root

    def remedy(self, receipt: Receipt) -> str:
        """Advice on a file that is not as a receipt or manifest says."""
        return remedy_for(receipt)

    def read(self, receipt: Receipt, role: str, *, anew: bool = False) -> bytes:
        """Bytes of a file, checked against its receipt or manifest.

        Args:
            receipt: the receipt or manifest.
            role: role of the file.
            anew: read it from the bucket, if the folder is in one, whatever the copy has.

        Raises:
            NotFound: if the receipt has no such file.
            CorruptFile: if it is gone or its bytes are others.
            StorageFailed: if the system refuses to read it, or if it is in a bucket that cannot be reached.
        """
        what = f"{receipt.noun} {receipt.name}"
        if isinstance(receipt, Manifest):
            what = f"{receipt.noun} version {receipt.version}"
        if role not in receipt.files:
            raise NotFound(f"{what} has no {role} (there are: {', '.join(sorted(receipt.files))})",
                           next_step="Run the stages again")
        path, wanted = self.folder(receipt) / receipt.files[role].path, receipt.files[role].sha256
        if self.mirror is not None:
            data = self.mirror.bytes_of(path, wanted, remedy_for(receipt), anew=anew)
            count_read(len(data))
            return data
        try:
            data = whole(path)
        except OSError as error:
            raise not_readable(path, error, self.remedy(receipt)) from error
        if digest(data) != wanted:
            raise CorruptFile("is not what was written (SHA-256 differs)", where=str(path),
                              next_step=self.remedy(receipt))
        count_read(len(data))
        return data

    def read_table(self, receipt: Receipt, role: str, schema: type[Table]) -> pl.DataFrame:
        """A table, its bytes checked against the receipt or manifest and its tag against the schema.

        Raises:
            NotFound, CorruptFile, SchemaMismatch: as for :meth:`read` and :func:`from_parquet`.
        """
        data = self.read(receipt, role)
        return from_parquet(data, schema, where=str(self.folder(receipt) / receipt.files[role].path))

    def read_pieces(self, receipt: Receipt, role: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """A large table, a million rows at a time; errors as for :meth:`read_table`."""
        data = self.read(receipt, role)
        return in_pieces(data, schema, where=str(self.folder(receipt) / receipt.files[role].path))

    def read_tables(self, receipts: Sequence[Receipt], role: str, schema: type[Table]) -> pl.DataFrame:
        """The tables of some outputs, joined in their order; several times faster than one by one.

        Raises:
            NotFound, CorruptFile, SchemaMismatch: as for :meth:`read_table`.
        """
        self.bring(receipts, [role])
        data = [self.read(receipt, role) for receipt in receipts]
        where = [str(self.folder(receipt) / receipt.files[role].path) for receipt in receipts]
        return joined(data, schema, where=where)

    def batches(self, receipts: Iterable[Receipt], role: str, schema: type[Table]) -> Iterator[pl.DataFrame]:
        """The tables of the outputs that have one, many joined in each, at least one; errors as above."""
        batch, size = list[Receipt](), 0
        for receipt in receipts:
            if role in receipt.files:
                batch.append(receipt)
                size += receipt.files[role].size
            if size > _TOGETHER:
                yield self.read_tables(batch, role, schema)
                batch, size = [], 0
        yield self.read_tables(batch, role, schema)

    def bring(self, receipts: Iterable[Receipt], roles: Collection[str]) -> None:
        """Bring files that the copy of a bucket lacks, many at a time; what is damaged is left.

        Raises:
            StorageFailed: if the bucket cannot be reached.
        """
        if self.mirror is not None:
            self.mirror.fetch_all(
                (self.folder(receipt) / record.path, record.sha256)
                for receipt in receipts for role, record in receipt.files.items() if role in roles)

    def intact(self, receipt: Receipt) -> bool:
        """True if all files of a receipt or manifest are there, byte for byte."""
        return all(self.whole(record, self.folder(receipt)) for record in receipt.files.values())

    def whole(self, record: FileRecord, folder: Path) -> bool:
        """True if a file in a folder is there, byte for byte; in a bucket, by its size.

        Raises:
            ReadFailed: if the system refuses to read it.
        """
        path = folder / record.path
        if self.mirror is not None:
            return self.mirror.size(path, record.sha256) == record.size
        try:
            found = path.stat()
            return (S_ISREG(found.st_mode) and found.st_size == record.size
                    and digest_of_file(path) == record.sha256)
        except OSError as error:
            if isinstance(refused := not_readable(path, error, ""), CorruptFile):
                return False
            raise refused from error
