"""Locks between threads and processes, on files."""

from __future__ import annotations

import fcntl
import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, BinaryIO

from pitchlore.pipeline.base.errors import StorageFailed
from pitchlore.pipeline.store.paths import unwritable

#: How long a command waits for another one without a word, seconds; and how often it looks meanwhile.
PATIENCE_S, _POLL_S = 5.0, 0.01

_log = logging.getLogger(__name__)


@contextmanager
def holding(path: Path, lock: int, *, reading: bool = False) -> Iterator[None]:
    """A lock on a file, which is made if need be; waits until others let go of it.

    Args:
        path: path of the file.
        lock: as for ``fcntl.flock``.
        reading: go without the lock if there is no such file and none can be made, as in a folder in which
            nobody can write; or if the disk has no locks.

    Raises:
        StorageFailed: if the file can be neither opened nor made, or the disk has no locks.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        held = path.open("a")
    except OSError as error:
        if not reading:
            raise unwritable(path, error) from error
        if not path.exists():
            yield
            return
        held = path.open("r")
    with held:
        try:
            _wait(held, lock, path)
        except OSError as error:
            if not reading:
                raise StorageFailed(
                    f"cannot be locked ({error.strerror or error})", where=str(path),
                    next_step="Mount the disk with locks that hold between machines, as NFS 4 has them",
                ) from error
        yield


def _wait(held: IO[str], lock: int, path: Path) -> None:
    """Take a lock; if that takes long, say so."""
    patience = time.monotonic() + PATIENCE_S
    while time.monotonic() < patience:
        with suppress(BlockingIOError):
            fcntl.flock(held, lock | fcntl.LOCK_NB)
            return
        time.sleep(_POLL_S)
    _log.warning("%s: waiting until another command lets go of it", path.parent)
    fcntl.flock(held, lock)


def take(stream: BinaryIO) -> None:
    """Hold an open file against every other process until it is closed.

    Raises:
        BlockingIOError: if somebody has it, or has removed it since it was opened.
    """
    fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    if not os.fstat(stream.fileno()).st_nlink:
        raise BlockingIOError


def free(path: Path) -> bool:
    """True if a file is there and no process holds it."""
    try:
        with path.open("rb") as held:
            fcntl.flock(held, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except (BlockingIOError, FileNotFoundError):
        return False
    return True
