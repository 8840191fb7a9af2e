"""The catalogue: one DuckDB file of views over the tables' files."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

import duckdb
import polars as pl

from pitchlore.pipeline.base.errors import CorruptFile
from pitchlore.schemas import PUBLIC, Table

#: Size and time of change [ns] of a file, None if it does not exist.
Glance = tuple[int, int] | None


class Listed(NamedTuple):
    """A file of a catalogue.

    Attributes:
        table: the table whose view reads it, "" for none; of a receipt or its like :data:`RECORD`.
        seen: the :func:`glance` at it when the catalogue was made.
        part: the closed part that it belongs to (:mod:`pipeline.store.parts`), "" for none.
    """

    table: str
    seen: Glance
    part: str = ""


#: The files of a catalogue, by absolute path.
Listing = dict[str, Listed]
#: The table of receipts, manifests and records of quarantine, which a catalogue is made by.
RECORD = "."

FILES = "catalog_files"
#: The oldest DuckDB for which the file is written: all later ones read it, and that of 2.0 shuts out 1.x.
FORMAT = "v1.0.0"
#: The tags of the tables that the views were made for.
TAGS = "catalog_tags"
_COLUMNS = "path varchar, table_name varchar, size bigint, changed_ns bigint, part varchar"
_LISTED = {
    "path": pl.String, "table_name": pl.String, "size": pl.Int64, "changed_ns": pl.Int64, "part": pl.String}
_NOTHING = dict[str, str]()
#: The process's own instance of DuckDB, if there is one: to make one takes as long as to attach ten files.
_INSTANCE = list[duckdb.DuckDBPyConnection]()
_ONE_AT_A_TIME = Lock()


def build(path: Path, files: Listing, of_groups: Collection[str] = ()) -> None:
    """Make a catalogue with a view for every public table; one without files becomes a view without rows.

    Args:
        path: a file that does not exist yet; the caller moves it into place.
        files: the files that receipts and manifests name, these themselves, and those of closed parts.
        of_groups: tables whose files have rows of many matches; those of matches that are not in the table
            matches are left out.

    Raises:
        OSError: if the disk refuses.
        CorruptFile: if a file is none that DuckDB can read.
    """
    try:
        _build(path, files, of_groups)
    except (duckdb.InvalidInputException, duckdb.BinderException, duckdb.ConversionException) as error:
        raise CorruptFile(f"a table cannot be read ({str(error).splitlines()[0]})", where=str(path.parent),
                          next_step="Look for the damage: `pitchlore verify`") from error
    except (duckdb.IOException, duckdb.TransactionException, duckdb.FatalException) as error:
        raise OSError(errno.EIO, str(error).splitlines()[0].rpartition(": ")[2]) from error
    finally:
        path.with_name(f"{path.name}.wal").unlink(missing_ok=True)


def _build(path: Path, files: Listing, of_groups: Collection[str]) -> None:
    sources: dict[str, list[str]] = {}
    for file, listed in files.items():
        sources.setdefault(listed.table, []).append(file)
    with _attached(path, f"storage_version '{FORMAT}'") as connection:
        connection.execute("pragma disable_optimizer")  # it takes longer than these small statements
        tags = ", ".join(f"({quote(schema.tag())})" for schema in PUBLIC.values())
        statements = [
            f"create table {FILES} ({_COLUMNS})",
            f"create table {TAGS} (tag varchar)",
            f"insert into {TAGS} values {tags}",
        ]
        for name, schema in sorted(PUBLIC.items(), key=lambda item: item[0] in of_groups):
            rows = _select(connection, schema, sources.get(name, ()))
            if name in of_groups:
                rows = f"from ({rows}) where match_id in (select match_id from matches)"
            statements += [
                f"create view {name} as {rows}",
                f"comment on view {name} is {quote(str(schema.__doc__).splitlines()[0])}",
                *(f'comment on column {name}."{column}" is {quote(meaning)}'
                  for column, meaning in schema.meanings().items())]
        connection.begin()  # one write for all statements
        connection.execute(";\n".join(statements))
        listing = [(file, each.table, *(each.seen or (None, None)), each.part)
                   for file, each in files.items()]
        listed = pl.DataFrame(listing, schema=_LISTED, orient="row").to_arrow()
        connection.from_arrow(listed).insert_into(FILES)
        connection.commit()
        connection.execute("checkpoint")  # what closing would do without a word, if the disk is full


@contextmanager
def _attached(path: Path, how: str) -> Iterator[duckdb.DuckDBPyConnection]:
    """A connection to a database's file as it is on disk now, closed after the body."""
    with _ONE_AT_A_TIME:
        if not _INSTANCE:
            settings: Any = {"threads": 1, "enable_external_file_cache": False}
            _INSTANCE.append(duckdb.connect(":memory:", config=settings))
        try:
            with _INSTANCE[0].cursor() as connection:
                connection.execute(f"attach {quote(str(path.absolute()))} as catalog ({how})")
                connection.execute("use catalog")
                yield connection
                connection.execute("use memory")
                connection.execute("detach catalog")
        except BaseException:
            _INSTANCE.pop().close()  # an error may have made it useless
            raise


