"""Queries of the catalogue that can only read.

Since DuckDB 2.0 a statement of type SELECT can write: ``with x as (copy …) select …``. So the type of a
statement says too little. A query runs only if DuckDB parses it to query nodes that read, and to table
functions that have no effect. The SQL that runs is that which was parsed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any, TypeVar

import duckdb
import polars as pl

from pitchlore.pipeline.base.errors import BadQuery, NotFound
from pitchlore.pipeline.store.catalog import FILES, check_open, connected, is_there, listing, pattern, quote
from pitchlore.schemas import PUBLIC

T = TypeVar("T")
Relation = duckdb.DuckDBPyRelation

#: DuckDB's types that have no equal in a polars table: it refuses them, or loses what they mean.
_WITHOUT_EQUAL = frozenset(
    ("interval", "union", "variant", "geometry", "bignum", "bit", "time with time zone", "uhugeint")
)
_NESTED = frozenset(("list", "array", "struct", "map"))

#: The query nodes that only read. Others write: COPY_QUERY_NODE, INSERT_QUERY_NODE and the like.
_READING = frozenset(("SELECT_NODE", "SET_OPERATION_NODE", "RECURSIVE_CTE_NODE", "CTE_NODE"))
#: The table functions without effects that a query may call, besides those that describe the database.
#: `query` is none of them: it would run SQL from a text.
_FUNCTIONS = frozenset((
    "generate_series", "icu_calendar_names", "json_each", "json_tree", "pg_timezone_names", "query_table",
    "range", "repeat", "repeat_row", "summary", "unnest",
))
#: The table function that names a table by a text, which may be put together.
_BY_TEXT = "query_table"
#: The tables that views of other tables look into.
_BESIDE = frozenset(("matches",))
_DESCRIBING = ("duckdb_", "parquet_", "pragma_")

#: Hint to a user who asked for something else.
_ASK = "Ask with SELECT, FROM, WITH, VALUES, DESCRIBE, SHOW or SUMMARIZE, or put EXPLAIN before"
_EXPLAIN = re.compile(r"\s*explain\b", re.IGNORECASE)


def ask(path: Path, sql: str, parameters: Sequence[object] = ()) -> pl.DataFrame:
    """The rows of a query, which can read the catalogue's own files only, and write nothing.

    Args:
        path: the catalogue.
        sql: one statement that reads: of type SELECT in DuckDB, or ``explain`` and such a statement.
        parameters: bound to its ``?`` in order.

    Raises:
        NotFound: if there is no catalogue.
        BadQuery: if the statement does not only read; if DuckDB refuses it, with its own words; if there is
            not exactly one; if a column's name is there twice, or its type or times have no equal in a polars
            table.
        CorruptFile, ReadFailed: if a file of the catalogue cannot be opened.
        KeyboardInterrupt: as it came; DuckDB has stopped working then.
    """
    (rows,) = ask_each(path, [sql], parameters)
    return rows


def ask_each(path: Path, queries: Sequence[str], parameters: Sequence[object] = ()) -> list[pl.DataFrame]:
    """The rows of some queries with the same parameters; a connection is made once. See :func:`ask`."""
    with _guarded(path, " ".join(queries)) as connection:
        try:
            return _interruptible(connection, lambda: [_rows(connection, sql, parameters) for sql in queries])
        except duckdb.Error as error:
            raise _refused(error, path) from error


def relation(path: Path, sql: str, parameters: Sequence[object] = ()) -> Relation:
    """A query as DuckDB's relation, which runs when its rows are asked for.

    It has a connection of its own, which can read the catalogue's own files only, and write nothing. An error
    of the run is DuckDB's.

    Args:
        path: the catalogue.
        sql: as for :func:`ask`.
        parameters: as for :func:`ask`.

    Raises:
        NotFound: if there is no catalogue.
        BadQuery: if the statement does not only read; if DuckDB refuses it; if there is not exactly one.
    """
    connection = _guarded(path, sql)
    try:
        return connection.sql(_reading(connection, sql), params=list(parameters) or None)
    except duckdb.Error as error:
        raise _refused(error, path) from error


def _guarded(path: Path, sql: str) -> duckdb.DuckDBPyConnection:
    """A connection to the catalogue that can read the files of the tables that a query names, no others."""
    if not is_there(path):
        raise NotFound("there is no catalogue yet", where=str(path), next_step="Run `pitchlore run` first")
    connection = connected(path)
    connection.execute("set temp_directory = ''")  # what does not fit in memory fails
    _allow(connection, sql, path.parent.resolve())
    connection.execute("set enable_external_access = false")
    connection.execute("set python_enable_replacements = false")
    connection.execute("set lock_configuration = true")
    return connection


def _refused(error: duckdb.Error, path: Path) -> BadQuery:
    """DuckDB's refusal, in its own words; the system's is raised where it cannot open a file."""
    if isinstance(error, duckdb.IOException):
        check_open(listing(path) or ())
    return BadQuery(
        " ".join(str(error).split()), next_step="`pitchlore sql --tables` lists tables and columns")


def _allow(connection: duckdb.DuckDBPyConnection, sql: str, root: Path) -> None:
    """Allow the files in a data folder of the tables that a query can name: DuckDB takes 25 µs for each."""
    said = sql.lower()
    asked = [name for name in PUBLIC if name in said or name in _BESIDE or _BY_TEXT in said]
    named = [*asked, *(beside for name in asked for beside in PUBLIC[name].LOOKS_INTO)]
    shown = f"select distinct path from {FILES} where list_contains(?, table_name)"
    files = [f"{root / file}" for (file,) in connection.execute(shown, [named]).fetchall()]
    if files:
        allowed = {*files, *map(pattern, files)}
        connection.execute(f"set allowed_paths = [{', '.join(map(quote, sorted(allowed)))}]")


def _rows(connection: duckdb.DuckDBPyConnection, sql: str, parameters: Sequence[object]) -> pl.DataFrame:
    """The rows of the one statement."""
    relation: Any = connection.sql(_reading(connection, sql), params=list(parameters) or None)
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


def _reading(connection: duckdb.DuckDBPyConnection, sql: str) -> str:
    """The SQL of the one statement, which only reads.

    Raises:
        BadQuery: if there is not one statement, or if it may do more.
    """
    statements = connection.extract_statements(sql)
    if len(statements) != 1:
        raise BadQuery(f"{len(statements)} statements were given, not one",
                       next_step="Ask one at a time; `with … as (…)` names steps within one")
    sql = statements[0].query
    explain = _EXPLAIN.match(sql)
    if explain is not None:
        sql = sql[explain.end():]
    for node in _parsed(connection, sql):
        if "cte_map" in node and node["type"] not in _READING:
            raise BadQuery(f"{node['type'].partition('_')[0]} does not only read", next_step=_ASK)
        function = node["function"]["function_name"] if node.get("type") == "TABLE_FUNCTION" else "unnest"
        if function not in _FUNCTIONS and not function.startswith(_DESCRIBING):
            raise BadQuery(f"the table function {function} may not be called", next_step=_ASK)
    return sql if explain is None else f"explain {sql}"


def _parsed(connection: duckdb.DuckDBPyConnection, sql: str) -> Iterator[dict[str, Any]]:
    """All nodes of a statement of type SELECT, as DuckDB parses it.

    Raises:
        BadQuery: if it is no such statement, or nested too deeply.
    """
    ((text,),) = connection.execute("select json_serialize_sql(?)", [sql]).fetchall()
    try:
        found = json.loads(text)
    except RecursionError as error:
        raise BadQuery("is nested too deeply", next_step="Name steps of it with `with … as (…)`") from error
    if found["error"]:
        raise BadQuery("only statements that read are answered", next_step=_ASK)
    left = [found["statements"]]
    while left:
        node = left.pop()
        if isinstance(node, dict):
            yield node
            left.extend(node.values())
        elif isinstance(node, list):
            left.extend(node)


def _has_no_equal(dtype: Any) -> bool:
    """True if DuckDB's type, or one that it is made of, has no equal in a polars table."""
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
