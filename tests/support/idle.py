"""True if a run would make anything, found without making it."""

from collections.abc import Iterator

from pitchlore.pipeline.engine.costs import Spent
from pitchlore.pipeline.engine.making import Outcome
from pitchlore.pipeline.engine.progress import RunReport, StageReport
from pitchlore.pipeline.engine.stage import Output, Scope, Stage
from pitchlore.pipeline.engine.update import bring_up_to_date, look_for_damage, standing_version
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store


class NewWork(Exception):
    """There is something to make."""


def nothing_new(store: Store, settings: Settings) -> RunReport | None:
    """The report of a run of the stages without work, None if there is something to make."""
    report = RunReport(stages=[StageReport(noun="matches", kept=len(list(store.receipts("matches"))))])
    look_for_damage(store, report)

    def refuse(*_: object) -> Iterator[tuple[Output, Outcome]]:
        raise NewWork

    def standing(stage: Stage, settings: Settings, scope: Scope) -> tuple[int, bool, Spent]:
        found = standing_version(store, stage, settings, scope)
        if found is None:
            raise NewWork
        return found.version, False, Spent()

    try:
        bring_up_to_date(store, settings, report, refuse, standing)
    except NewWork:
        return None
    return report
