"""Output for people and for programs: lines, tables, JSON, progress bars."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping, Sequence
from datetime import date, time
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import polars as pl
from rich.console import Console
from rich.table import Table
from rich.text import Text

from pitchlore.pipeline.base.text import printable
from pitchlore.pipeline.face.versions import Knowledge, Policy
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.exports.spreadsheet import safe_csv
from pitchlore.pipeline.views.scout.words import NAMES, of_behaviour, sure_words
from pitchlore.schemas import note_on
from pitchlore.schemas.behaviours import SHOWN_FROM, for_people

#: Least support of behaviours that commands show, unless they are asked for fewer.
LEAST_SUPPORT = SHOWN_FROM

if TYPE_CHECKING:
    from pitchlore.pipeline.views.card import Card


def warn(line: str) -> None:
    """Write a warning to standard error; the command goes on."""
    print(f"pitchlore: {printable(line)}", file=sys.stderr)  # noqa: T201 (this is the command line)


def print_json(value: object) -> None:
    """Write a value as JSON to standard output, for programs; all of it or nothing.

    NaN and infinity become null, dates and times ISO 8601, bytes hexadecimal digits. Decimals without
    places become integers; DuckDB's sums of integers are such decimals.
    """
    text = json.dumps(_plain(value), indent=1, allow_nan=False)
    sys.stdout.write(f"{text}\n")


def print_csv(frame: pl.DataFrame) -> None:
    """Write a table as comma-separated values with a header; all of it or nothing.

    Lists and structs become JSON, bytes hexadecimal digits, null the empty field. Text that a spreadsheet
    would take for a formula begins with an apostrophe.
    """
    flat = frame.with_columns(
        *(_nested_as_json(column) for column in frame if column.dtype.is_nested()),
        pl.selectors.binary().bin.encode("hex"),
    )
    sys.stdout.write(safe_csv(flat))


def _nested_as_json(column: pl.Series) -> pl.Series:
    texts = [None if value is None else json.dumps(_plain(value)) for value in column.to_list()]
    return pl.Series(column.name, texts, dtype=pl.String)


def _plain(value: object) -> object:
    """The value in JSON's own types. A value without a rule is unchanged, so json refuses it."""
    match value:
        case dict():
            return {str(key): _plain(item) for key, item in value.items()}
        case list() | tuple():
            return [_plain(item) for item in value]
        case float() if not math.isfinite(value):
            return None
        case Decimal():
            return int(value) if value.as_tuple().exponent == 0 else float(value)
        case date() | time():
            return value.isoformat()
        case bytes():
            return value.hex()
        case _:
            return value


def print_stand_in(*teams: str) -> None:
    """Print the note on the human-like team, if it is one of these teams."""
    note = note_on(*teams)
    if note is not None:
        console().print(f"{note}.")


class _Lines(Console):
    """A console that prints lines: control characters in a string, as of a path or a name, become escapes."""

    def print(self, *objects: Any, **named: Any) -> None:
        super().print(*(printable(it) if isinstance(it, str) else it for it in objects), **named)


def console() -> Console:
    """The terminal; a file or pipe gets lines that are not wrapped. What is printed is text, never markup."""
    return _Lines(width=None if sys.stdout.isatty() else 200, markup=False, emoji=False)


def say(line: str) -> None:
    """A line on standard error at once, of a command that goes on for long."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def print_failed(failures: Mapping[str, str], word: str = "failed") -> None:
    """Print what could not be done and why, a line each, which names it once."""
    for what, why in failures.items():
        name, colon, rest = why.partition(": ")
        said = rest if colon and what.endswith(name) else why
        console().print(Text.assemble((word, "bold red"), printable(f" {what}: {said}")), soft_wrap=True)


def print_frame(frame: pl.DataFrame, title: str = "") -> None:
    """Write a table for people, every row."""
    shown = Text(printable(title), style="table.title")
    table = Table(title=shown if title else None, header_style="bold", title_justify="left")
    for name, dtype in frame.schema.items():
        table.add_column(printable(name), justify="right" if dtype.is_numeric() else "left", overflow="fold")
    for row in frame.iter_rows():
        table.add_row(*map(_cell, row))
    console().print(table)


def by_effect(behaviours: pl.DataFrame) -> pl.DataFrame:
    """Behaviours in their order for people, with what V changed with them in all."""
    return for_people(behaviours)


def in_words(behaviour: str) -> str:
    """A behaviour's id in words."""
    return of_behaviour(behaviour)


def spelt(codes: str) -> pl.Expr:
    """The meaning of a behaviour's codes, for people: column ``reads``."""
    names = {code: name.removeprefix("Robot ") for code, name in NAMES.items()}
    return pl.col(codes).list.eval(
        pl.element().replace_strict(names, return_dtype=pl.String)
    ).list.join(", ").alias("reads")


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 9_999.5 or not math.isfinite(value) else f"{value:.0f}"
    return printable(str(value)) if isinstance(value, (str, list)) else str(value)


def print_cards(told: Sequence[Card]) -> None:
    """Print what went with winning and with losing of each team, and what its newest match changed."""
    out = console()
    for card in told:
        for what, sentences in (("winning", card.wins), ("losing", card.loses)):
            out.print(f"{card.team}: what went with {what}", style="bold", highlight=False, markup=False)
            for it in sentences:
                goals = f"; {it.goals}" if it.goals else ""
                out.print(f"  {it.says}, {it.often}{goals} ({sure_words(it.sure)})", soft_wrap=True,
                          highlight=False)
            if not sentences:
                out.print("  too few matches tell yet", highlight=False)
        out.print(f"  newest match: {card.newest}", soft_wrap=True, highlight=False)
        for line in card.changed:
            out.print(f"    {line}", soft_wrap=True, highlight=False)
    for few in dict.fromkeys(card.few for card in told if card.few):
        out.print(few, soft_wrap=True, highlight=False)


def print_training(store: Store, *, tables: bool = True) -> None:
    """Print how the newest policy plays and, with ``tables``, its training: a row for each key and role."""
    newest = store.latest("policies")
    assert newest is not None
    policy = Policy(store, newest)
    console().print(policy.plays, soft_wrap=True, highlight=False)
    if not tables:
        return
    columns = ("pairs", "new_pairs", "decisions", "transitions", "first_error", "last_error")
    rows = [{"key": key, "role": role} | {c: counts[c] for c in columns}
            for key, roles in newest.details["tables"].items() for role, counts in roles.items()]
    if not rows:  # nothing is known yet: no match had a goal
        return
    print_frame(pl.DataFrame(rows).rename({c: c.replace("_", " ") for c in columns}),
                title=f"training of policy version {newest.version} (error: mean |TD error| of a sweep)")
    print_known(policy)


def print_lack(version: Knowledge | Policy) -> None:
    """Print which matches and versions a version was made without, if any were damaged or refused."""
    if version.made_without:
        console().print(f"made without {', '.join(version.made_without)}", soft_wrap=True, highlight=False)


def print_known(version: Knowledge | Policy) -> None:
    """Print how many decisions of the imitated team were in states that are known, by each key."""
    shares = ", ".join(f"{100 * share:.3g} % by {key}" for key, share in version.known.items())
    if shares:
        console().print(f"decisions of {version.imitates or 'all teams'} in known states: {shares}",
                        soft_wrap=True, highlight=False)