def glance(file: Path | str) -> Glance:
    """Size and time of change [ns] of a file, None if it does not exist."""
    try:
        found = os.stat(file)  # noqa: PTH116 (a path object takes longer to make than the call)
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns


def listing(path: Path, *, open_only: bool = False) -> Listing | None:
    """The files of a catalogue.

    Args:
        path: the catalogue.
        open_only: without the files of the matches in closed parts.

    Returns:
        None if there is no readable catalogue, or if it was made for other tables or other versions of them.
    """
    if not path.exists():
        return None
    wanted = f"where part = '' or table_name not in ('', '{RECORD}')" if open_only else ""
    try:
        with _attached(path, "read_only") as connection:
            tags = connection.execute(f"select tag from {TAGS}").fetchall()
            rows = connection.execute(
                f"select path, table_name, size, changed_ns, part from {FILES} {wanted}").fetchall()
    except duckdb.Error:
        return None
    if {tag for (tag,) in tags} != {schema.tag() for schema in PUBLIC.values()}:
        return None
    return {file: Listed(table, None if size is None else (size, changed), part)
            for file, table, size, changed, part in rows}


def connected(path: Path) -> duckdb.DuckDBPyConnection:
    """A connection to the catalogue as it is on disk now.

    It is attached, not connected to. If the process has already connected to a path, DuckDB gives it the
    old database, even after the file was replaced.
    """
    connection = duckdb.connect(":memory:")
    connection.execute(f"attach {quote(str(path.absolute()))} as catalog (read_only)")
    connection.execute("use catalog")
    return connection


def _select(connection: duckdb.DuckDBPyConnection, schema: type[Table], files: Sequence[str]) -> str:
    columns = ", ".join(
        f'"{name}"::varchar as "{name}"' if isinstance(dtype, pl.Enum) else f'"{name}"'
        for name, dtype in schema.dtypes().items()
    )
    listed = ", ".join(quote(pattern(file)) for file in files)
    if files and len(schema.readable()) == 1:
        return f"select {columns} from read_parquet([{listed}])"
    nothing = _nothing(connection, schema)
    if not files:
        return nothing
    # files of earlier versions lack columns
    every = f"from read_parquet([{listed}], union_by_name = true) union all by name {nothing}"
    return f"select {columns} from ({every})"


def _nothing(connection: duckdb.DuckDBPyConnection, schema: type[Table]) -> str:
    """No rows of a table; the types do not change while the process lives."""
    if schema.tag() not in _NOTHING:
        # DuckDB itself says how it names the types that it reads from our Parquet, of all tables at once
        empty = pl.concat([
            every.empty().with_columns(pl.selectors.enum().cast(pl.String)).rename(f"{name}.{{}}".format)
            for name, every in PUBLIC.items()], how="horizontal")
        rows: Any = connection.from_arrow(empty.to_arrow())
        types = dict(zip(rows.columns, rows.types, strict=True))
        for name, every in PUBLIC.items():
            nulls = (f'null::{types[f"{name}.{column}"]} as "{column}"' for column in every.columns())
            _NOTHING[every.tag()] = f"select {', '.join(nulls)} where false"
    return _NOTHING[schema.tag()]


def pattern(path: str) -> str:
    """A path as DuckDB's readers take it, who read ``*``, ``?`` and ``[`` in it as wildcards."""
    return re.sub(r"[*?[]", r"[\g<0>]", path)


def quote(text: str) -> str:
    """A text as SQL writes it."""
    return "'" + text.replace("'", "''") + "'"
