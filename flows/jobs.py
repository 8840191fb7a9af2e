"""Pieces of work as Prefect's tasks: some pieces a task, and a failed piece stops no other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, ParamSpec, TypeVar

from prefect import Task
from prefect.cache_policies import NO_CACHE
from prefect.client.schemas.objects import State, TaskRun
from prefect.futures import PrefectFuture, as_completed
from prefect.utilities.annotations import quote

from pitchlore.pipeline.base.errors import in_one_line
from pitchlore.pipeline.engine.costs import Costed, costed
from pitchlore.pipeline.engine.placement.crew import crew
from pitchlore.pipeline.engine.placement.pieces import Failure, Part, Pieces, parted
from pitchlore.pipeline.engine.progress import StageReport, listener

P = ParamSpec("P")
R = TypeVar("R")

#: Most pieces of work of a task: Prefect takes 28 ms for a task, an output of a short match a few.
AT_ONCE = 32


def may_succeed_later(_task: Task[Any, Any], _run: TaskRun, state: State[Any]) -> bool:
    """Whether to try a failed task again: only if its error is transient."""
    error = state.result(raise_on_failure=False)
    return bool(getattr(error, "transient", False))


def stage_task(*, name: str) -> Callable[[Callable[P, R]], Task[P, R]]:
    """A task for a piece of work. It retries transient errors only, and caches and pickles nothing."""

    def decorate(function: Callable[P, R]) -> Task[P, R]:
        return Task(
            function, name=name, task_run_name=f"{name} {{name}}", retries=2, retry_delay_seconds=1,
            retry_condition_fn=may_succeed_later, cache_policy=NO_CACHE, persist_result=False,
        )

    return decorate


@stage_task(name="pieces")
def do_part(name: str, part: Part) -> None:
    """Give some pieces of work to the crew."""
    part.do()


def carried_out(
    name: str, function: Callable[..., Any], pieces: Pieces, at_once: int = AT_ONCE
) -> Iterator[tuple[str, Any]]:
    """Do pieces of work as tasks of the running flow, some in each; the crew is that of the flow.

    Args:
        name: of the tasks.
        function: of a module; does a piece, and does not do again what is done.
        pieces: its named arguments, by label.
        at_once: most pieces of a task.

    Yields:
        Label and result of each piece, or its :class:`pipeline.engine.placement.pieces.Failure`, as tasks
        end.

    Raises:
        PitchloreError: by which all others would fail, too: the cluster or the bucket cannot be used.
    """
    task = do_part.with_options(name=name, task_run_name=f"{name} {{name}}")
    submit: Any = task.submit
    workers = crew.get()
    parts = list(parted(pieces, at_once, workers.width))
    if len(parts) == 1:
        workers = workers.alone()
    running: dict[PrefectFuture[Any], Part] = {}
    waiting = iter(parts)
    while True:
        while len(running) < workers.width and (some := next(waiting, None)) is not None:
            part = Part(workers, function, some)
            # quoted: else Prefect looks for futures in every part of the arguments
            running[submit(_named(list(some)), quote(part))] = part
        if not running:
            return
        future = next(iter(as_completed(list(running))))
        part, error = running.pop(future), future.result(raise_on_failure=False)
        if error is not None and getattr(error, "for_all", False):
            raise error
        for label in part.pieces:
            yield label, part.results[label] if label in part.results else Failure(in_one_line(error))


def run_pieces(
    function: Callable[..., Any], noun: str, pieces: Pieces, at_once: int = AT_ONCE, *, task: str = ""
) -> StageReport:
    """Do pieces of work that each make an output of a noun. Failures are reported; the others finish.

    Args:
        function: as for :func:`carried_out`.
        noun: what is made.
        pieces: the arguments of each piece, by its label.
        at_once: most pieces of a task.
        task: name of the tasks, by default the noun.
    """
    report = StageReport(noun=noun)
    listener.get().begin(noun, len(pieces))
    measured = {label: {"function": function, "arguments": arguments} for label, arguments in pieces.items()}
    for label, result in carried_out(task or noun, costed, measured, at_once):
        if isinstance(result, Failure):
            report.failed[label] = result.line
        else:
            assert isinstance(result, Costed)
            report.made.append(label)
            report.cost.add(label, result.spent)
        listener.get().advance(noun, label)
    report.made.sort()
    return report


def _named(part: list[str]) -> str:
    """Name of a task run."""
    return part[0] if len(part) == 1 else f"{part[0]} and {len(part) - 1} more"
