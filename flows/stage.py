"""What every stage's flow shares: doing only what is new, committing, quarantining, reporting."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, ParamSpec, Protocol, TypeVar, cast

import polars as pl
from prefect import Flow, Task
from prefect.artifacts import create_markdown_artifact
from prefect.cache_policies import NO_CACHE
from prefect.client.schemas.objects import State, TaskRun
from prefect.futures import as_completed
from prefect.task_runners import ThreadPoolTaskRunner
from pydantic import BaseModel, ConfigDict

from flows.catalog import match_of, refresh
from pipeline.errors import BadSettings, CorruptFile, NotFound, in_one_line
from pipeline.settings import Settings
from pipeline.store import Store
from pipeline.store.receipts import Receipt, key_of
from schemas import Table

S = TypeVar("S", bound=BaseModel)
P = ParamSpec("P")
R = TypeVar("R")

#: Threads that work at once: the kernels release the GIL, polars brings threads of its own.
WORKERS = 2


class Listener(Protocol):
    """Who wants to know how far a run is (the command line's progress bars)."""

    def begin(self, noun: str, total: int) -> None:
        """A stage starts with so many pieces of work to do."""

    def advance(self, noun: str, name: str) -> None:
        """A piece of a stage's work has ended."""


class Silence:
    """A listener that does nothing."""

    def begin(self, noun: str, total: int) -> None:
        """Do nothing."""

    def advance(self, noun: str, name: str) -> None:
        """Do nothing."""


listener: ContextVar[Listener] = ContextVar("listener", default=Silence())  # noqa: B039 (Silence has no state)


class StageReport(BaseModel):
    """What a stage did.

    Attributes:
        noun: the stage.
        made: the outputs made anew.
        kept: how many outputs were already there.
        failed: the outputs that could not be made, with the reason.
        notes: what else somebody may want to know, a line each.
    """

    noun: str
    made: list[str] = []
    kept: int = 0
    failed: dict[str, str] = {}
    notes: list[str] = []


class Scope(BaseModel):
    """What a run is over; what is made of all matches is made of these.

    Attributes:
        matches: their ids, sorted.
        lengths: of the grams, longest first.
        group: None if behaviours are of the whole store; else the id of the one match that they are
            of, so that learning from a new match costs the same however many there are.
    """

    model_config = ConfigDict(frozen=True)

    matches: tuple[str, ...]
    lengths: tuple[int, ...]
    group: str | None = None

    def round(self, n: int) -> str:
        """The name of the output of the round over grams of length ``n``: ``n4``, ``<group>.n4``."""
        return f"n{n}" if self.group is None else f"{self.group}.n{n}"

    def longer(self, n: int) -> list[int]:
        """The lengths over ``n``, longest first."""
        return [length for length in self.lengths if length > n]


@dataclass(frozen=True, slots=True)
class Made:
    """What a stage computed: tables (each file is named for its table), other files, facts."""

    tables: Sequence[tuple[pl.DataFrame, type[Table]]] = ()
    blobs: Mapping[str, tuple[str, bytes]] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)


class Source(Protocol):
    """What an output is made from."""

    def digests(self) -> dict[str, str]:
        """SHA-256 by label."""


@dataclass(frozen=True, slots=True)
class Stage(Generic[S]):
    """How one noun is made from others, one output at a time.

    Attributes:
        noun: the stage.
        schemas: of the tables it makes.
        sources: store, name and scope in, what an output is made from out: receipts, mostly.
        compute: store, name, settings and scope in, what was made out.
    """

    noun: str
    schemas: tuple[type[Table], ...]
    sources: Callable[[Store, str, Scope], Iterable[Source]]
    compute: Callable[[Store, str, S, Scope], Made]

    def done(self, store: Store, name: str, settings: S, scope: Scope) -> bool:
        """Whether the output is already there, made from these very inputs with these settings."""
        try:
            return store.holding(self.noun, name, self._key(store, name, settings, scope)[0]) is not None
        except (NotFound, CorruptFile):
            return False

    def perform(self, store: Store, name: str, settings: S, scope: Scope) -> Receipt:
        """Make and commit an output.

        Raises:
            Exception: whatever the stage raised; unless trying again may help, or what it is made
                from is missing, the output's name is put in quarantine with the reason first.
        """
        try:
            key, inputs = self._key(store, name, settings, scope)
            made = self.compute(store, name, settings, scope)
            receipt = store.commit(
                self.noun, name, key, inputs=inputs, settings=settings.model_dump(mode="json"),
                tables={schema.NAME: (table, schema) for table, schema in made.tables},
                blobs=made.blobs, details=made.details,
            )
        except Exception as error:
            if not getattr(error, "transient", False) and not isinstance(error, NotFound):
                store.quarantine(self.noun, name, error)
            raise
        store.release(self.noun, name)
        return receipt

    def _key(self, store: Store, name: str, settings: S, scope: Scope) -> tuple[str, dict[str, str]]:
        inputs: dict[str, str] = {}
        for source in self.sources(store, name, scope):
            inputs |= source.digests()
        dumped = settings.model_dump(mode="json")
        return key_of(self.noun, name, inputs=inputs, settings=dumped, tables=self.schemas), inputs


def need(store: Store, noun: str, name: str) -> Receipt:
    """The receipt of an output that a stage is made from.

    Raises:
        NotFound: if it has not been made.
    """
    receipt = store.receipt(noun, name)
    if receipt is None:
        raise NotFound(f"{noun} of {name} have not been made", where=str(store.root),
                       next_step=f"Run the stage {noun} first (`pitchlore run` runs them all)")
    return receipt


