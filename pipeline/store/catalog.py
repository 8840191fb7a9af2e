"""The catalogue: one DuckDB file of views over the tables' files, and safe queries on it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import duckdb
import polars as pl

from pipeline.errors import BadQuery, NotFound
from schemas import PUBLIC, Table

T = TypeVar("T")

FILES = "catalog_files"
#: The tags of the tables that the views were made for.
TAGS = "catalog_tags"

#: DuckDB's types that have no equal in a polars table: it refuses them, or loses what they mean.
_WITHOUT_EQUAL = frozenset(
    ("interval", "union", "variant", "geometry", "bignum", "bit", "time with time zone")
)
_NESTED = frozenset(("list", "array", "struct", "map"))


def build(path: Path, sources: Mapping[str, Sequence[Path]]) -> None:
    """Make a catalogue with a view for every public table.

    Args:
        path: a file that does not exist yet; the caller moves it into place.
        sources: table name to the files that hold its rows, by the receipts and manifests. A table
            without files becomes a view without rows.
    """
    with duckdb.connect(str(path)) as connection:
        connection.begin()  # one write for all statements
        connection.execute(
            f"create table {FILES} (table_name varchar, path varchar, size bigint, changed_ns bigint)"
        )
        connection.execute(f"create table {TAGS} (tag varchar)")
        for name, schema in PUBLIC.items():
            connection.execute(f"insert into {TAGS} values (?)", [schema.tag()])
            files = [str(file.resolve()) for file in sources.get(name, ())]
            for file in files:
                connection.execute(f"insert into {FILES} values (?, ?, ?, ?)",
                                   [name, file, *(glance(Path(file)) or (None, None))])
            connection.execute(f"create view {name} as {_select(connection, schema, files)}")
            connection.execute(f"comment on view {name} is {_quote(str(schema.__doc__).splitlines()[0])}")
            for column, meaning in schema.meanings().items():
                connection.execute(f'comment on column {name}."{column}" is {_quote(meaning)}')
        connection.commit()


def glance(file: Path) -> tuple[int, int] | None:
    """Size and time of change [ns] of a file, None if it does not exist."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns


def listing(path: Path) -> dict[tuple[str, str], tuple[int, int] | None] | None:
    """The files of a catalogue: table and path to the :func:`glance` at its making.

    None if there is no readable catalogue, or if it was made for other tables or other versions of them.
    """
    if not path.exists():
        return None
    try:
        with _opened(path) as connection:
            tags = connection.execute(f"select tag from {TAGS}").fetchall()
            rows = connection.execute(f"select table_name, path, size, changed_ns from {FILES}").fetchall()
    except duckdb.Error:
        return None
    if {tag for (tag,) in tags} != {schema.tag() for schema in PUBLIC.values()}:
        return None
    return {(name, file): (size, changed) for name, file, size, changed in rows}


def query(path: Path, sql: str, parameters: Sequence[object] = ()) -> pl.DataFrame:
    """Rows of a read-only query, which can read the catalogue's own files only.

    Args:
        path: the catalogue.
        sql: one statement.
        parameters: bound to its ``?`` in order.

    Raises:
        NotFound: if there is no catalogue.
        BadQuery: if DuckDB refuses the statement, with its own words; if there is not exactly one; if
            a column's name is there twice, or its type or times have no equal in a polars table.
        KeyboardInterrupt: as it came; DuckDB has stopped working then.
    """
    if not path.exists():
        raise NotFound("there is no catalogue yet", where=str(path), next_step="Run `pitchlore run` first")
    with _opened(path) as connection:
        files = [row[0] for row in connection.execute(f"select distinct path from {FILES}").fetchall()]
        if files:
            connection.execute(f"set allowed_paths = [{', '.join(map(_quote, files))}]")
        connection.execute("set enable_external_access = false")
        connection.execute("set python_enable_replacements = false")
        connection.execute("set lock_configuration = true")
        try:
            return _interruptible(connection, lambda: _rows(connection, sql, parameters))
        except duckdb.Error as error:
            raise BadQuery(
                " ".join(str(error).split()), next_step="`pitchlore sql --tables` lists tables and columns"
            ) from error


