"""A process that a command has started with multiprocessing."""

from __future__ import annotations

import logging
import os
import sys
import warnings
from multiprocessing import parent_process
from threading import Thread

#: Loggers of libraries that no setting of Prefect's reaches.
LOUD = ("EventsWorker", "asyncio")


def belong() -> None:
    """Let this process end with the one that started it, even if that is killed, and be as quiet as that.

    In a process that multiprocessing has not started, this does nothing.
    """
    parent = parent_process()
    if parent is None:
        return
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
