"""Stages under Prefect: some outputs a task, one flow for each noun."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

from httpx import TransportError
from prefect import Flow, get_run_logger
from prefect.artifacts import create_markdown_artifact
from prefect.task_runners import ThreadPoolTaskRunner
from pydantic import BaseModel

from pitchlore.flows.jobs import carried_out, stage_task
from pitchlore.flows.pruning import OURS, prune_or_say
from pitchlore.pipeline.base.errors import NotFound, in_one_line
from pitchlore.pipeline.engine import knowledge, policies
from pitchlore.pipeline.engine.catalog import look, refresh_into
from pitchlore.pipeline.engine.costs import Cost, Spent, spending
from pitchlore.pipeline.engine.history import LOG, noted
from pitchlore.pipeline.engine.lacking import lacking
from pitchlore.pipeline.engine.making import Outcome, make
from pitchlore.pipeline.engine.placement.crew import crew
from pitchlore.pipeline.engine.placement.pieces import Failure
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.progress import RunReport, StageReport, listener
from pitchlore.pipeline.engine.stage import Output, Per, Scope, Stage
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import bring, bring_up_to_date, scope_of
from pitchlore.pipeline.engine.versions import emit
from pitchlore.pipeline.settings import HistorySettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.paths import check_root

P = ParamSpec("P")
R = TypeVar("R")

#: The copy of a bucket that the command has brought up to date so many seconds ago is up to date.
_YOUNG_S = 5.0
#: The commands that are the flow of a single stage.
_COMMANDS = {"policies": "train"}
#: How a version is shown as an artifact of the flow run.
_DESCRIBE = {"knowledge": knowledge.describe, "policies": policies.describe}


def our_flow(*, name: str) -> Callable[[Callable[P, R]], Flow[P, R]]:
    """A flow of ours: its result is JSON; each of its tasks has a thread, and gives work to a crew."""

    def decorate(function: Callable[P, R]) -> Flow[P, R]:
        return Flow(
            function, name=name, version=OURS, persist_result=True, result_serializer="json",
            task_runner=cast("Any", ThreadPoolTaskRunner()),
        )

    return decorate


@stage_task(name="version")
def make_version(data: Path, name: str, settings: BaseModel, scope: Scope) -> tuple[int, bool, Spent]:
    """Make the next version of a noun unless one holds the same.

    Returns:
        Its number, whether it is new, and what was spent.
    """
    with spending() as spent:
        manifest, new = emit(Store(data), STAGES[name], settings, scope)
        return manifest.version, new, spent()


class Runner:
    """Makes the stages of one store, as tasks of the running flow."""

    def __init__(self, store: Store) -> None:
        self.store = store

    def perform(
        self, todo: Mapping[Output, Sequence[Stage]], settings: Settings, scope: Scope
    ) -> Iterator[tuple[Output, Outcome]]:
        """Make outputs, each by some stages in order, some outputs in each task.

        Yields:
            Each output with its outcome, as tasks end.
        """
        nouns = {output: [stage.noun for stage in stages] for output, stages in todo.items()}
        counts = Counter(chain.from_iterable(nouns.values()))
        for noun in counts:
            listener.get().begin(noun, counts[noun])
        outputs = {output.name: output for output in todo}
        path = crew.get().path
        data, doubted = path(self.store.root), frozenset(map(path, self.store.doubted))
        for name, result in carried_out(_leg(counts), make, {
            name: {"data": data, "nouns": nouns[output], "output": output, "settings": settings,
                   "scope": scope.of(output), "doubted": doubted}
            for name, output in outputs.items()
        }):
            output = outputs[name]
            for noun in nouns[output]:
                listener.get().advance(noun, name)
            lost = isinstance(result, Failure)
            yield output, Outcome({}, {nouns[output][0]: result.line}) if lost else result

    def emit(self, stage: Stage, settings: Settings, scope: Scope) -> tuple[int, bool, Spent]:
        """Make the next version of a noun unless one holds the same, and show it as an artifact."""
        listener.get().begin(stage.noun, 1)
        task = make_version.with_options(name=stage.noun, task_run_name=f"{stage.noun} {{name}}")
        version, new, spent = task(self.store.root, stage.noun, stage.settings(settings), scope)
        listener.get().advance(stage.noun, stage.noun)
        described = _DESCRIBE[stage.noun](self.store, self.store.manifest(stage.noun, version))
        show(described, key=stage.noun, description=f"the newest of the {stage.noun}")
        return version, new, spent

    def update(self, settings: Settings, report: RunReport, *, train: bool) -> None:
        """Bring all stages up to date."""
        bring_up_to_date(self.store, settings, report, self.perform, self.emit, train=train)


def _leg(nouns: Iterable[str]) -> str:
    """The name of a leg: its first stage, and its last."""
    first, *others = nouns
    return f"{first} to {others[-1]}" if others else first


@cache
def flow_of(noun: str) -> Flow[..., dict[str, object]]:
    """The flow that makes the new outputs of one stage, for all matches that are not in quarantine.

    Args:
        noun: of a stage that is computed from others.
    """
    stage = STAGES[noun]

    @our_flow(name=stage.noun)
    def make_all(
        data: Path, settings: Settings = Settings(), on: str | None = None,
        history: HistorySettings = HistorySettings(),
    ) -> dict[str, object]:
        store = data_folder(data)
        scope, runner = scope_of(store), Runner(store)
        with noted(store, _COMMANDS.get(stage.noun, stage.noun), history) as note:
            if stage.per is Per.VERSION:
                if nothing := lacking(store, scope):
                    raise NotFound(nothing[0], where=store.where, next_step="See pitchlore run")
                version, new, spent = runner.emit(stage, settings, scope)
                cost = Cost()
                cost.add(f"version {version}", spent)
                note.report.add_version(stage.noun, version, cost, new=new)
            else:
                with placed(on, store.root):
                    bring(store, (stage,), settings, scope, note.report, runner.perform)
        prune_or_say(history)
        if stage.per is not Per.VERSION:
            report = note.report.stage(stage.noun)
            report.failed |= note.report.stage(LOG).failed
            return conclude(store, report)
        report = note.report.stage(LOG)
        refresh_into(store, report)
        return {"version": version, "new": new, "failed": report.failed, "cost": cost.model_dump()}

    make_all.description = f"Make what is new of the {stage.noun}."
    return make_all


def conclude(store: Store, report: StageReport) -> dict[str, object]:
    """Bring the catalogue up to date, and show the report as an artifact. Returns the flow's result."""
    refresh_into(store, report)
    show(report.markdown(), key=report.noun, description="what the flow made")
    return report.model_dump()


def show(markdown: str, *, key: str, description: str) -> None:
    """Show a text as an artifact of the flow run. A server that refuses it is logged, and ends no flow.

    Raises:
        TransportError: if the server does not answer: then the flow cannot end well either.
    """
    try:
        create_markdown_artifact(markdown, key=key, description=description)
    except TransportError:
        raise
    except Exception as error:
        get_run_logger().warning("The artifact %s could not be kept (%s).", key, in_one_line(error))


def data_folder(data: Path) -> Store:
    """The store of a run, without the leftovers of killed runs; it doubts damaged files.

    Raises:
        BadSettings: as for :func:`pipeline.store.paths.check_root`.
    """
    store = swept(data)
    look(store)
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
