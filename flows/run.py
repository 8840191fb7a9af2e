"""The flow of a run: import new recordings, and bring every stage up to date."""

from pathlib import Path
from typing import Any

from pitchlore.flows.imports import import_all
from pitchlore.flows.pruning import prune_or_say
from pitchlore.flows.tasks import Runner, our_flow, show, swept
from pitchlore.pipeline.engine.catalog import refresh_after
from pitchlore.pipeline.engine.history import noted
from pitchlore.pipeline.engine.matches import Recording
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.update import look_for_damage
from pitchlore.pipeline.settings import HistorySettings, ImportSettings, ScoutSettings, Settings
from pitchlore.pipeline.views.scout.content.write import write_after


@our_flow(name="run")
def run_flow(
    data: Path, recordings: list[Recording] | None = None, settings: Settings = Settings(),
    train: bool = True, limits: ImportSettings = ImportSettings(), on: str | None = None,
    history: HistorySettings = HistorySettings(), scout: ScoutSettings = ScoutSettings(),
) -> dict[str, Any]:
    """Import the new recordings of the inbox (or ``recordings``), and bring every stage up to date.

    The scout's pages follow where the settings say so.
    """
    store = swept(data)  # damage is looked for after the import
    with noted(store, "run", history) as note:
        report = note.report
        with placed(on, store.root):
            report.stages.append(import_all(store, recordings, limits))
            look_for_damage(store, report)
            Runner(store).update(settings, report, train=train)
            refresh_after(store, report)
            if scout.refresh:
                write_after(store, report)
    prune_or_say(history)
    show(report.markdown(), key="run", description="what the run did")
    return report.model_dump()
