"""The engine's tasks as Prefect's: a server shows each task, its tries, and the artifacts of the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast
from urllib.parse import quote as quoted

from httpx import TransportError
from prefect import Task, get_run_logger
from prefect.artifacts import create_markdown_artifact
from prefect.assets import Asset
from prefect.cache_policies import NO_CACHE
from prefect.client.schemas.objects import State, TaskRun
from prefect.context import AssetContext
from prefect.events import emit_event
from prefect.futures import PrefectFuture, as_completed
from prefect.utilities.annotations import quote

from pitchlore.pipeline.base.errors import in_one_line
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.tasks import AGAIN, PAUSE_S, Pool, runner
from pitchlore.pipeline.store import Store

P = ParamSpec("P")
R = TypeVar("R")


def may_succeed_later(_task: Task[Any, Any], _run: TaskRun, state: State[Any]) -> bool:
    """True if a failed task is tried again: only if its error is transient."""
    error = state.result(raise_on_failure=False)
    return bool(getattr(error, "transient", False))


def task_of(work: Callable[P, R], name: str, label: str) -> Task[P, R]:
    """A task for a piece of work. It retries transient errors only, and caches and pickles nothing."""
    return Task(
        work, name=name, task_run_name=lambda: f"{name} {label}", retries=AGAIN,
        retry_delay_seconds=PAUSE_S, retry_condition_fn=may_succeed_later, cache_policy=NO_CACHE,
        persist_result=False,
    )


class PrefectRunner:
    """Carries out tasks as those of the running flow; a :class:`pipeline.engine.tasks.Runner`."""

    @contextmanager
    def pool(self, width: int) -> Iterator[Pool]:
        """The task runner of the flow, whose threads are as many as its tasks."""
        yield _FlowPool()

    def call(self, name: str, label: str, work: Callable[P, R], *given: P.args, **named: P.kwargs) -> R:
        """Carry out one task in this thread."""
        return task_of(lambda: work(*given, **named), name, label)()

    def show(self, text: Callable[[], str], *, key: str, description: str) -> None:
        """Keep a text as an artifact of the flow run. A server that refuses it is logged, and ends no flow.

        Raises:
            TransportError: if the server does not answer: then the flow cannot end well either.
        """
        try:
            create_markdown_artifact(text(), key=key, description=description)
        except TransportError:
            raise
        except Exception as error:
            get_run_logger().warning("The artifact %s could not be kept (%s).", key, in_one_line(error))


def tell_assets(data: Path, report: RunReport) -> None:
    """Tell the server what a run made new, as assets of Prefect's that were materialized.

    An asset is a noun of a data folder, as ``file:///home/me/league/knowledge``. Its event has the number of
    new outputs, or the version, and names the nouns that it was made from. A look that finds nothing new is
    no event.

    Args:
        data: the data folder.
        report: report on the run.
    """
    store = Store(data)
    base = store.where if store.mirror is not None else f"file://{quoted(str(store.root.resolve()))}"
    facts = {stage.noun: {"made": len(stage.made)}
             for stage in report.stages if stage.made and stage.noun in STAGES}
    if report.knowledge_is_new and report.knowledge is not None:
        facts["knowledge"] = {"version": report.knowledge}
    if report.policy_is_new and report.policy is not None:
        facts["policies"] = {"version": report.policy}
    for noun, payload in facts.items():
        sources = [Asset(key=f"{base}/{each}") for each in STAGES[noun].inputs]
        emit_event("prefect.asset.materialization.succeeded", payload=payload,
                   resource=AssetContext.asset_as_resource(Asset(key=f"{base}/{noun}")),
                   related=[AssetContext.asset_as_related(source) for source in sources])


@contextmanager
def as_tasks() -> Iterator[None]:
    """Let the engine's tasks in the body be those of the running flow.

    A flow calls it by its name: Prefect pickles the flow for another process, and no context variable can be.
    """
    token = runner.set(PrefectRunner())
    try:
        yield
    finally:
        runner.reset(token)


class _FlowPool:
    """Tasks that were submitted to the running flow."""

    def __init__(self) -> None:
        self._running: dict[PrefectFuture[object], object] = {}

    def submit(
        self, key: object, name: str, label: str, work: Callable[..., object], *given: object
    ) -> None:
        # quoted: else Prefect looks for futures in every part of the arguments
        submit = cast("Any", task_of(_unquoted, name, label).submit)
        self._running[submit(quote((work, given)))] = key

    def ended(self) -> Iterator[tuple[Any, object]]:
        future = next(iter(as_completed(list(self._running))))
        yield self._running.pop(future), future.result(raise_on_failure=False)

    def __len__(self) -> int:
        return len(self._running)


def _unquoted(task: tuple[Callable[..., object], tuple[object, ...]]) -> object:
    work, given = task
    return work(*given)
