"""Worker processes of a command."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, resource_tracker
from pathlib import Path
from queue import SimpleQueue
from threading import Lock
from time import monotonic
from types import TracebackType
from typing import ParamSpec, Self, TypeVar

from pitchlore.pipeline.base.errors import WorkerLost
from pitchlore.pipeline.engine.child import belong, hold_threads
from pitchlore.pipeline.engine.placement.executors import Executors, Here

#: Seconds of work that are done before other processes start, and number of pieces of which none is.
HERE_S, MANY = 3.0, 32

P = ParamSpec("P")
R = TypeVar("R")


class Processes:
    """A number of processes that do one piece of work at a time; a single one is this process.

    Each process takes one core: in each, libraries have one thread. If a process is killed, only
    its own work is lost, and another process is started for the next (Prefect's own pool of processes, like
    that of the standard library, loses all work with it). All end with the process that started them, however
    it ends: no process is left that could write files of a new run.

    Args:
        width: number of processes, at least 1.
        here: this process is one of them, and works from the start; the others take a second each to begin.
    """

    def __init__(self, width: int, *, here: bool = False) -> None:
        self.width = width
        self._free: SimpleQueue[ProcessPoolExecutor | None] = SimpleQueue()
        if width > 1:
            hold_threads()
            start_tracker()
        for number in range(width):
            self._free.put(None if width == 1 or (here and number == 0) else _process())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        while not self._free.empty():
            process = self._free.get()
            if process is not None:
                # a pool that closes while Python ends makes it print a traceback
                process.shutdown(wait=kind is None, cancel_futures=True)

    def for_pieces(self, count: int) -> Executors:
        """Here if it is one: to start another process takes a second, and no other work is lost with it."""
        return self if count > 1 else Here(1)

    def path(self, path: Path) -> Path:
        """The same: the processes are in the folder of this one."""
        return path

    def run(self, work: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> R:
        """Do a task on a free process (:meth:`pipeline.engine.placement.executors.Executors.run`)."""
        process = self._free.get()
        try:
            if process is None:
                return work(*arguments, **named)
            return process.submit(work, *arguments, **named).result()
        except BrokenProcessPool as error:
            process = _process()
            raise WorkerLost(
                "a process that worked for this command was killed, perhaps for lack of memory",
                next_step="Run the command again on fewer processes, as with --on processes:1; "
                          "finished work is kept",
            ) from error
        finally:
            self._free.put(process)


class WhenWorthwhile(Processes):
    """Processes that start once this one has worked for some seconds, a piece at a time, or has many to do.

    To start two processes takes 3.8 s of CPU, mostly of imports and of loading compiled code: as much as the
    sample and three matches of eight minutes take in one (2026-11-28). So few matches are done here, and a
    long work begins :data:`HERE_S` later than it could. If this process is killed, the command ends.
    """

    def __init__(self, width: int) -> None:
        super().__init__(width)
        self._mine, self._left = Lock(), HERE_S

    def for_pieces(self, count: int) -> Executors:
        """Here if it is one; of many pieces none is done here."""
        if count >= MANY:
            self._left = 0.0
        return super().for_pieces(count)

    def run(self, work: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> R:
        """Do a task here or on a process (:meth:`pipeline.engine.placement.executors.Executors.run`)."""
        left = self._left
        if left > 0 and self._mine.acquire(timeout=left):
            begun = monotonic()
            try:
                if self._left > 0:
                    return work(*arguments, **named)
            finally:
                self._left -= monotonic() - begun
                self._mine.release()
        return super().run(work, *arguments, **named)


def _process() -> ProcessPoolExecutor:
    """A pool of one process, which starts with its first work."""
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_begin)


def start_tracker() -> None:
    """Start the process that frees the semaphores of an interrupted command, without a word on them."""
    said = os.environ.get("PYTHONWARNINGS")
    os.environ["PYTHONWARNINGS"] = "ignore"
    try:
        resource_tracker.ensure_running()
    finally:
        if said is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = said


def _begin() -> None:
    """Belong to the command, which hears Ctrl-C for all its processes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    belong()
