"""Stages under Prefect: some outputs a task, one flow for each noun."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

from httpx import TransportError
from prefect import Flow, Task, get_run_logger
from prefect.artifacts import create_markdown_artifact
from prefect.task_runners import ThreadPoolTaskRunner
from pydantic import BaseModel

from flows import knowledge, policies
from flows.catalog import look, refresh_into
from flows.jobs import pieces_task, run_pieces, stage_task
from flows.progress import RunReport, StageReport, listener
from flows.stage import Output, Per, Scope, Stage
from flows.stages import STAGES
from flows.update import bring, bring_up_to_date, scope_of
from flows.versions import emit
from pipeline.errors import in_one_line
from pipeline.settings import Settings
from pipeline.store import Store
from pipeline.store.paths import check_root

P = ParamSpec("P")
R = TypeVar("R")

#: Threads that work at once: the kernels release the GIL, polars brings threads of its own.
WORKERS = 2

#: How a version is shown as an artifact of the flow run.
_DESCRIBE = {"knowledge": knowledge.describe, "policies": policies.describe}


def our_flow(*, name: str, threads: int | None = WORKERS) -> Callable[[Callable[P, R]], Flow[P, R]]:
    """A flow of ours: its result is JSON, and its tasks share a few threads.

    Args:
        name: name of the flow.
        threads: number of threads; None: each task gets a thread when it is submitted.
    """

    def decorate(function: Callable[P, R]) -> Flow[P, R]:
        return Flow(
            function, name=name, persist_result=True, result_serializer="json",
            task_runner=cast("Any", ThreadPoolTaskRunner(max_workers=threads)),
        )

    return decorate


@pieces_task(name="make")
def make_output(
    data: Path, stage: str, output: Output, settings: BaseModel, scope: Scope, doubted: frozenset[Path]
) -> bool:
    """Make one output of a stage, unless it is done. Returns whether its bytes are new."""
    store = Store(data)
    store.doubted = doubted
    return STAGES.perform(store, STAGES[stage], output, settings, scope)


@stage_task(name="version")
def make_version(data: Path, name: str, settings: BaseModel, scope: Scope) -> tuple[int, bool]:
    """Make the next version of a noun unless one holds the same. Returns number, and whether it is new."""
    manifest, new = emit(Store(data), STAGES[name], settings, scope)
    return manifest.version, new


class Runner:
    """Makes the stages of one store, as tasks of the running flow."""

    def __init__(self, store: Store) -> None:
        self.store = store

    def perform(
        self, stage: Stage, outputs: Sequence[Output], settings: Settings, scope: Scope
    ) -> StageReport:
        """Make some outputs of a stage, some in each task."""
        own = stage.settings(settings)
        return run_pieces(_named(make_output, stage), stage.noun, {
            output.name: {"data": self.store.root, "stage": stage.noun, "output": output, "settings": own,
                          "scope": scope.of(output), "doubted": self.store.doubted}
            for output in outputs
        })

    def emit(self, stage: Stage, settings: Settings, scope: Scope) -> tuple[int, bool]:
        """Make the next version of a noun unless one holds the same, and show it as an artifact."""
        listener.get().begin(stage.noun, 1)
        version, new = _named(make_version, stage)(
            self.store.root, stage.noun, stage.settings(settings), scope)
        listener.get().advance(stage.noun, stage.noun)
        described = _DESCRIBE[stage.noun](self.store, self.store.manifest(stage.noun, version))
        show(described, key=stage.noun, description=f"the newest of the {stage.noun}")
        return version, new

    def update(self, settings: Settings, report: RunReport, *, train: bool) -> None:
        """Bring all stages up to date."""
        bring_up_to_date(self.store, settings, report, self.perform, self.emit, train=train)


def _named(job: Task[P, R], stage: Stage) -> Task[P, R]:
    """A task under the name of its stage."""
    return job.with_options(name=stage.noun, task_run_name=f"{stage.noun} {{name}}")


@cache
def flow_of(noun: str) -> Flow[..., dict[str, object]]:
    """The flow that makes the new outputs of one stage, for all matches that are not in quarantine.

    Args:
        noun: of a stage that is computed from others.
    """
    stage = STAGES[noun]

    @our_flow(name=stage.noun)
    def make_all(data: Path, settings: Settings = Settings()) -> dict[str, object]:
        store = data_folder(data)
        scope, runner = scope_of(store), Runner(store)
        if stage.per is Per.VERSION:
            version, new = runner.emit(stage, settings, scope)
            report = StageReport(noun=stage.noun)
            refresh_into(store, report)
            return {"version": version, "new": new, "failed": report.failed}
        run = RunReport()
        bring(store, stage, stage.outputs(scope), settings, scope, run, runner.perform)
        return conclude(store, run.stage(stage.noun))

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
    check_root(data)
    store = Store(data)
    store.sweep()
    look(store)
    return store