def _rows(connection: duckdb.DuckDBPyConnection, sql: str, parameters: Sequence[object]) -> pl.DataFrame:
    """The rows of the one statement."""
    statements = connection.extract_statements(sql)
    if len(statements) != 1:
        raise BadQuery(f"{len(statements)} statements were given, not one",
                       next_step="Ask one at a time; `with … as (…)` names steps within one")
    relation: Any = connection.sql(statements[0], params=list(parameters) or None)
    if relation is None:
        return pl.DataFrame()
    twice = sorted({name for name in relation.columns if relation.columns.count(name) > 1})
    if twice:
        raise BadQuery(f"column {twice[0]} occurs twice",
                       next_step="Give one of them another name with `as`")
    for name, dtype in zip(relation.columns, relation.types, strict=True):
        if _has_no_equal(dtype):
            raise BadQuery(f"column {name} is of type {dtype}, which no table of ours can hold",
                           next_step="Cast it, as in `column::varchar`")
    frame = pl.DataFrame(relation.to_arrow_table())
    for column in frame.select(pl.selectors.date() | pl.selectors.datetime()):
        if not column.drop_nulls().dt.year().is_between(1, 9999).fill_null(value=False).all():
            raise BadQuery(f"column {column.name} has times outside the years 1 to 9999",
                           next_step="Cast it, as in `column::varchar`")
    return frame


def _has_no_equal(dtype: Any) -> bool:
    """Whether DuckDB's type, or one that it is made of, has no equal in a polars table."""
    if dtype.id in _NESTED:  # an array's size is among its children
        return any(_has_no_equal(child) for name, child in dtype.children if name != "size")
    return dtype.id in _WITHOUT_EQUAL


def _interruptible(connection: duckdb.DuckDBPyConnection, work: Callable[[], T]) -> T:
    """The result of ``work``, done in a thread so that Ctrl-C reaches Python and stops DuckDB.

    On the main thread DuckDB looks for signals only between its own steps, which may be long.
    """
    with ThreadPoolExecutor(max_workers=1) as pool:
        future = pool.submit(work)
        try:
            while not future.done():
                wait([future], timeout=0.1)
        except KeyboardInterrupt:
            while not future.done():  # an interrupt before the query has begun is forgotten
                connection.interrupt()
                wait([future], timeout=0.1)
            raise
        return future.result()


@contextmanager
def _opened(path: Path) -> Iterator[duckdb.DuckDBPyConnection]:
    """The catalogue as it is on disk now.

    It is attached, not connected to. If the process has already connected to a path, DuckDB gives it the
    old database, even after the file was replaced.
    """
    with duckdb.connect(":memory:") as connection:
        connection.execute(f"attach {_quote(str(path))} as catalog (read_only)")
        connection.execute("use catalog")
        yield connection


def _select(connection: duckdb.DuckDBPyConnection, schema: type[Table], files: Sequence[str]) -> str:
    columns = ", ".join(
        f'"{name}"::varchar as "{name}"' if isinstance(dtype, pl.Enum) else f'"{name}"'
        for name, dtype in schema.dtypes().items()
    )
    listed = ", ".join(map(_quote, files))
    if files and len(schema.readable()) == 1:
        return f"select {columns} from read_parquet([{listed}])"
    # DuckDB itself says how it names the types that it reads from our Parquet
    rows: Any = connection.from_arrow(
        schema.empty().with_columns(pl.selectors.enum().cast(pl.String)).to_arrow()
    )
    nulls = (f'null::{dtype} as "{name}"' for name, dtype in zip(rows.columns, rows.types, strict=True))
    nothing = f"select {', '.join(nulls)} where false"
    if not files:
        return nothing
    # files of earlier versions lack columns
    every = f"from read_parquet([{listed}], union_by_name = true) union all by name {nothing}"
    return f"select {columns} from ({every})"


def _quote(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
