"""Closed parts: the rows of many matches in one file a table, so that a question opens few files.

A part is a cache. It joins the tables of matches that are complete, beside their own files. Questions read
it, and so do stages that read many matches. It names the files that it was joined from, and stands as long as
these are the ones that receipts name. If one of its matches is removed or made anew, the part is dropped, and
its other matches are joined anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

import polars as pl
import pyarrow.parquet

from pitchlore.pipeline.base.digests import canonical, digest, digest_of_file
from pitchlore.pipeline.base.errors import CorruptFile
from pitchlore.pipeline.base.system import cores, whole
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.store.meter import count_read, count_written
from pitchlore.pipeline.store.paths import listed
from pitchlore.pipeline.store.reading import Reading
from pitchlore.pipeline.store.receipts import FileRecord, Receipt
from pitchlore.pipeline.store.sealed import read_model, sealed
from pitchlore.pipeline.store.tables import SCHEMA_KEY, from_parquet, written_as
from pitchlore.pipeline.store.temporaries import sweep
from pitchlore.schemas import PUBLIC, Choices, Sequences, Table

#: Matches of a part. A question opens a file for each part, and one for each match that is in none.
MATCHES = 256
#: Tables that are joined: public ones, and those that stages read of all matches.
JOINED: Mapping[str, type[Table]] = PUBLIC | {table.NAME: table for table in (Sequences, Choices)}
#: The folder of parts, in a data folder.
FOLDER = "closed"
#: How the names of their indexes end.
INDEX = ".part.json"


class Source(NamedTuple):
    """A file with rows of one match.

    Attributes:
        table: the table.
        noun: the stage that made it.
        match: the match.
        path, sha256, size: as of :class:`pipeline.store.receipts.FileRecord`.
    """

    table: str
    noun: str
    match: str
    path: str
    sha256: str
    size: int

    @classmethod
    def of(cls, receipt: Receipt, table: str) -> Source:
        """The file of a table that a receipt names."""
        record = receipt.files[table]
        return cls(table, receipt.noun, receipt.name, record.path, record.sha256, record.size)

    @property
    def receipt(self) -> Receipt:
        """A receipt that says no more than the file."""
        record = FileRecord(path=self.path, sha256=self.sha256, size=self.size)
        return Receipt(noun=self.noun, name=self.match, key="", inputs={}, settings={}, versions={},
                       software="", files={self.table: record})


class ClosedPart(Frozen):
    """Index of a closed part.

    Attributes:
        matches: ids of its matches, sorted.
        members: digest of the names of the files that it was joined from (:func:`members_of`).
        files: the joined files, by table.
    """

    matches: tuple[str, ...]
    members: str
    files: dict[str, FileRecord]

    @property
    def name(self) -> str:
        """Its name, which no other part has."""
        return digest(canonical([self.matches, self.members]))[:12]

    @property
    def index(self) -> str:
        """Path of its index in the data folder."""
        return f"{FOLDER}/{self.name}{INDEX}"


def members_of(sources: Sequence[Source]) -> str:
    """Digest of the names of files, and of the version that their tables are joined in."""
    tags = {name: schema.tag() for name, schema in JOINED.items()}
    return digest(canonical([
        [tags[source.table], source.path, source.sha256] for source in sources]))[:16]


def closed_parts(store: Reading) -> Iterator[ClosedPart]:
    """The parts of a data folder with a readable index; damaged ones are removed where that can be."""
    for path in listed(store.root / FOLDER, INDEX):
        with suppress(CorruptFile):
            part = read_model(path, ClosedPart)
            if part is not None and store.root / part.index == Path(path):
                yield part
                continue
        if not store.closed:
            store.drop(Path(path))


def is_current(part: ClosedPart, sources: Mapping[str, Sequence[Source]]) -> bool:
    """True if a part is joined from the files that its matches have now. Its own files are not looked at."""
    if not all(match in sources for match in part.matches):
        return False
    return part.members == members_of([each for match in part.matches for each in sources[match]])


def join_matches(store: Reading, sources: Mapping[str, Sequence[Source]]) -> ClosedPart:
    """Join the tables of some matches, and write the index last.

    Args:
        store: the data folder.
        sources: the files with rows of each match, by its id.

    Raises:
        CorruptFile: if a file is damaged.
        StorageFailed: if the disk refuses.
    """
    matches = tuple(sorted(sources))
    every = [each for match in matches for each in sources[match]]
    tables = sorted({each.table for each in every})
    of_table = [[each for each in every if each.table == table] for table in tables]
    with ThreadPoolExecutor(cores()) as pool:  # compressing releases the GIL
        files = dict(zip(tables, pool.map(
            partial(_joined, store), (JOINED[table] for table in tables), of_table), strict=True))
    part = ClosedPart(matches=matches, members=members_of(every), files=files)
    store.write_bytes(store.root / part.index, sealed(part))
    return part


def read_joined(
    store: Reading, receipts: Iterable[Receipt], schema: type[Table]
) -> Iterator[pl.DataFrame]:
    """The tables of the outputs that have one, many joined in each, at least one; from parts, if they stand.

    The matches come in any order, the rows of a match together. A part's file stands for the files that it
    was joined from, as receipts name them. If it is damaged or being dropped, these are read.

    Args:
        store: the data folder.
        receipts: the outputs of some matches, of one noun.
        schema: the table.

    Raises:
        NotFound, CorruptFile, SchemaMismatch: as for :meth:`pipeline.store.Store.read_table`.
    """
    left = {receipt.name: receipt for receipt in receipts if schema.NAME in receipt.files}
    for part in closed_parts(store) if schema.NAME in JOINED and len(left) > 1 and not store.mirror else ():
        own = [Source.of(left[match], schema.NAME) for match in part.matches
               if match in left and left[match].files[schema.NAME].rows]
        record = part.files.get(schema.NAME)
        if record is not None and record.path == _path(schema, own):
            with suppress(OSError):
                data = whole(store.root / record.path)
                count_read(len(data))
                if digest(data) == record.sha256:
                    left = {name: left[name] for name in left.keys() - {each.match for each in own}}
                    yield from_parquet(data, schema, where=record.path)
    yield from store.batches((left[name] for name in sorted(left)), schema.NAME, schema)


def remove_unnamed(store: Reading, standing: Iterable[ClosedPart]) -> None:
    """Remove the files of parts that somebody was closing when he was killed."""
    sweep(store.root / FOLDER)
    named = {record.path for part in standing for record in part.files.values()}
    for path in listed(store.root / FOLDER, ".parquet"):
        if not path.rpartition("/")[2].startswith(".") and f"{FOLDER}/{path.rpartition('/')[2]}" not in named:
            store.drop(Path(path))


def drop_part(store: Reading, part: ClosedPart) -> None:
    """Remove a part, its index first. Its matches' own files are not touched."""
    store.drop(store.root / part.index)
    for record in part.files.values():
        store.drop(store.root / record.path)


def _path(schema: type[Table], sources: Sequence[Source]) -> str:
    """Path of the joined file of a table, which no other files have."""
    return f"{FOLDER}/{schema.NAME}-{members_of(sources)[:12]}.parquet"


def _joined(store: Reading, schema: type[Table], sources: Sequence[Source]) -> FileRecord:
    """Write the rows of some files as one file, a piece at a time."""
    path, rows = _path(schema, sources), 0
    with store.aside(store.root / path) as temporary:
        writer: pyarrow.parquet.ParquetWriter | None = None
        for frame in store.batches((source.receipt for source in sources), schema.NAME, schema):
            table = frame.to_arrow().replace_schema_metadata({SCHEMA_KEY: schema.tag()})
            if writer is None:
                writer = pyarrow.parquet.ParquetWriter(
                    temporary.absolute(), table.schema, **written_as(frame.schema))
            writer.write_table(table)
            rows += frame.height
        assert writer is not None
        writer.close()
        size, sha256 = temporary.stat().st_size, digest_of_file(temporary)
    count_written(size)
    return FileRecord(path=path, sha256=sha256, size=size, table=schema.tag(), rows=rows)
