"""Commands that look: sql, situations, replay, commentary."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

import polars as pl
from cyclopts import Parameter

from flows.catalog import refresh
from flows.commands.common import (
    DEFAULTS,
    Common,
    Json,
    console,
    print_frame,
    print_json,
    print_stand_in,
    warn,
)
from pipeline.errors import NotFound
from pipeline.pitch import Kind, Pitch
from pipeline.situations.rulebook import rule_table, term_table
from pipeline.store import Store, catalog
from pipeline.store.receipts import Receipt
from pipeline.views.commentary import commentary as tell
from pipeline.views.commentary.summary import heading, numbers
from pipeline.views.plots.matches import memberships
from pipeline.views.plots.style import png
from pipeline.views.replay import page
from pipeline.views.replay.animation import animation, seconds_shown
from schemas import PUBLIC, Goals, Matches, Referee, Situations, Trajectories

#: Rows of an answer that are laid out for people: a table of millions would take all memory.
MOST_ROWS = 1_000


def sql(
    query: str | None = None,
    *parameters: str,
    tables: Annotated[bool, Parameter(negative=())] = False,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Ask the catalogue in SQL (DuckDB's), read-only.

    Args:
        query: One statement. Of its rows the first 1,000 are shown.
        parameters: Values for the `?` in the query, in order.
        tables: List the tables with their columns, meanings and units instead.
        json: Print an array of objects.
        common: Options of every command.
    """
    path, left_out = refresh(common.store)
    for file in left_out:
        warn(f"{file}: is lost or damaged, its rows are left out. Run `pitchlore run` to make it anew.")
    if tables:
        frame = pl.DataFrame([
            {"table": name, "column": column, "type": str(schema.dtypes()[column]), "meaning": meaning}
            for name, schema in PUBLIC.items() for column, meaning in schema.meanings().items()
        ])
    elif query is None:
        raise NotFound("no query was given", next_step="Write one in quotes, or name --tables")
    else:
        frame = catalog.query(path, query, parameters)
    if json:
        print_json(frame.to_dicts())
    else:
        shown = frame if tables else frame.head(MOST_ROWS)
        print_frame(shown)
        if shown.height < frame.height:
            console().print(f"the first {MOST_ROWS:,} of {frame.height:,} rows; --json prints all")
        elif not tables:
            console().print(f"{frame.height} rows")


