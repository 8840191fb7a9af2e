"""Folders and ports that all processes of a session share."""

from __future__ import annotations

import fcntl
import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from importlib.metadata import version
from pathlib import Path

import pytest

from pitchlore.flows.server import DATABASE

#: Where the session's processes find its folder: Prefect's homes are in it.
FOLDER = "PITCHLORE_TESTS"
#: In that folder: the home of the session's server, that of servers which commands bring, a migrated database.
SERVED, HOME, MIGRATED = "served", "home", "migrated.db"
#: A database of Prefect's with nothing in it, which the first session keeps for the next ones.
EMPTY = Path(__file__).parents[2] / ".cache" / f"prefect-{version('prefect')}.db"
#: What no flow of ours needs of a server that tests share, and would cost it seconds.
QUIET = {f"PREFECT_SERVER_SERVICES_{service}_ENABLED": "false" for service in (
    "CANCELLATION_CLEANUP", "CLEANUP_RECONCILER", "EVENT_PERSISTER", "FOREMAN", "PAUSE_EXPIRATIONS", "REPOSSESSOR", "TRIGGERS")}


def once(tmp_path_factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """A folder that the first process of the session makes; the others wait for it."""
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, made = base / name, base / f"{name}.made"
    with (base / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not made.exists():
            make(folder)
            made.touch()
    return folder


def keep_migrated() -> None:
    """Keep the database of the session's server for other servers, which then need not make one (7 s)."""
    here = Path(os.environ[FOLDER])
    with (here / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if (here / MIGRATED).exists():
            return
        with (closing(sqlite3.connect(here / SERVED / DATABASE)) as served,
              closing(sqlite3.connect(here / "copy.db")) as copy):
            served.backup(copy)
        if not EMPTY.exists():
            EMPTY.parent.mkdir(exist_ok=True)
            kept = Path(shutil.copy(here / "copy.db", EMPTY.with_suffix(f".{os.getpid()}")))
            kept.rename(EMPTY)
        (here / "copy.db").rename(here / MIGRATED)
        migrated(here / HOME)


def migrated(home: Path) -> Path:
    """A home of Prefect's that has been used: its server finds a database. Take ``prefect_server`` first."""
    home.mkdir(parents=True, exist_ok=True)
    shutil.copy(Path(os.environ[FOLDER]) / MIGRATED, home / DATABASE)
    return home
