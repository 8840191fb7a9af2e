"""Pieces of work on a data folder: import, run, make one stage, train. Each is noted in the folder's log.

Commands call them; ``flows/`` hands the same functions to Prefect. They run in this process, whose executors
(:mod:`pipeline.engine.placement`) and runner (:mod:`pipeline.engine.tasks`) say where and how.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain
from pathlib import Path

from pydantic import BaseModel

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine import knowledge, policies
from pitchlore.pipeline.engine.catalog import check_files, refresh_after, refresh_into
from pitchlore.pipeline.engine.costs import Cost, Spent, spending
from pitchlore.pipeline.engine.freshness import Standing
from pitchlore.pipeline.engine.history import LOG, noted
from pitchlore.pipeline.engine.imports import import_all
from pitchlore.pipeline.engine.lacking import lacking
from pitchlore.pipeline.engine.making import Outcome, make
from pitchlore.pipeline.engine.placement.executors import executors
from pitchlore.pipeline.engine.placement.pieces import Failure
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.progress import RunReport, StageReport, listener
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.stage import Output, Scope, Stage
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.tasks import carried_out, runner
from pitchlore.pipeline.engine.update import (
    bring,
    bring_up_to_date,
    group_name,
    look_for_damage,
    scope_of,
    standing_version,
)
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.settings import HistorySettings, ImportSettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.paths import check_root

#: The copy of a bucket that the command has brought up to date so many seconds ago is up to date.
_YOUNG_S = 5.0
#: What the log calls the making of a noun that has a command.
_COMMANDS = {"policies": "train"}
#: A version in words, for people.
_DESCRIBE = {"knowledge": knowledge.describe, "policies": policies.describe}


class VersionReport(BaseModel):
    """Outcome of the making of a version.

    Attributes:
        version: the newest version.
        new: whether it was made now.
        failed: the reason, if the catalogue or the log could not be written, by its name.
        cost: cost of the work.
    """

    version: int
    new: bool
    failed: dict[str, str] = {}
    cost: Cost = Cost()


def run(
    data: Path, recordings: list[Recording] | None = None, settings: Settings = Settings(),
    train: bool = True, limits: ImportSettings = ImportSettings(), on: str | None = None,
    history: HistorySettings = HistorySettings(),
    finish: Callable[[Store, RunReport], None] | None = None,
) -> RunReport:
    """Import new recordings, and bring every stage up to date.

    Args:
        data: the data folder.
        recordings: files to import; None takes the inbox.
        settings: settings of the stages.
        train: whether to make a policy when the knowledge is new.
        limits: bounds of the cost of reading a recording.
        on: where work is done, as for :func:`pipeline.engine.placement.places.place_of`.
        history: how much of past runs is remembered.
        finish: called last, for work on top of the stages, such as pages; its failures go into the report.

    Raises:
        BadSettings: if ``data`` is not a folder, or ``on`` names no place.
        PitchloreError: by which all work would fail: the folder, the bucket or the cluster cannot be used.
    """
    store = swept(data)  # damage is looked for after the import
    with noted(store, "run", history) as note:
        report = note.report
        with placed(on, store.root):
            with report.leg("import"):
                report.stages.append(import_all(store, recordings, limits))
            with report.leg("look for damage"):
                catalogue = look_for_damage(store, report)
            standing = Standing.of(store, catalogue, settings, train=train)
            if standing is None or not standing.tell(report):
                failed = len(report.failures)
                bring_up_to_date(
                    store, settings, report, partial(perform, store), partial(emit_next, store), train=train)
                if standing is not None and not report.made and len(report.failures) == failed:
                    standing.keep(report)
            with report.leg("catalogue"):
                refresh_after(store, report)
            if finish is not None:
                with report.leg("pages"):
                    finish(store, report)
    runner.get().show(report.markdown, key="run", description="what the run did")
    return report


def import_recordings(
    data: Path, recordings: list[Recording] | None = None, limits: ImportSettings = ImportSettings(),
    on: str | None = None, history: HistorySettings = HistorySettings(),
) -> StageReport:
    """Import recordings, by default those in the inbox; arguments and errors as for :func:`run`."""
    store = suspecting(data)
    with noted(store, "import", history) as note, placed(on, store.root):
        report = import_all(store, recordings, limits)
        note.report.stages.append(report)
    report.failed |= note.report.stage(LOG).failed
    return concluded(store, report)


def make_stage(
    noun: str, data: Path, settings: Settings = Settings(), on: str | None = None,
    history: HistorySettings = HistorySettings(),
) -> StageReport:
    """Make what is new of a stage, for all matches that are not in quarantine; errors as for :func:`run`."""
    store = suspecting(data)
    with noted(store, noun, history) as note, placed(on, store.root):
        bring(store, (STAGES[noun],), settings, scope_of(store), note.report, partial(perform, store))
    report = note.report.stage(noun)
    report.failed |= note.report.stage(LOG).failed
    return concluded(store, report)


def make_version(
    noun: str, data: Path, settings: Settings = Settings(), history: HistorySettings = HistorySettings(),
) -> VersionReport:
    """Make the next version of a noun, unless one holds the same.

    Raises:
        NotFound: if there is nothing to know or to learn from.
    """
    store, stage = suspecting(data), STAGES[noun]
    scope = scope_of(store)
    with noted(store, _COMMANDS.get(noun, noun), history) as note:
        if nothing := lacking(store, scope):
            raise NotFound(nothing[0], where=store.where, next_step="See pitchlore run")
        version, new, spent = emit_next(store, stage, settings, scope)
        cost = Cost()
        cost.add(f"version {version}", spent)
        note.report.add_version(noun, version, cost, new=new)
    report = note.report.stage(LOG)
    refresh_into(store, report)
    return VersionReport(version=version, new=new, failed=report.failed, cost=cost)


def train_policy(
    data: Path, settings: Settings = Settings(), history: HistorySettings = HistorySettings()
) -> VersionReport:
    """Train the next policy version on the newest knowledge, unless a version has learned all of it.

    Raises:
        NotFound: if there is nothing to know or to learn from.
    """
    return make_version("policies", data, settings, history)


def perform(
    store: Store, todo: Mapping[Output, Sequence[Stage]], settings: Settings, scope: Scope
) -> Iterator[tuple[Output, Outcome]]:
    """Make outputs, each by some stages in order; a :data:`pipeline.engine.update.Perform`.

    Yields:
        Each output with its outcome, as tasks end.
    """
    nouns = {output: [stage.noun for stage in stages] for output, stages in todo.items()}
    counts = Counter(chain.from_iterable(nouns.values()))
    for noun in counts:
        listener.get().begin(noun, counts[noun])
    outputs = {output.name: output for output in todo}
    path = executors.get().path
    root, suspect = path(store.root), frozenset(map(path, store.suspect))
    for name, result in carried_out(group_name(counts), make, {
        name: {"data": root, "nouns": nouns[output], "output": output, "settings": settings,
               "scope": scope.of(output), "suspect": suspect}
        for name, output in outputs.items()
    }):
        output = outputs[name]
        lost = isinstance(result, Failure)
        outcome = Outcome({}, {nouns[output][0]: result.line}) if lost else result
        for noun in outcome.made:
            listener.get().advance(noun, name)
        yield output, outcome


def emit_next(store: Store, stage: Stage, settings: Settings, scope: Scope) -> tuple[int, bool, Spent]:
    """Make the next version of a noun unless one holds the same; a :data:`pipeline.engine.update.Emit`."""
    found = standing_version(store, stage, settings, scope)
    if found is not None:
        return found.version, False, Spent()
    listener.get().begin(stage.noun, 1)
    version, new, spent = runner.get().call(
        stage.noun, stage.noun, _emitted, store.root, stage.noun, stage.settings(settings), scope)
    listener.get().advance(stage.noun, stage.noun)
    runner.get().show(
        lambda: _DESCRIBE[stage.noun](store, store.manifest(stage.noun, version)), key=stage.noun,
        description=f"the newest of the {stage.noun}")
    return version, new, spent


def _emitted(data: Path, noun: str, settings: BaseModel, scope: Scope) -> tuple[int, bool, Spent]:
    with spending() as spent:
        manifest, new = emit(Store(data), STAGES[noun], settings, scope)
        return manifest.version, new, spent()


def concluded(store: Store, report: StageReport) -> StageReport:
    """The report, after the catalogue was brought up to date and the report was shown."""
    refresh_into(store, report)
    runner.get().show(report.markdown, key=report.noun, description="what was made")
    return report


def suspecting(data: Path) -> Store:
    """The store of a run, without the leftovers of killed runs; it suspects damaged files.

    Raises:
        BadSettings, StorageFailed: as for :func:`swept`.
    """
    store = swept(data)
    check_files(store)
    return store


def swept(data: Path) -> Store:
    """The store of a run, without the leftovers of killed runs.

    Raises:
        BadSettings: as for :func:`pipeline.store.paths.check_root`.
        StorageFailed: if it is in a bucket that cannot be reached.
    """
    store = Store(data)
    check_root(store.root)
    store.catch_up(within=_YOUNG_S)
    store.sweep()
    return store
