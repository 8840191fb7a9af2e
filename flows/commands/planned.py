"""The plan of a run, printed: ``pitchlore run --plan``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import polars as pl

from pitchlore.flows.commands.printing import console, print_frame, print_json
from pitchlore.pipeline.engine.planning import RunPlan, StagePlan, run_plan
from pitchlore.pipeline.settings import RunSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.buckets import check_local
from pitchlore.pipeline.views.planned import plan_page

#: Outputs that are named for each reason; the others are counted.
_NAMED = 3
#: End of each plan.
_SAME = "Nothing was changed."


def print_plan(
    store: Store, settings: RunSettings, *, train: bool, json: bool, page: Path | None = None
) -> None:
    """Print the work that a run would do, for people or as JSON; with a page, also write that.

    Raises:
        StorageFailed: if the data folder's bucket cannot be reached.
    """
    found = run_plan(store, settings, settings.imports, train=train)
    if page is not None:
        check_local(page)
        store.write_bytes(page, plan_page(found, store.where).encode())
    if json:
        print_json(found.model_dump(mode="json"))
        return
    print_frame(pl.DataFrame([_row(stage) for stage in found.stages], infer_schema_length=None))
    out = console()
    for why, nouns in _reasons(found.stages).items():
        out.print(f"{why}: {', '.join(nouns)}", soft_wrap=True, highlight=False)
    for note in found.notes:
        out.print(note, soft_wrap=True, highlight=False)
    out.print(_cost(found), soft_wrap=True, highlight=False)
    if page is not None:
        out.print(f"{page}: open it in a browser", soft_wrap=True, highlight=False)


def _row(stage: StagePlan) -> dict[str, object]:
    return {
        "stage": stage.noun, "made from": ", ".join(stage.inputs) or "recordings", "fresh": stage.fresh,
        "to make": stage.count(sure=True), "perhaps": stage.count(sure=False),
        "each, s": None if stage.each_s is None else round(stage.each_s, 3),
        "s": round(stage.work_s(sure=True), 2), "perhaps, s": round(stage.work_s(sure=False), 2),
    }


def _reasons(stages: Iterable[StagePlan]) -> dict[str, list[str]]:
    """The stages with outputs to make, by reason and outputs; the first of these are named."""
    found: dict[str, list[str]] = {}
    for stage in stages:
        for detail, sure, outputs in stage.reasons(_NAMED):
            found.setdefault(f"{outputs}: {detail}{'' if sure else ' (perhaps)'}", []).append(stage.noun)
    return found


def _cost(found: RunPlan) -> str:
    """The line on the cost of a plan."""
    outputs, others = found.counts
    if not outputs + others:
        but = ", but for what was refused" if any(stage.todo for stage in found.stages) else ""
        return f"Nothing to make: every receipt holds{but}. {_SAME}"
    sure, perhaps = found.work_s
    line = f"To make: {_outputs(outputs)}{_work(sure)}"
    if others:
        line += (f"; perhaps {_outputs(others)} more{_work(perhaps)}, "
                 "if what they are made from comes out with other bytes")
    line += f". The cost is by {found.runs} run{'' if found.runs == 1 else 's'} in the log"
    if found.unpriced:
        line += f", which do not tell that of {', '.join(found.unpriced)}"
    return f"{line}. {_SAME}"


def _work(seconds: float) -> str:
    """The seconds of work; nothing where the log tells none."""
    return f", {seconds:.1f} s of work" if seconds else ""


def _outputs(count: int) -> str:
    return f"{count} output{'' if count == 1 else 's'}"
