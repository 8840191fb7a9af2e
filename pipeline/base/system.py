"""The door to what systems do differently: locks, files, processes and memory.

Beside the way of Linux stands a portable one, which Python's own library has on every system. Linux's is
taken where it is there.
"""

from __future__ import annotations

import ctypes
import errno
import math
import multiprocessing
import os
import shutil
import signal
import sqlite3
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import cache
from multiprocessing.context import ForkServerContext, SpawnContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from tempfile import gettempdir
from threading import Lock
from types import ModuleType
from typing import IO, Any

try:
    import fcntl
    import resource
except ImportError:
    _POSIX = False
else:
    _POSIX = True

#: Flags, where there are such: no child has the file, a pipe without a writer is opened at once, bytes are
#: bytes.
_PLAIN = os.O_RDONLY | sum(getattr(os, flag, 0) for flag in ("O_CLOEXEC", "O_NONBLOCK", "O_BINARY"))
#: How often a lock is looked at, where the system does not wake who waits for it, seconds.
_POLL_S = 0.01
_reading, _starting = Lock(), Lock()
#: Longest path of a temporary folder in which there is room for a socket's path, bytes.
_TEMPORARY_BYTES = 70


# --- locks ------------------------------------------------------------------------------------------


@contextmanager
def locked(file: IO[Any], *, alone: bool, wait: bool = False) -> Iterator[None]:
    """A lock on an open file while the body runs, against all who opened it anew, in this process or another.

    It ends with its process. Where the system has such locks it is kept until the file is closed, and holds
    between machines that share the disk; else on this machine.

    Args:
        file: opened by its path.
        alone: nobody else has a lock; otherwise others may have one that is not ``alone``, either.
        wait: until others let go.

    Raises:
        BlockingIOError: if somebody else has a lock, and ``wait`` is false.
        OSError: if the disk has no locks.
    """
    if _POSIX:
        fcntl.flock(file, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | (0 if wait else fcntl.LOCK_NB))
        yield
        return
    with closing(_transaction(Path(file.name), alone=alone, wait=wait)):
        yield


def _transaction(path: Path, *, alone: bool, wait: bool) -> sqlite3.Connection:
    """A lock as a transaction of SQLite, which has them on every system, in an empty file beside a path."""
    while True:
        connection = sqlite3.connect(
            path.with_name(f".{path.name}.held"), timeout=0, isolation_level=None, check_same_thread=False)
        try:
            connection.execute("begin exclusive" if alone else "begin")
            connection.execute("select 1 from sqlite_master").fetchall()  # only this takes a shared lock
        except sqlite3.OperationalError as error:
            connection.close()
            if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY:
                raise OSError(str(error)) from error
            if not wait:
                raise BlockingIOError(str(error)) from error
            time.sleep(_POLL_S)
        else:
            return connection


# --- files ------------------------------------------------------------------------------------------


def open_to_read(path: str) -> int:
    """A descriptor of a file that is not ours; what never ends is opened at once, too.

    Raises:
        OSError: if it cannot be opened.
    """
    return os.open(path, _PLAIN)


def at_once(path: str, flags: int) -> int:
    """An opener of :func:`open` for files of ours: if a pipe is in the place of one, nobody waits for it."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def whole(path: str | Path) -> bytes:
    """The bytes of a file of ours.

    Raises:
        OSError: if it cannot be read; IsADirectoryError also for a pipe or a device, which may have no end.
    """
    with open(path, "rb", opener=at_once) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise IsADirectoryError(errno.EISDIR, "it is no regular file", str(path))
        return file.read()


def read_at(descriptor: int, count: int, first: int) -> bytes:
    """Up to ``count`` bytes of an open file, from its byte ``first`` on."""
    if hasattr(os, "pread"):
        return os.pread(descriptor, count, first)
    with _reading:
        os.lseek(descriptor, first, os.SEEK_SET)
        return os.read(descriptor, count)


def sync_file(path: Path) -> None:
    """Make a file's bytes survive a power cut."""
    _sync(path, os.O_RDONLY if os.name == "posix" else os.O_RDWR)


def sync_folder(path: Path) -> None:
    """Make a folder's renames survive a power cut, where the system lets a program ask for it."""
    if hasattr(os, "O_DIRECTORY"):
        _sync(path, os.O_RDONLY | os.O_DIRECTORY)


def _sync(path: Path, flags: int) -> None:
    descriptor = os.open(path, flags)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


# --- processes --------------------------------------------------------------------------------------


def cores() -> int:
    """Number of processes that can work at once on this machine."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def alive(pid: int) -> bool | None:
    """True if there is a process of a number on this machine; None where the system does not tell."""
    if os.name != "posix":
        return None  # there a signal of 0 would end the process
    try:
        os.kill(pid, 0)
    except OSError as error:
        return isinstance(error, PermissionError)
    return True


@cache
def clean(loaded: tuple[str, ...]) -> ForkServerContext | SpawnContext:
    """Processes that have nothing of this one.

    Args:
        loaded: modules that they begin with; where the system can fork, they are loaded once for all, by a
            process with a socket in the temporary folder, whose path may not be too long for that.
    """
    too_long = len(os.fsencode(gettempdir())) > _TEMPORARY_BYTES
    if too_long or "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([*loaded])
    return context


def start_clean(process: BaseProcess) -> None:
    """Start a process of :func:`clean`; unlike Python's own way it does not run the user's script again.

    A process that ends with its parent, as a worker of Dask does, may start one, too.
    """
    own: dict[str, Any] = multiprocessing.current_process()._config  # type: ignore[attr-defined]
    with _starting:
        main, sys.modules["__main__"] = sys.modules["__main__"], ModuleType("__main__")
        daemon, own["daemon"] = own.get("daemon", False), False
        try:
            process.start()
        finally:
            sys.modules["__main__"], own["daemon"] = main, daemon


def share_folder() -> None:
    """Let the sockets of :func:`clean` of this process and of those that it starts be in one folder."""
    from multiprocessing.util import get_temp_dir  # noqa: PLC0415 (loaded early, it would clear up too late)

    get_temp_dir()


def remove_folder() -> None:
    """Remove the folder of sockets, in a process that ends at once."""
    own: dict[str, Any] = multiprocessing.current_process()._config  # type: ignore[attr-defined]
    if "tempdir" in own:
        shutil.rmtree(own["tempdir"], ignore_errors=True)


@contextmanager
def undisturbed() -> Iterator[None]:
    """Keep Ctrl-C from this thread and the processes that it starts meanwhile, where the system can."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# --- memory -----------------------------------------------------------------------------------------


def limit_memory(most: int) -> None:
    """Let this process have so many bytes of data at most, and leave no core, where the system has limits."""
    if _POSIX:
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def limit_of(what: str) -> float:
    """The most that this process may have of ``AS`` (address space, bytes) or ``NPROC`` (processes)."""
    if not _POSIX:
        return math.inf
    most, _ = resource.getrlimit(getattr(resource, f"RLIMIT_{what}"))
    return math.inf if most == resource.RLIM_INFINITY else most


def give_back() -> None:
    """Give the system the memory that this process no longer uses.

    glibc keeps what many threads have freed in pieces, for each of them: after six games of a season, of five
    matches each, a process has 550 MB with what it keeps and 350 without.
    """
    if os.name != "posix":
        return
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:  # another C library than glibc has nothing to give
        trim(0)
