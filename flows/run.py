"""The flows: the engine's pieces of work under Prefect, with the same arguments and the same bytes."""

from functools import cache
from pathlib import Path
from typing import Any

from prefect import Flow

from pitchlore.flows.flow import our_flow
from pitchlore.flows.paradigms import play_paradigms
from pitchlore.flows.reporting import report
from pitchlore.flows.work import run
from pitchlore.pipeline.engine.evaluations import measure
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.run import (
    VersionReport,
    import_recordings,
    make_stage,
    make_version,
    train_policy,
)
from pitchlore.pipeline.engine.season import play_seasons
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import HistorySettings, Settings

run_flow = our_flow(name="run")(run)
matches_flow = our_flow(name="matches")(import_recordings)
season_flow = our_flow(name="season")(play_seasons)
evaluation_flow = our_flow(name="evaluation")(measure)


report_flow = our_flow(name="report")(report)
paradigms_flow = our_flow(name="paradigms")(play_paradigms)
training_flow = our_flow(name="train")(train_policy)


@cache
def flow_of(noun: str) -> Flow[..., Any]:
    """The flow that makes the new outputs, or the next version, of one stage.

    Args:
        noun: noun of a stage that is computed from others.
    """
    if STAGES[noun].per is Per.VERSION:
        def make(data: Path, settings: Settings = Settings(),
                 history: HistorySettings = HistorySettings()) -> VersionReport:
            return make_version(noun, data, settings, history)
    else:
        def make(data: Path, settings: Settings = Settings(), on: str | None = None,  # type: ignore[misc]
                 history: HistorySettings = HistorySettings()) -> StageReport:
            return make_stage(noun, data, settings, on, history)

    made = our_flow(name=noun)(make)
    made.description = f"Make what is new of the {noun}."
    return made
