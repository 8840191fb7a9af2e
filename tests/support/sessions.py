"""Folders and ports that all processes of a session share."""

import fcntl
import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from importlib.metadata import version
from pathlib import Path

import pytest

#: Where the session's processes find its folder: Prefect's home is in it.
FOLDER = "PITCHLORE_TESTS"
#: Name of Prefect's database in its home.
DATABASE = "prefect.db"
#: A database of Prefect's, which a session keeps for the next servers.
EMPTY = Path(__file__).parents[2] / ".cache" / f"prefect-{version('prefect')}.db"
#: What no flow of ours needs of a server that tests share, and would cost it seconds.
QUIET = {f"PREFECT_SERVER_SERVICES_{service}_ENABLED": "false" for service in (
    "CANCELLATION_CLEANUP", "CLEANUP_RECONCILER", "EVENT_PERSISTER", "FOREMAN", "PAUSE_EXPIRATIONS", "REPOSSESSOR", "TRIGGERS")}
#: What is scheduled, and what is late, is found within a second or two.
QUIET |= {f"PREFECT_SERVER_SERVICES_{setting}": seconds for setting, seconds in (
    ("SCHEDULER_LOOP_SECONDS", "2"), ("LATE_RUNS_AFTER_SECONDS", "1"), ("LATE_RUNS_LOOP_SECONDS", "2"))}

#: Stands in for uvicorn: a data folder's server that is there at once, and asks another one all that it is asked.
RELAY = """
import asyncio
class Config:
    def __init__(self, *_, **__): pass
class Server:
    started = True
    def __init__(self, _): pass
    async def startup(self, sockets=None): pass
    def run(self, sockets): asyncio.run(self.serve(sockets))
    async def serve(self, sockets):
        serving = await asyncio.start_server(self.relay, sock=sockets[0])
        await self.startup(sockets)
        await serving.serve_forever()
    async def relay(self, reader, writer):
        answers, asked = await asyncio.open_connection("127.0.0.1", {port})
        await asyncio.gather(self.pass_on(reader, asked), self.pass_on(answers, writer), return_exceptions=True)
    async def pass_on(self, reader, writer):
        try:
            while part := await reader.read(65_536):
                writer.write(part)
        finally:
            writer.close()
"""


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


def keep_migrated(home: Path) -> None:
    """Keep the database of a server's home for other servers, which then need not make one (7 s)."""
    EMPTY.parent.mkdir(exist_ok=True)
    copy = EMPTY.with_suffix(f".{os.getpid()}")
    with closing(sqlite3.connect(home / DATABASE)) as served, closing(sqlite3.connect(copy)) as kept:
        served.backup(kept)
    copy.replace(EMPTY)


def migrated(home: Path, name: str = DATABASE) -> Path:
    """A home of Prefect's, whose server finds a database, if an earlier session has kept one."""
    home.mkdir(parents=True, exist_ok=True)
    if EMPTY.exists():
        shutil.copy(EMPTY, home / name)
    return home
