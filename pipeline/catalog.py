"""The catalogue: one DuckDB file of views over the tables' files, and safe queries on it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import duckdb
import polars as pl

from pipeline.errors import BadQuery, NotFound
from schemas import PUBLIC, Table

FILES = "catalog_files"


def build(path: Path, sources: Mapping[str, Sequence[Path]]) -> None:
    """Make a catalogue with a view for every public table.

    Args:
        path: a file that does not exist yet; the caller moves it into place.
        sources: table name to the files that hold its rows, by the receipts and manifests. A table
            without files becomes a view without rows.
    """
    with duckdb.connect(str(path)) as connection:
        connection.execute(f"create table {FILES} (table_name varchar, path varchar)")
        for name, schema in PUBLIC.items():
            files = [str(file.resolve()) for file in sources.get(name, ())]
            for file in files:
                connection.execute(f"insert into {FILES} values (?, ?)", [name, file])
            connection.execute(f"create view {name} as {_select(schema, files)}")
            connection.execute(f"comment on view {name} is {_quote(_first_line(schema))}")
            for column, meaning in schema.meanings().items():
                connection.execute(f'comment on column {name}."{column}" is {_quote(meaning)}')


def stale(path: Path, sources: Mapping[str, Sequence[Path]]) -> bool:
    """Whether the catalogue is missing, or lists other files than ``sources``."""
    if not path.exists():
        return True
    wanted = {(name, str(file.resolve())) for name, files in sources.items() for file in files}
    try:
        with _opened(path) as connection:
            return set(connection.execute(f"select table_name, path from {FILES}").fetchall()) != wanted
    except duckdb.Error:
        return True


def query(path: Path, sql: str, parameters: Sequence[object] = ()) -> pl.DataFrame:
    """Rows of a query, opened read-only; nothing but the catalogue's own files can be read.

    Args:
        path: the catalogue.
        sql: one statement.
        parameters: bound to its ``?`` in order.

    Raises:
        NotFound: if there is no catalogue.
        BadQuery: if DuckDB refuses the statement, with its own words.
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
            relation: Any = connection.sql(sql, params=list(parameters) or None)
            return pl.DataFrame(None if relation is None else relation.to_arrow_table())
        except duckdb.Error as error:
            raise BadQuery(
                " ".join(str(error).split()), next_step="`pitchlore sql --tables` lists tables and columns"
            ) from error

@contextmanager
def _opened(path: Path) -> Iterator[duckdb.DuckDBPyConnection]:
    """The catalogue as it is on disk now.

    Attached, not connected to: DuckDB gives a path that the process has open already the old
    database, even when the file has been replaced since.
    """
    with duckdb.connect(":memory:") as connection:
        connection.execute(f"attach {_quote(str(path))} as catalog (read_only)")
        connection.execute("use catalog")
        yield connection


def _select(schema: type[Table], files: Sequence[str]) -> str:
    if files:
        columns = ", ".join(
            f'"{name}"::varchar as "{name}"' if isinstance(dtype, pl.Enum) else f'"{name}"'
            for name, dtype in schema.dtypes().items()
        )
        return f"select {columns} from read_parquet([{', '.join(map(_quote, files))}])"
    columns = ", ".join(f'null::{_type(dtype)} as "{name}"' for name, dtype in schema.dtypes().items())
    return f"select {columns} where false"


def _type(dtype: pl.DataType) -> str:
    """DuckDB's name of a column's type, as it reads it from our Parquet."""
    if isinstance(dtype, pl.List):
        assert isinstance(dtype.inner, pl.DataType)
        return f"{_type(dtype.inner)}[]"
    names: dict[type[pl.DataType], str] = {
        pl.String: "varchar", pl.Enum: "varchar", pl.Boolean: "boolean", pl.Int8: "tinyint",
        pl.Int16: "smallint", pl.Int32: "integer", pl.Int64: "bigint", pl.UInt32: "uinteger",
        pl.Float32: "float", pl.Float64: "double", pl.Datetime: "timestamptz",
    }
    return names[type(dtype)]


def _first_line(schema: type[Table]) -> str:
    return (schema.__doc__ or "").strip().splitlines()[0]


def _quote(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
