"""The catalogue: one DuckDB file of views over the tables' files.

Its paths begin in the data folder, wherever that is: a folder is moved, copied and packed with its catalogue.
Where nothing can be written, the catalogue is made in memory, for each connection anew.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from threading import Lock
from typing import Any, NamedTuple

import duckdb
import polars as pl

from pitchlore.pipeline.base.errors import CorruptFile, not_readable, unwritable
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


#: The files of a catalogue, by absolute path; in the file itself they begin in the data folder.
Listing = dict[str, Listed]
#: The table of receipts, manifests and records of quarantine, which a catalogue is made by.
RECORD = "."

FILES = "catalog_files"
#: The variable of a connection that says where the data folder is.
VARIABLE = "pitchlore_data"
_SAY = f"(say first where the data folder is: set variable {VARIABLE} = '/home/you/data')"
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
#: The catalogues in memory: files, and tables of groups, by the path at which there is no file.
_IN_MEMORY: dict[Path, tuple[Listing, Collection[str]]] = {}
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
        CorruptFile, ReadFailed: if a file is none that DuckDB can read; if the system refuses to read one.
    """
    try:
        with _attached(path, f"storage_version '{FORMAT}'") as connection:
            _fill(connection, path.parent, files, of_groups)
            connection.execute("checkpoint")  # what closing would do without a word, if the disk is full
    except (duckdb.IOException, duckdb.TransactionException, duckdb.FatalException) as error:
        check_open(files)  # a mode that changed shows at no glance
        raise OSError(errno.EIO, str(error).splitlines()[0].rpartition(": ")[2]) from error
    finally:
        log_of(path).unlink(missing_ok=True)


def check_open(files: Iterable[str]) -> None:
    """Check that files can be opened.

    Raises:
        CorruptFile, ReadFailed: if one cannot; names the first.
    """
    for file in sorted(files, key=lambda file: not Path(file).exists()):  # a copy lacks what nobody asked for
        try:
            Path(file).open("rb").close()
        except OSError as refused:
            raise not_readable(file, refused, "Call the command again") from refused


def keep_in_memory(path: Path, files: Listing | None, of_groups: Collection[str] = ()) -> None:
    """Take a catalogue in memory for the one of a path, as :func:`build` would make it; no files: no more."""
    _IN_MEMORY.pop(path, None)
    if files is not None:
        _IN_MEMORY[path] = files, of_groups


def _fill(
    connection: duckdb.DuckDBPyConnection, folder: Path, files: Listing, of_groups: Collection[str]
) -> None:
    """Make the views and tables of a catalogue, by files in a data folder."""
    root = f"{folder.resolve()}/"
    sources: dict[str, list[str]] = {}
    for file, listed in files.items():
        sources.setdefault(listed.table, []).append(file.removeprefix(root))
    connection.execute("pragma disable_optimizer")  # it takes longer than these small statements
    tags = ", ".join(f"({quote(schema.tag())})" for schema in PUBLIC.values())
    statements = [f"create table {FILES} ({_COLUMNS})", f"create table {TAGS} (tag varchar)",
                  f"insert into {TAGS} values {tags}"]
    # a view is bound when it is made: what others look into comes first
    for name, schema in sorted(PUBLIC.items(), key=lambda item: (bool(item[1].VIEW), item[0] in of_groups)):
        rows = schema.VIEW or _select(connection, schema, sources.get(name, ()))
        if name in of_groups:
            rows = f"from ({rows}) where match_id in (select match_id from matches)"
        statements += [
            f"create view {name} as {rows}",
            f"comment on view {name} is {quote(str(schema.__doc__).splitlines()[0])}",
            *(f'comment on column {name}."{column}" is {quote(meaning)}'
              for column, meaning in schema.meanings().items())]
    connection.begin()  # one write for all statements
    try:
        connection.execute(";\n".join(statements))
    except (duckdb.InvalidInputException, duckdb.BinderException, duckdb.ConversionException) as error:
        raise CorruptFile(f"a table cannot be read ({str(error).splitlines()[0]})", where=str(folder),
                          next_step="Look for the damage: `pitchlore verify`") from error
    listing = [(file.removeprefix(root), each.table, *(each.seen or (None, None)), each.part)
               for file, each in files.items()]
    listed = pl.DataFrame(listing, schema=_LISTED, orient="row").to_arrow()
    connection.from_arrow(listed).insert_into(FILES)
    connection.commit()
    connection.execute("pragma enable_optimizer")


