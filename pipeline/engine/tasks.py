"""Tasks of a run: pieces of work at once, a failed one stops no other, and who carries them out.

The engine gives its tasks to a :class:`Runner`. By default that is :class:`Threads` of this process. Under
Prefect it is the flow's (``flows/runner.py``): then a server shows each task, its tries and its artifacts.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, closing, contextmanager
from contextvars import ContextVar, copy_context
from functools import partial
from itertools import islice
from typing import Any, ParamSpec, Protocol, TypeVar

from pitchlore.pipeline.base.errors import in_one_line
from pitchlore.pipeline.engine.costs import Costed, costed
from pitchlore.pipeline.engine.placement.executors import Executors, executors
from pitchlore.pipeline.engine.placement.pieces import Failure, Part, Pieces, parted
from pitchlore.pipeline.engine.progress import StageReport, listener

P = ParamSpec("P")
R = TypeVar("R")

#: Most pieces of work of a task: Prefect takes 28 ms for a task, an output of a short match a few.
AT_ONCE = 32
#: How often a task is tried again whose error is transient, and after how many seconds.
AGAIN, PAUSE_S = 2, 1.0


class Pool(Protocol):
    """Tasks that are carried out at once."""

    def submit(
        self, key: object, name: str, label: str, work: Callable[..., object], *given: object
    ) -> None:
        """Begin a task.

        Args:
            key: identifies the task at its end.
            name: name of this kind of tasks.
            label: label of the task, for people.
            work: done in a thread of this process; a transient error is tried again.
            given: arguments of the work.
        """

    def ended(self) -> Iterator[tuple[Any, object]]:
        """Wait until a task ends: key and result, or exception, of each that has ended."""

    def __len__(self) -> int:
        """Number of tasks that have begun and not ended."""


class Runner(Protocol):
    """Carries out the tasks of a run, and shows what it did."""

    def pool(self, width: int) -> AbstractContextManager[Pool]:
        """Room for some tasks at once."""

    def call(self, name: str, label: str, work: Callable[P, R], *given: P.args, **named: P.kwargs) -> R:
        """Carry out one task in this thread; a transient error is tried again.

        Raises:
            Exception: whatever the work raised at last.
        """

    def show(self, text: Callable[[], str], *, key: str, description: str) -> None:
        """Show a text in Markdown beside the run, where somebody can see it.

        Args:
            text: makes it, if it is shown.
            key: name of the text; a later one of the same name succeeds it.
            description: description of the text.
        """


class Threads:
    """Carries out tasks in threads of this process. Nobody sees what is shown."""

    @contextmanager
    def pool(self, width: int) -> Iterator[Pool]:
        """As many threads as tasks at once."""
        with ThreadPoolExecutor(width) as threads:
            yield _ThreadPool(threads)

    def call(self, name: str, label: str, work: Callable[P, R], *given: P.args, **named: P.kwargs) -> R:
        """Carry out one task in this thread."""
        return patiently(work, *given, **named)

    def show(self, text: Callable[[], str], *, key: str, description: str) -> None:
        """Do nothing."""


class _ThreadPool:
    """A :class:`Pool` over threads. Each task has the context of its submission."""

    def __init__(self, threads: ThreadPoolExecutor) -> None:
        self._threads = threads
        self._running: dict[Future[object], object] = {}

    def submit(
        self, key: object, name: str, label: str, work: Callable[..., object], *given: object
    ) -> None:
        context = copy_context()
        self._running[self._threads.submit(lambda: context.run(patiently, work, *given))] = key

    def ended(self) -> Iterator[tuple[Any, object]]:
        for future in wait(self._running, return_when=FIRST_COMPLETED).done:
            error = future.exception()
            yield self._running.pop(future), future.result() if error is None else error

    def __len__(self) -> int:
        return len(self._running)


#: Carries out the tasks of what runs now.
runner: ContextVar[Runner] = ContextVar("runner", default=Threads())  # noqa: B039 (it has no state)


def patiently(work: Callable[P, R], *given: P.args, **named: P.kwargs) -> R:
    """Do a piece of work; after a transient error again, at most :data:`AGAIN` times."""
    for _ in range(AGAIN):
        try:
            return work(*given, **named)
        except Exception as error:
            if not getattr(error, "transient", False):
                raise
        time.sleep(PAUSE_S)
    return work(*given, **named)


def carried_out(
    name: str, function: Callable[..., Any], pieces: Pieces, at_once: int = AT_ONCE
) -> Iterator[tuple[str, Any]]:
    """Do pieces of work, some in each task; the executors are those of the run.

    Args:
        name: name of the tasks.
        function: function of a module; does a piece, and does not do again what is done.
        pieces: its named arguments, by label.
        at_once: most pieces of a task.

    Yields:
        Label and result of each piece, or its :class:`pipeline.engine.placement.pieces.Failure`, as tasks
        end.

    Raises:
        PitchloreError: by which all others would fail, too: the cluster or the bucket cannot be used.
    """
    workers = executors.get().for_pieces(len(pieces))
    parts = list(parted(pieces, at_once, workers.width))
    waiting = (Part(workers, function, some) for some in parts)
    tasks = ((part, _named(list(part.pieces)), part.do) for part in waiting)
    with closing(_ended(name, tasks, workers.width)) as ended:
        for part, error in ended:
            if getattr(error, "for_all", False):
                assert isinstance(error, Exception)
                raise error
            for label in part.pieces:
                if label not in part.results:
                    assert isinstance(error, Exception)
                    yield label, Failure(in_one_line(error))
                else:
                    yield label, part.results[label]


def run_pieces(
    function: Callable[..., Any], noun: str, pieces: Pieces, at_once: int = AT_ONCE, *, task: str = "",
    ended: Callable[[str, Any], None] | None = None,
) -> StageReport:
    """Do pieces of work that each make an output of a noun. Failures are reported; the others finish.

    Args:
        function: as for :func:`carried_out`.
        noun: noun that is made.
        pieces: the arguments of each piece, by its label.
        at_once: most pieces of a task.
        task: name of the tasks, by default the noun.
        ended: called with label and result of each piece that is done.
    """
    report = StageReport(noun=noun)
    listener.get().begin(noun, len(pieces))
    measured = {label: {"function": function, "arguments": arguments} for label, arguments in pieces.items()}
    for label, result in carried_out(task or noun, costed, measured, at_once):
        if isinstance(result, Failure):
            report.failed[label] = result.line
            continue
        assert isinstance(result, Costed)
        report.made.append(label)
        report.cost.add(label, result.spent)
        if ended is not None:
            ended(label, result.result)
        listener.get().advance(noun, label)
    report.made.sort()
    return report


def spread(
    workers: Executors, function: Callable[..., R], pieces: Iterable[tuple[str, Mapping[str, Any]]],
    count: int, *,
    task: str = "piece",
) -> Iterator[tuple[str, R]]:
    """Do pieces of work, a task each, as many at once as the executors can.

    Args:
        workers: executors of the tasks.
        function: a module's function; does a piece.
        pieces: label and named arguments of each; taken when somebody is free.
        count: number of pieces.
        task: name of the tasks.

    Yields:
        Label and result of each, as it ends.

    Raises:
        Exception: raised by the first piece that failed; pieces that have begun end, no other begins.
    """
    chosen = workers.for_pieces(count)

    tasks = ((label, label, partial(chosen.run, function, **arguments)) for label, arguments in pieces)
    with closing(_ended(task, tasks, chosen.width)) as ended:
        for label, result in ended:
            if isinstance(result, BaseException):
                raise result
            yield label, result  # type: ignore[misc]  # a pool knows no types of results


def _ended(
    name: str, tasks: Iterator[tuple[Any, str, Callable[[], object]]], width: int
) -> Generator[tuple[Any, object], None, None]:
    """Carry out tasks of a name, so many at once; each is taken when there is room for it.

    Args:
        name: name of the tasks.
        tasks: key, label and work of each.
        width: number of tasks at once.

    Yields:
        Key of each and its result, or its exception, as it ends.
    """
    with runner.get().pool(width) as pool:
        while True:
            for key, label, work in islice(tasks, width - len(pool)):
                pool.submit(key, name, label, work)
            if not len(pool):
                return
            yield from pool.ended()


def _named(part: list[str]) -> str:
    """Name of a task."""
    return part[0] if len(part) == 1 else f"{part[0]} and {len(part) - 1} more"
