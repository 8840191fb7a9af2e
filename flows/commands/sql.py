"""The command sql: query the catalogue."""

from __future__ import annotations

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json
from pitchlore.flows.commands.printing import console, print_csv, print_frame, print_json
from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.face.league import League

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
        csv: Print comma-separated values with a header. Text that a spreadsheet would take for a formula
            begins with an apostrophe; --json prints it as it is.
        common: Options of every command.
    """
    if json and csv:
        raise BadSettings("are two ways to print one answer", where="--json and --csv",
                          next_step="Leave one out")
    if tables:
        frame = League.tables()
    elif query is None:
        raise NotFound("no query was given", next_step="Write one in quotes, or name --tables")
    else:
        frame = common.league.ask(query, *parameters)
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
            console().print(number_of(frame.height, "row"))
