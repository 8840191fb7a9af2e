"""The command quarantine: what could not be taken."""

from __future__ import annotations

from typing import Annotated

import polars as pl
from cyclopts import Parameter

from flows.commands.common import DEFAULTS, Common, Json
from flows.commands.printing import console, print_frame, print_json


def quarantine(
    *, clear: Annotated[bool, Parameter(negative=())] = False, json: Json = False, common: Common = DEFAULTS
) -> None:
    """List what could not be taken, by which stage and why.

    Args:
        clear: Forget the records; what still fails comes back with the next run.
        json: Print JSON.
        common: Options of every command.
    """
    records = common.existing.quarantined()
    if clear:
        for record in records:
            common.existing.release(record.noun, record.name)
    if json:
        print_json([record.model_dump() for record in records])
    elif not records:
        console().print("nothing is in quarantine")
    else:
        print_frame(pl.DataFrame([{"stage": r.noun, "name": r.name, "reason": r.reason} for r in records]))
        console().print(f"{len(records)} forgotten" if clear else "mend or remove them, then run again")
