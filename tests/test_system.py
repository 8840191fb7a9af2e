"""The door to what systems do differently: Linux's way and the portable one do the same."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time

import pytest
from conftest import ROOT, clip
from support.processes import COMMAND_LINES

from pitchlore.pipeline.base import system
from pitchlore.pipeline.store.locks import free, holding, taken

#: Takes away what Windows has not, before anything of ours is loaded.
HIDDEN = """
import multiprocessing, os, signal, sys
for name in ("fcntl", "resource", "termios", "pwd", "grp"):
    sys.modules[name] = None
for name in ("sched_getaffinity", "pread", "O_DIRECTORY", "O_NONBLOCK", "O_CLOEXEC", "fork", "forkpty", "register_at_fork"):
    vars(os).pop(name)
for name in ("pthread_sigmask", "SIGHUP", "SIGKILL"):
    vars(signal).pop(name)
multiprocessing.get_all_start_methods = lambda: ["spawn"]
"""
#: Loads every module of a command, of the engine, the views and the face; what is loaded of Prefect.
LOADED = """
import importlib, pkgutil, re, pitchlore.flows.commands
del sys.modules["fcntl"], sys.modules["resource"]  # which others' libraries need here
from pitchlore.pipeline import engine, face, views
from pitchlore.pipeline.base.errors import NotFound
for room in (pitchlore.flows.commands, engine, face, views):
    for found in pkgutil.walk_packages(room.__path__, room.__name__ + "."):
        try:
            importlib.import_module(found.name)
        except (ModuleNotFoundError, NotFound) as error:
            assert {"dask", "gymnasium", "minari", "rerun"} & set(re.findall(r"\\w+", str(error))), error
print([name for name in sys.modules if name.partition(".")[0] == "prefect"])
"""
#: A process that holds a lock until it is killed.
HOLDER = HIDDEN + """
import time
from pathlib import Path
from pitchlore.pipeline.store.locks import holding
with holding(Path(sys.argv[1]), alone=sys.argv[2] == "alone"):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture(params=["Linux", "portable"])
def way(request, monkeypatch):
    """Each way in turn; a process of this module's HOLDER takes the portable one."""
    monkeypatch.setattr(system, "_POSIX", request.param == "Linux")
    return request.param


def refused(path, *, alone: bool) -> bool:
    with path.open("ab") as file:
        try:
            with system.locked(file, alone=alone):
                return False
        except BlockingIOError:
            return True


def test_locks(way, tmp_path):
    """Locks that are shared stand beside each other; one that is alone stands by itself; all end."""
    path = tmp_path / ".lock"
    with holding(path, alone=False), holding(path, alone=False):
        assert (refused(path, alone=False), refused(path, alone=True)) == (False, True)
    with holding(path, alone=True):
        assert (refused(path, alone=False), refused(path, alone=True)) == (True, True)
    assert not refused(path, alone=True)
    assert path.read_bytes() == b""


def test_taken(way, tmp_path):
    """A file that grows is nobody else's until it is closed, and one that is gone is not taken."""
    path = tmp_path / "match.mcap"
    with path.open("ab") as stream, taken(stream):
        assert not free(path)
    assert free(path)
    with path.open("rb") as stream:
        path.unlink()
        with pytest.raises(BlockingIOError), taken(stream):
            pass
    assert not free(path)


def test_waits(way, tmp_path):
    """A process that waits for a lock gets it when the other lets go."""
    path, got = tmp_path / ".lock", []

    def wait() -> None:
        with path.open("ab") as file, system.locked(file, alone=True, wait=True):
            got.append(time.monotonic())

    with holding(path, alone=False):
        waiting = threading.Thread(target=wait)
        waiting.start()
        time.sleep(0.1)
        assert got == []
        released = time.monotonic()
    waiting.join(10)
    assert got[0] >= released


@pytest.mark.slow
def test_portable_lock_of_another_process(monkeypatch, tmp_path):
    """The portable way holds against another process, and ends when that is killed."""
    monkeypatch.setattr(system, "_POSIX", False)
    path = tmp_path / ".lock"
    for kind in ("alone", "shared"):
        with subprocess.Popen([sys.executable, "-c", HOLDER, path, kind], cwd=ROOT, stdout=subprocess.PIPE) as process:
            try:
                assert process.stdout.readline() == b"held\n"
                assert (refused(path, alone=False), refused(path, alone=True)) == (kind == "alone", True)
            finally:
                process.kill()
        assert not refused(path, alone=True)


@pytest.mark.parametrize("name", ["pread", "none"])
def test_read_at(name, monkeypatch, tmp_path):
    """Bytes of a file from any place, also where a system has no call for it."""
    monkeypatch.delattr(os, name, raising=False)
    (tmp_path / "file").write_bytes(bytes(range(100)))
    descriptor = system.open_to_read(str(tmp_path / "file"))
    try:
        assert system.read_at(descriptor, 5, 90) == bytes(range(90, 95))
        assert system.read_at(descriptor, 50, 10) == bytes(range(10, 60))
        assert system.read_at(descriptor, 50, 100) == b""
    finally:
        os.close(descriptor)


@pytest.mark.slow
def test_without_what_windows_lacks(tmp_path):
    """Import, run, sql and replay need nothing of Linux's alone, and load no Prefect; nor does any module of a command."""
    clip(0.0, 40.0).write_parquet(tmp_path / "derby.parquet")

    lines = [["import", "derby.parquet"], ["run", "--json"], ["sql", "--json", "select count(*) n from situations"],
             ["replay", "derby"]]
    done = subprocess.run([sys.executable, "-c", HIDDEN + COMMAND_LINES + LOADED, json.dumps(lines)], cwd=tmp_path, text=True,
                          env={**os.environ, "PITCHLORE_DATA": str(tmp_path / "data"), "PYTHONPATH": str(ROOT)},
                          capture_output=True)
    assert done.returncode == 0, done.stdout + done.stderr
    _, ran, asked, _, loaded = done.stdout.split("\0")
    assert loaded == "[]\n"
    assert json.loads(ran)["knowledge"] == 1
    assert json.loads(asked)[0]["n"] > 50
    assert list((tmp_path / "data" / "replays").glob("*.html"))
    assert list(tmp_path.glob("data/..lock.held"))  # the portable way was taken