def situations(
    *,
    kind: Literal["vsss", "ssl", "2d"] = "vsss",
    terms: Annotated[bool, Parameter(negative=())] = False,
    plot: Path | None = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Print the rules of the 31 situations, or the fuzzy terms they are made of.

    Args:
        kind: The league whose distances and speeds are shown.
        terms: Print the terms' trapezoids instead of the rules.
        plot: Draw the terms into this PNG file instead (the paper's Figure 1, reconstructed).
        json: Print JSON.
        common: Options of every command.
    """
    store = common.store
    if plot is not None:
        store.write_bytes(plot, png(memberships(term_table(Kind(kind)))))
        console().print(f"{plot}: membership functions of {kind}", soft_wrap=True)
        return
    frame = term_table(Kind(kind)) if terms else rule_table()
    if json:
        print_json(frame.to_dicts())
    else:
        print_frame(frame)


def replay(
    match: str, *, output: Annotated[Path | None, Parameter(alias="-o")] = None, hz: float = 20.0,
    gif: Path | None = None, start: Annotated[float, Parameter(name="--from")] = 0.0, seconds: float = 20.0,
    common: Common = DEFAULTS,
) -> None:
    """Write a match as one web page: the pitch, the situations, the goals; no network needed. Or as a film.

    Args:
        match: The match's id, or the beginning of it.
        output: Where to write; by default replays/MATCH.html in the data folder.
        hz: Pictures a second of play, of the page.
        gif: Write some seconds as an animation into this file instead.
        start: Where the animation begins, seconds since the first sample.
        seconds: How long it is, unless the match ends before.
        common: Options of every command.
    """
    store = common.store
    if gif is not None:
        log, made = _chain_of(store, match, "trajectories", "situations")
        row = store.read_table(log, "matches", Matches)
        film = animation(
            row,
            store.read_table(made["trajectories"], "trajectories", Trajectories),
            store.read_table(made["situations"], "situations", Situations),
            store.read_table(log, "referee", Referee),
            Pitch.model_validate(log.details["pitch"]), start_s=start, seconds=seconds,
        )
        store.write_bytes(gif, film)
        lasts = seconds_shown(row, start, seconds)
        said = f"{gif} ({len(film) / 1e6:.2f} MB): {lasts:.4g} s from {start:g} s on"
        console().print(said, soft_wrap=True)
        return
    log, made = _chain_of(store, match, "trajectories", "situations", "goals")
    text = page(
        store.read_table(log, "matches", Matches),
        store.read_table(made["trajectories"], "trajectories", Trajectories),
        store.read_table(made["situations"], "situations", Situations),
        store.read_table(made["goals"], "goals", Goals),
        store.read_table(log, "referee", Referee),
        Pitch.model_validate(log.details["pitch"]),
        hz=hz,
    )
    path = output or store.root / "replays" / f"{log.name}.html"
    store.write_bytes(path, text.encode())
    console().print(f"{path} ({len(text) / 1e6:.2f} MB): open it in a browser", soft_wrap=True)
    print_stand_in(log.details["home"], log.details["away"])


def commentary(
    match: str, *, goals: Annotated[bool, Parameter(negative=())] = False, json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Tell a match: goals and what led to them, chances, restarts, who has the ball; and its numbers.

    Args:
        match: The match's id, or the beginning of it.
        goals: Tell only the goals.
        json: Print what is told and the summary as JSON.
        common: Options of every command.
    """
    store = common.store
    log, made = _chain_of(store, match, "trajectories", "situations", "goals")
    told = tell(
        store.read_table(log, "matches", Matches),
        store.read_table(log, "referee", Referee),
        store.read_table(made["goals"], "goals", Goals),
        store.read_table(made["situations"], "situations", Situations),
        store.read_table(made["trajectories"], "trajectories", Trajectories),
        Pitch.model_validate(log.details["pitch"]),
    )
    moments = [moment for moment in told.moments if moment.kind == "goal" or not goals]
    if json:
        print_json({"moments": [moment.facts() for moment in moments],
                    "summary": told.summary.model_dump(mode="json")})
        return
    out = console()
    for line in heading(told.summary):
        out.print(line, style="bold", markup=False, soft_wrap=True)
    for moment in moments:
        style = "bold" if moment.kind == "goal" else None
        out.print(moment.line(), style=style, markup=False, highlight=False, soft_wrap=True)
    out.print()
    for line in numbers(told.summary):
        out.print(line, markup=False, highlight=False, soft_wrap=True)


def _chain_of(store: Store, match: str, *nouns: str) -> tuple[Receipt, dict[str, Receipt]]:
    """The receipts of a match's log and of what was made of it.

    Raises:
        NotFound: if no or several matches are called so, or one of the nouns has not been made.
    """
    log = _find(store, match)
    made = {noun: receipt for noun in nouns if (receipt := store.receipt(noun, log.name)) is not None}
    if len(made) < len(nouns):
        missing = ", ".join(sorted(set(nouns) - set(made)))
        raise NotFound(f"{log.name} has no {missing} yet", next_step="Run `pitchlore run` first")
    return log, made


def _find(store: Store, match: str) -> Receipt:
    receipts = list(store.receipts("matches"))
    found = _called(receipts, match)
    if not found:
        for season in store.receipts("seasons"):
            own = store.root / season.details["store"]
            if _called(Store(own).receipts("matches"), match):
                raise NotFound(f"is a match of the season {season.name}", where=match,
                               next_step=f"Add `--data {own}`")
    if len(found) != 1:
        names = ", ".join(r.name for r in (found or receipts)[:8]) or "none yet"
        what = "several matches begin so" if found else "there is no such match"
        raise NotFound(f"{what} (there are: {names})", where=match, next_step="Name one of them")
    return found[0]


def _called(receipts: Iterable[Receipt], match: str) -> list[Receipt]:
    """Those of that name, or else those whose names begin so."""
    every = list(receipts)
    return [r for r in every if r.name == match] or [r for r in every if r.name.startswith(match)]