def match_names(store: Store) -> list[str]:
    """The ids of all matches in the store, sorted."""
    return [receipt.name for receipt in store.receipts("matches")]


def scope_of(store: Store, settings: Settings) -> Scope:
    """The scope of a single stage's flow: all matches that no stage has in quarantine."""
    bad = {match_of(record.name) for record in store.quarantined()}
    return Scope(
        matches=tuple(name for name in match_names(store) if name not in bad),
        lengths=tuple(round_.n for round_ in settings.behaviours.rounds),
    )


def may_succeed_later(_task: Task[Any, Any], _run: TaskRun, state: State[Any]) -> bool:
    """Whether a failed task is worth trying again: only when its error says so."""
    error = state.result(raise_on_failure=False)
    return bool(getattr(error, "transient", False))


def stage_task(*, name: str) -> Callable[[Callable[P, R]], Task[P, R]]:
    """A task that makes one output; tried again only where that may help, nothing cached or pickled."""

    def decorate(function: Callable[P, R]) -> Task[P, R]:
        return Task(
            function, name=name, task_run_name=f"{name} {{name}}", retries=2, retry_delay_seconds=1,
            retry_condition_fn=may_succeed_later, cache_policy=NO_CACHE, persist_result=False,
        )

    return decorate


def our_flow(*, name: str, threads: int | None = WORKERS) -> Callable[[Callable[P, R]], Flow[P, R]]:
    """A flow of ours: its result is JSON, its tasks share a few threads.

    Args:
        name: of the flow.
        threads: None: a task has a thread as soon as it is submitted.
    """

    def decorate(function: Callable[P, R]) -> Flow[P, R]:
        return Flow(
            function, name=name, persist_result=True, result_serializer="json",
            task_runner=cast("Any", ThreadPoolTaskRunner(max_workers=threads)),
        )

    return decorate


def task_of(stage: Stage[Any]) -> Task[..., str]:
    """The task that makes one output of a stage and returns its receipt's key."""

    @stage_task(name=stage.noun)
    def make(data: Path, name: str, settings: BaseModel, scope: Scope) -> str:
        return stage.perform(Store(data), name, settings, scope).key

    return make


def flow_of(
    stage: Stage[Any], job: Task[..., Any], names: Callable[[Scope], Sequence[str]]
) -> Flow[..., dict[str, object]]:
    """The flow that makes what is new of a stage, for all matches that no stage has in quarantine."""

    @our_flow(name=stage.noun)
    def make_all(data: Path, settings: Settings = Settings()) -> dict[str, object]:
        store = data_folder(data)
        scope = scope_of(store, settings)
        report = run_stage(job, stage, store, names(scope), getattr(settings, stage.noun), scope)
        return conclude(store, report)

    make_all.description = f"Make what is new of the {stage.noun}."
    return make_all


def run_stage(
    job: Task[..., Any], stage: Stage[S], store: Store, names: Sequence[str], settings: S, scope: Scope
) -> StageReport:
    """Make what is new of a stage, all outputs with the same settings (see :func:`run_each`)."""
    return run_each(job, stage, store, dict.fromkeys(names, settings), scope)


def run_each(
    job: Task[..., Any], stage: Stage[S], store: Store, settings: Mapping[str, S], scope: Scope
) -> StageReport:
    """Make what is new of a stage: a task for each output, none for what is already there.

    Args:
        job: from :func:`task_of`.
        stage: of the outputs.
        store: where they are.
        settings: by the name of the output.
        scope: of all of them.
    """
    todo = {name: own for name, own in settings.items() if not stage.done(store, name, own, scope)}
    report = run_tasks(job, stage.noun, {
        name: {"data": store.root, "name": name, "settings": own, "scope": scope}
        for name, own in todo.items()
    })
    for name in settings.keys() - todo.keys():
        store.release(stage.noun, name)
    report.kept = len(settings) - len(todo)
    return report


def run_tasks(job: Task[..., Any], noun: str, work: Mapping[str, Mapping[str, Any]]) -> StageReport:
    """Run one task a piece of work (label to arguments); failures are reported, the others finish."""
    report = StageReport(noun=noun)
    listener.get().begin(noun, len(work))
    futures = {job.submit(**arguments): label for label, arguments in work.items()}
    for future in as_completed(list(futures)):
        label = futures[future]
        result = future.result(raise_on_failure=False)
        if isinstance(result, BaseException):
            report.failed[label] = in_one_line(result)
        else:
            report.made.append(label)
        listener.get().advance(noun, label)
    report.made.sort()
    return report


def run_one(job: Task[P, R], noun: str, *args: P.args, **kwargs: P.kwargs) -> R:
    """Run the only task of a stage; its result."""
    listener.get().begin(noun, 1)
    result = job(*args, **kwargs)
    listener.get().advance(noun, noun)
    return result


def conclude(store: Store, report: StageReport) -> dict[str, object]:
    """Bring the catalogue up to date and show the report as an artifact of the flow run; its result."""
    refresh(store)
    lines = [f"{len(report.made)} made, {report.kept} kept, {len(report.failed)} in quarantine", ""]
    lines += [f"- {name}" for name in report.made]
    lines += [f"- **{name}**: {why}" for name, why in report.failed.items()]
    lines += [f"- {note}" for note in report.notes]
    create_markdown_artifact("\n".join(lines), key=report.noun, description="what the flow made")
    return report.model_dump()


def data_folder(data: Path) -> Store:
    """The store of a run, with what killed runs left lying about swept up."""
    if data.exists() and not data.is_dir():
        raise BadSettings("is not a folder", where=str(data), next_step="Name the data folder with --data")
    store = Store(data)
    store.sweep()
    return store
