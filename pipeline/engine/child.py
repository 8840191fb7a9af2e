"""Beginnings and endings that the processes of a command share, those of multiprocessing included."""

from __future__ import annotations

import gc
import logging
import os
import sys
import warnings
from multiprocessing import parent_process
from threading import Thread

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
