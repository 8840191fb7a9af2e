"""Beginnings and endings that the processes of a command share, those of multiprocessing included."""

from __future__ import annotations

import gc
import logging
import os
import sys
import warnings
from collections.abc import Sequence
from itertools import pairwise
from multiprocessing import parent_process
from threading import Thread

from pitchlore.pipeline.base.system import cores

#: Environment variable with the place for commands that are not told another.
VARIABLE = "PITCHLORE_ON"
#: Environment variables that say how many threads a library starts; each reads its own when it is imported.
_THREADS = ("POLARS_MAX_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
#: Loggers of libraries that no setting of Prefect's reaches.
LOUD = ("EventsWorker", "asyncio")
#: Python looks for garbage cycles each time that so many more objects exist (its own default: 700).
OBJECTS = 100_000


def collect_rarely() -> None:
    """Let Python look for garbage cycles less often in this process.

    Loading Prefect makes a million objects that stay. With Python's default, a fifth of the time of loading
    is spent on looking at them again and again.
    """
    gc.set_threshold(OBJECTS)


def hold_threads(count: int = 1) -> None:
    """Let libraries start so many threads in this process and its children, unless its user said otherwise.

    More of them wait for each other: a run in one process on 16 cores took the same time with threads of
    polars on all of them, and twice the CPU. Libraries that are loaded already are as they were.
    """
    for name in _THREADS:
        os.environ.setdefault(name, str(count))


def library_threads(words: Sequence[str]) -> int:
    """Threads of libraries in a command of these words: those of its place if it is threads, else one."""
    said = [after for word, after in pairwise(words) if word == "--on"]
    said += [word.removeprefix("--on=") for word in words if word.startswith("--on=")]
    kind, _, width = (said[-1] if said else os.environ.get(VARIABLE, "")).partition(":")
    return int(width) if kind == "threads" and width.isdecimal() else cores() if kind == "threads" else 1


def belong() -> None:
    """Let this process end with the one that started it, even if that is killed, and be as quiet as that.

    In a process that multiprocessing has not started, this does nothing.
    """
    parent = parent_process()
    if parent is None:
        return
    collect_rarely()
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    if os.environ.get("PREFECT_LOGGING_LEVEL") == "CRITICAL":
        hush()
    def watch() -> None:
        parent.join()
        os._exit(1)

    Thread(target=watch, name="parent", daemon=True).start()


def hush() -> None:
    """Let the loud loggers say only what is critical."""
    for name in LOUD:
        logging.getLogger(name).setLevel(logging.CRITICAL)
