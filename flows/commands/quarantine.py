"""The command quarantine: list refused recordings and matches."""

from __future__ import annotations

import polars as pl

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json
from pitchlore.flows.commands.printing import console, print_frame, print_json


def quarantine(
    *, clear: Flag = False, json: Json = False, common: Common = DEFAULTS
) -> None:
    """List recordings and matches that a stage refused, and the reasons.

    Args:
        clear: Delete the records. The next run tries again, and records each new failure.
        json: Print JSON.
        common: Options of every command.
    """
    store = common.existing
    records = store.quarantined()
    if clear:
        for record in records:
            store.release(record.noun, record.name)
    if json:
        print_json([record.model_dump() for record in records])
    elif not records:
        console().print("nothing is in quarantine")
    else:
        print_frame(pl.DataFrame([{"stage": r.noun, "name": r.name, "reason": r.reason} for r in records]))
        console().print(f"{len(records)} forgotten" if clear else "mend or remove them, then run again")
