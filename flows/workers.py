"""Worker processes of a command."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from queue import SimpleQueue
from types import TracebackType
from typing import ParamSpec, Self, TypeVar

from flows.child import belong
from pipeline.errors import WorkerLost

P = ParamSpec("P")
R = TypeVar("R")


def cores() -> int:
    """Number of processes that can work at once on this machine."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Workers:
    """A number of processes that do one piece of work at a time; with one job, work is done in this process.

    The processes share the cores: in each, polars takes only its part of them. If a process is killed, only
    its own work is lost, and another process is started for the next. All end with the process that started
    them, however it ends: no process is left that could write files of a new run.

    Args:
        jobs: number of processes, at least 1.
    """

    def __init__(self, jobs: int) -> None:
        self._free: SimpleQueue[ProcessPoolExecutor | None] = SimpleQueue()
        if jobs > 1:
            # read by polars when it is imported: of this process it is too late to change anything
            os.environ.setdefault("POLARS_MAX_THREADS", str(max(1, cores() // jobs)))
        for _ in range(jobs):
            self._free.put(_process() if jobs > 1 else None)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        while not self._free.empty():
            process = self._free.get()
            if process is not None:
                process.shutdown(wait=False, cancel_futures=True)

    def run(self, work: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> R:
        """Do a piece of work as soon as a process is free; several threads may call this at once.

        Args:
            work: a function of a module; the function, its arguments and its result must be picklable.
            arguments: positional arguments of the function.
            named: named arguments of the function.

        Raises:
            WorkerLost: if the process was killed.
            Exception: whatever the work raised.
        """
        process = self._free.get()
        try:
            if process is None:
                return work(*arguments, **named)
            return process.submit(work, *arguments, **named).result()
        except BrokenProcessPool as error:
            process = _process()
            raise WorkerLost(
                "a process that worked for this command was killed, perhaps for lack of memory",
                next_step="Run the command again with fewer --jobs; finished work is kept",
            ) from error
        finally:
            self._free.put(process)


def _process() -> ProcessPoolExecutor:
    """A pool of one process, which starts with its first work."""
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_begin)


def _begin() -> None:
    """Belong to the command, which hears Ctrl-C for all its processes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    belong()
