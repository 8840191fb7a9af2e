"""Commands that keep the data folder tidy: quarantine, forget, prune."""

from __future__ import annotations

from typing import Annotated

import polars as pl
from cyclopts import Parameter

from flows.catalog import forget_match, match_of, refresh
from flows.commands.common import DEFAULTS, Common, Json, console, print_frame, print_json
from flows.stages import STAGES
from pipeline.errors import NotFound


def quarantine(
    *, clear: Annotated[bool, Parameter(negative=())] = False, json: Json = False, common: Common = DEFAULTS
) -> None:
    """List what could not be taken, by which stage and why.

    Args:
        clear: Forget the records; what still fails comes back with the next run.
        json: Print JSON.
        common: Options of every command.
    """
    records = common.store.quarantined()
    if clear:
        for record in records:
            common.store.release(record.noun, record.name)
    if json:
        print_json([record.model_dump() for record in records])
    elif not records:
        console().print("nothing is in quarantine")
    else:
        print_frame(pl.DataFrame([{"stage": r.noun, "name": r.name, "reason": r.reason} for r in records]))
        console().print(f"{len(records)} forgotten" if clear else "mend or remove them, then run again")


def forget(match: str, *, common: Common = DEFAULTS) -> None:
    """Remove a match and all that was made of it; knowledge and policies keep what they learned.

    Args:
        match: The match's whole id.
        common: Options of every command.
    """
    store = common.store
    removed = forget_match(store, match)
    if not removed:
        raise NotFound("there is no such match", where=match,
                       next_step='Take its id from pitchlore sql "select match_id from matches"')
    for record in store.quarantined():
        if match_of(record.name) == match:
            store.release(record.noun, record.name)
    refresh(store)
    console().print(f"{match}: {removed} outputs removed; the next run emits knowledge without it")


def prune(*, common: Common = DEFAULTS) -> None:
    """Remove the files of earlier settings or code that nothing refers to any more.

    Args:
        common: Options of every command.
    """
    store = common.store
    refresh(store)
    left = [path for noun in STAGES.receipted for path in store.prune(noun)]
    console().print(f"{len(left)} superseded files removed")
