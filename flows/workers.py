"""Processes that work for this one."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from queue import SimpleQueue
from threading import Thread
from types import TracebackType
from typing import ParamSpec, Self, TypeVar

from pipeline.errors import WorkerLost

P = ParamSpec("P")
R = TypeVar("R")


def cores() -> int:
    """How many processes can work at once here."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Workers:
    """So many processes, each of which does one piece of work at a time; with one it is done in place.

    They share the cores: polars, which would take all of them in each, takes its part. A process that is
    killed takes only its own work with it, and another is started for the next. All end
    with the process that started them, however that ends: none is left to write what a new run writes.

    Args:
        jobs: how many, at least 1.
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
        """Have work done, when there is a process for it; threads may ask at once.

        Args:
            work: a function of a module; it and what it takes and gives go from process to process.
            arguments: of it.
            named: likewise.

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
                next_step="Run the command again with fewer --jobs; what was over by then is kept",
            ) from error
        finally:
            self._free.put(process)


def _process() -> ProcessPoolExecutor:
    """One process, started when there is work for it."""
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_end_with_parent)


def _end_with_parent() -> None:
    """End this process when the one that started it ends, even if that is killed; not with Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()
