"""The command runs: list the last runs."""

from __future__ import annotations

from typing import Annotated

import polars as pl
from cyclopts import Parameter
from cyclopts.validators import Number

from pitchlore.flows.commands.common import DEFAULTS, Common, Json
from pitchlore.flows.commands.printing import console, print_failed, print_frame, print_json
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.costs import Cost, mebibytes
from pitchlore.pipeline.engine.history import RunEntry, log
from pitchlore.pipeline.engine.progress import Leg

Count = Annotated[int, Parameter(validator=Number(gte=1))]


def runs(
    name: str | None = None, *, last: Count = 20, json: Json = False, common: Common = DEFAULTS
) -> None:
    """List the last runs: start, length, what was made, failures, cost. No Prefect server is asked.

    Args:
        name: Show what this run did, stage by stage. The first letters of its name are enough.
        last: Number of runs to list.
        json: Print JSON.
        common: Options of every command.
    """
    store = common.existing
    found = log(store)
    for error in found.damaged.values():
        store.go_on_without(error)
    if name is not None:
        _show(_named(found.entries, name, store.where), json=json)
        return
    entries = found.entries[-last:]
    if json:
        print_json([_plain(entry) for entry in entries])
    elif not entries:
        console().print("no run is remembered: `pitchlore run` makes one")
    else:
        print_frame(pl.DataFrame([_row(entry) for entry in entries]))
        print_failed({entry.name: entry.error for entry in entries if entry.error}, "ended early")


def _named(entries: list[RunEntry], name: str, where: str) -> RunEntry:
    """The run whose name begins so.

    Raises:
        NotFound: if none does, or several do.
    """
    fitting = [entry for entry in entries if entry.name.startswith(name)]
    if len(fitting) != 1:
        raise NotFound(f"{len(fitting) or 'no'} remembered runs are named {name!r}", where=where,
                       next_step="`pitchlore runs` lists them")
    return fitting[0]


def _plain(entry: RunEntry) -> dict[str, object]:
    """A run as JSON has it, with its sums."""
    return entry.model_dump(mode="json") | {
        "made": entry.made, "kept": entry.kept, "failed": entry.failed, "cost": entry.cost.model_dump()}


def _row(entry: RunEntry) -> dict[str, object]:
    """A run as a row of the list; times are this machine's."""
    return {
        "run": entry.name, "what": entry.what, "began": f"{entry.began.astimezone():%Y-%m-%d %H:%M:%S}",
        "s": round(entry.seconds, 1), "made": entry.made, "kept": entry.kept, "failed": entry.failed,
        "knowledge": entry.knowledge, "policy": entry.policy, **_priced(entry.cost),
    }


def _priced(cost: Cost) -> dict[str, object]:
    return {"work, s": round(cost.seconds, 1), "read, MiB": mebibytes(cost.bytes_in),
            "written, MiB": mebibytes(cost.bytes_out)}


def _show(entry: RunEntry, *, json: bool) -> None:
    if json:
        print_json(_plain(entry))
        return
    console().print(f"{entry.what}, began {entry.began.astimezone():%Y-%m-%d %H:%M:%S}, "
                    f"took {entry.seconds:.1f} s")
    if entry.stages:
        print_frame(pl.DataFrame([
            {"stage": stage.noun, "made": stage.made, "kept": stage.kept, "failed": stage.failed,
             "pieces": stage.cost.pieces, **_priced(stage.cost), "slowest piece": stage.cost.slowest,
             "its s": round(stage.cost.slowest_s, 2)}
            for stage in entry.stages
        ]))
    if entry.legs:
        rest = entry.seconds - sum(leg.seconds for leg in entry.legs)
        print_frame(pl.DataFrame([
            {"by the clock": leg.name, "s": leg.seconds, "work, s": leg.work_s,
             "busy": leg.work_s / leg.seconds if leg.work_s else None}
            for leg in (*entry.legs, Leg(name="the rest", seconds=round(rest, 3), work_s=0.0))
        ]))
    print_failed(entry.failures)
    if entry.failed > len(entry.failures):
        console().print(f"and {entry.failed - len(entry.failures)} more")
    if entry.error:
        print_failed({"this run": entry.error}, "ended early")
