"""The command sql: query the catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json
from pitchlore.flows.commands.printing import console, print_csv, print_frame, print_json, warn
from pitchlore.pipeline.base.errors import BadQuery, BadSettings, NotFound
from pitchlore.pipeline.engine.catalog import distrust, refresh
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
from pitchlore.schemas import PUBLIC

#: Rows of an answer that are laid out for people: a table of millions would take all memory.
MOST_ROWS = 1_000


def sql(
    query: str | None = None,
    *parameters: str,
    tables: Flag = False,
    json: Json = False,
    csv: Flag = False,
    common: Common = DEFAULTS,
) -> None:
    """Query the catalogue in DuckDB's SQL, read-only.

    Args:
        query: One SQL statement. A terminal shows the first 1,000 rows of its answer.
        parameters: Values for the `?` in the query, in order.
        tables: List the tables with their columns, meanings and units instead.
        json: Print an array of objects.
        csv: Print comma-separated values with a header.
        common: Options of every command.
    """
    if json and csv:
        raise BadSettings("are two ways to print one answer", where="--json and --csv",
                          next_step="Leave one out")
    if tables:
        frame = _columns()
    elif query is None:
        raise NotFound("no query was given", next_step="Write one in quotes, or name --tables")
    else:
        frame = _answer(common.existing, query, parameters)
    if json:
        print_json(frame.to_dicts())
    elif csv:
        print_csv(frame)
    else:
        shown = frame if tables else frame.head(MOST_ROWS)
        print_frame(shown)
        if shown.height < frame.height:
            console().print(f"the first {MOST_ROWS:,} of {frame.height:,} rows; --json or --csv prints all")
        elif not tables:
            console().print(f"{frame.height} rows")


def _columns() -> pl.DataFrame:
    """The columns of the public tables, a row each."""
    return pl.DataFrame([
        {"table": name, "column": column, "type": str(schema.dtypes()[column]), "meaning": meaning}
        for name, schema in PUBLIC.items() for column, meaning in schema.meanings().items()
    ])


def _answer(store: Store, query: str, parameters: Sequence[str]) -> pl.DataFrame:
    """The rows of a query; a warning names damaged files that the catalogue leaves out."""
    with store.keeping():
        path = _refreshed(store)
        try:
            return ask(path, query, parameters)
        except BadQuery as error:
            if str(store.root.resolve()) not in str(error):
                raise
        distrust(store)  # DuckDB cannot read a file: its bytes changed, while its size and time did not
        return ask(_refreshed(store), query, parameters)


def _refreshed(store: Store) -> Path:
    """The catalogue, up to date; a warning names each damaged file that it leaves out."""
    path, left_out = refresh(store)
    if store.mirror is not None:
        warn(f"{store.where}: {store.mirror.age()}")
    for file in left_out:
        warn(f"{file.advice} Its rows are left out." if file.record.rows else file.advice)
    return path