@contextmanager
def _attached(path: Path, how: str) -> Iterator[duckdb.DuckDBPyConnection]:
    """A connection to a database's file as it is on disk now, closed after the body."""
    with _ONE_AT_A_TIME:
        if not _INSTANCE:
            settings: Any = {"threads": 1, "enable_external_file_cache": False}
            _INSTANCE.append(duckdb.connect(":memory:", config=settings))
        try:
            with _INSTANCE[0].cursor() as connection:
                _attach(connection, path, how)
                _enter(connection, path)
                yield connection
                connection.execute("use memory")
                connection.execute("detach catalog")
        except BaseException:
            _INSTANCE.pop().close()  # an error may have made it useless
            raise


def _attach(connection: duckdb.DuckDBPyConnection, path: Path, how: str) -> None:
    """Attach a database's file; a copy of it where this process has connected to the file to write."""
    try:
        connection.execute(f"attach {quote(str(path.absolute()))} as catalog ({how})")
    except duckdb.ResourceInUseException:
        try:
            with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
                copy = shutil.copy(path, folder)
                connection.execute(f"attach {quote(copy)} as catalog ({how})")
        except OSError as error:
            raise unwritable(Path(gettempdir()), error) from error


def _enter(connection: duckdb.DuckDBPyConnection, path: Path) -> None:
    connection.execute(f"set variable {VARIABLE} = {quote(pattern(str(path.parent.resolve())))}")
    connection.execute("use catalog")


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
        None if there is no readable catalogue, if another program has written to it, or if it was made for
        other tables or other versions of them.
    """
    if path in _IN_MEMORY:
        files = _IN_MEMORY[path][0]
        return {file: each for file, each in files.items()
                if not (open_only and each.part and each.table in ("", RECORD))}
    if not path.exists() or log_of(path).exists():
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
    root = str(path.parent.resolve())
    return {file if file[:1] == "/" else f"{root}/{file}":  # earlier versions wrote absolute paths
            Listed(table, None if size is None else (size, changed), part)
            for file, table, size, changed, part in rows}


def connected(path: Path) -> duckdb.DuckDBPyConnection:
    """A connection to the catalogue as it is on disk now.

    It is attached, not connected to. If the process has already connected to a path, DuckDB gives it the
    old database, even after the file was replaced.
    """
    connection = duckdb.connect(":memory:")
    made = _IN_MEMORY.get(path)
    if made:
        connection.execute("attach ':memory:' as catalog")
    else:
        _attach(connection, path, "read_only")
    _enter(connection, path)
    if made:
        _fill(connection, path.parent, *made)
    return connection


def log_of(path: Path) -> Path:
    """Path of the log of what a program wrote to a catalogue: DuckDB applies it to any file of that name."""
    return path.with_name(f"{path.name}.wal")


def is_there(path: Path) -> bool:
    """True if there is a catalogue for a path, in a file or in memory."""
    return path in _IN_MEMORY or path.exists()


def _select(connection: duckdb.DuckDBPyConnection, schema: type[Table], files: Sequence[str]) -> str:
    columns = ", ".join(
        f'coalesce("{name}", {quote(str(schema.FORMER[name]))}) as "{name}"' if name in schema.FORMER
        else f'"{name}"::varchar as "{name}"' if isinstance(dtype, pl.Enum) else f'"{name}"'
        for name, dtype in schema.dtypes().items()
    )
    inside = ", ".join(quote(pattern(file)) for file in files)
    where = f"coalesce(getvariable({quote(VARIABLE)}), {quote(_SAY)})"
    listed = f"list_transform([{inside}], lambda file: concat_ws('/', {where}, file))"
    if files and len(schema.readable()) == 1:
        return f"select {columns} from read_parquet({listed})"
    nothing = _nothing(connection, schema)
    if not files:
        return nothing
    # files of earlier versions lack columns
    every = f"from read_parquet({listed}, union_by_name = true) union all by name {nothing}"
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
