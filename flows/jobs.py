"""Pieces of work as Prefect's tasks: some pieces a task, and a failed piece stops no other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, ParamSpec, TypeVar

from prefect import Task
from prefect.cache_policies import NO_CACHE
from prefect.client.schemas.objects import State, TaskRun
from prefect.futures import PrefectFuture, as_completed
from prefect.utilities.annotations import quote

from flows.progress import StageReport, listener
from flows.workers import cores
from pipeline.errors import in_one_line

P = ParamSpec("P")
R = TypeVar("R")

#: Arguments of each piece of work, by its label.
Pieces = Mapping[str, Mapping[str, Any]]

#: Most pieces of work of a task: Prefect takes 28 ms for a task, an output of a short match a few.
AT_ONCE = 32
#: So many tasks for each core, if there is work for them, so that all cores have work to the end.
_TASKS_A_CORE = 4


class SomeFailed(Exception):
    """Some pieces of a task's work have failed.

    Args:
        done: results of the others, by label.
        failed: the error of each in one line, by label.
        transient: whether it may help to try again.
    """

    def __init__(self, done: dict[str, Any], failed: dict[str, str], transient: bool) -> None:
        super().__init__(done, failed, transient)  # so that it comes from another process as itself
        self.done = done
        self.failed = failed
        self.transient = transient

    def __str__(self) -> str:
        return "; ".join(f"{label}: {line}" for label, line in self.failed.items())


def may_succeed_later(_task: Task[Any, Any], _run: TaskRun, state: State[Any]) -> bool:
    """Whether to try a failed task again: only if its error is transient."""
    error = state.result(raise_on_failure=False)
    return bool(getattr(error, "transient", False))


def stage_task(*, name: str) -> Callable[[Callable[P, R]], Task[P, R]]:
    """A task for one piece of work. It retries transient errors only, and caches and pickles nothing."""

    def decorate(function: Callable[P, R]) -> Task[P, R]:
        return Task(
            function, name=name, task_run_name=f"{name} {{name}}", retries=2, retry_delay_seconds=1,
            retry_condition_fn=may_succeed_later, cache_policy=NO_CACHE, persist_result=False,
        )

    return decorate


def pieces_task(*, name: str) -> Callable[[Callable[..., R]], Task[[str, Pieces], dict[str, R]]]:
    """A task that calls a function for some pieces of work, one after the other; else as :func:`stage_task`.

    If it is tried again, all its pieces are: the function does not do again what is done.
    """

    def decorate(function: Callable[..., R]) -> Task[[str, Pieces], dict[str, R]]:
        def work(name: str, pieces: Pieces) -> dict[str, R]:
            done: dict[str, R] = {}
            failed: dict[str, str] = {}
            transient = False
            for label, arguments in pieces.items():
                try:
                    done[label] = function(**arguments)
                except Exception as error:
                    failed[label] = in_one_line(error)
                    transient |= getattr(error, "transient", False)
            if failed:
                raise SomeFailed(done, failed, transient=transient)
            return done

        work.__doc__ = function.__doc__
        return stage_task(name=name)(work)

    return decorate


def run_pieces(
    job: Task[[str, Pieces], dict[str, Any]], noun: str, pieces: Pieces, at_once: int = AT_ONCE
) -> StageReport:
    """Do pieces of work, some in each task. Failures are reported; the others finish.

    A piece whose result is False has made the same bytes again.

    Args:
        job: from :func:`pieces_task`.
        noun: what is made.
        pieces: the arguments of each piece, by its label.
        at_once: most pieces of a task.
    """
    report = StageReport(noun=noun)
    listener.get().begin(noun, len(pieces))
    submit: Any = job.submit
    # quoted: else Prefect looks for futures in every part of the arguments
    futures: dict[PrefectFuture[Any], list[str]] = {
        submit(_named(part), quote({label: pieces[label] for label in part})): part
        for part in _parts(list(pieces), at_once)
    }
    for future in as_completed(list(futures)):
        part, result = futures[future], future.result(raise_on_failure=False)
        if isinstance(result, SomeFailed):
            report.failed |= result.failed
            result = result.done
        elif isinstance(result, BaseException):
            report.failed |= dict.fromkeys(part, in_one_line(result))
            result = {}
        for label, outcome in result.items():
            (report.same if outcome is False else report.made).append(label)
        for label in part:
            listener.get().advance(noun, label)
    report.made.sort()
    report.same.sort()
    return report


def _parts(labels: list[str], at_once: int) -> Iterator[list[str]]:
    """The labels in parts, one for each task."""
    size = max(1, min(at_once, len(labels) // (_TASKS_A_CORE * cores())))
    for begin in range(0, len(labels), size):
        yield labels[begin:begin + size]


def _named(part: list[str]) -> str:
    """Name of a task run."""
    return part[0] if len(part) == 1 else f"{part[0]} and {len(part) - 1} more"
