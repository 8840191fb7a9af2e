"""Locks between threads and processes, on files."""

from __future__ import annotations

import errno
import logging
import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO, BinaryIO

from pitchlore.pipeline.base.errors import StorageFailed, not_readable, unwritable
from pitchlore.pipeline.base.system import at_once, locked

#: How long a command waits for another one without a word, seconds; and how often it looks meanwhile.
PATIENCE_S, _POLL_S = 5.0, 0.01
#: Errors of disks without locks; reading goes on there, as in a folder in which nobody can write.
_WITHOUT_LOCKS = frozenset((errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS))

_log = logging.getLogger(__name__)


@contextmanager
def holding(path: Path, *, alone: bool, reading: bool = False) -> Iterator[None]:
    """A lock on a file, which is made if need be; waits until others let go of it.

    Args:
        path: path of the file.
        alone: nobody else has a lock; otherwise others may have one that is not ``alone``, either.
        reading: go without the lock if there is no such file and none can be made, as in a folder in which
            nobody can write; or if the disk has no locks.

    Raises:
        StorageFailed: if the file can be neither opened nor made, or the disk has no locks.
        ReadFailed: if it is there, and the system refuses to open or to lock it.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        held = open(path, "a", opener=at_once)  # noqa: SIM115 (closed below)
    except OSError as error:
        if not reading:
            raise unwritable(path, error) from error
        if not path.exists():
            yield
            return
        try:
            held = open(path, opener=at_once)  # noqa: SIM115 (as above)
        except OSError as closed:
            raise not_readable(path, closed, "Make it a file") from closed
    with held, ExitStack() as stack:
        try:
            stack.enter_context(_waited(held, path, alone=alone))
        except OSError as error:
            if reading and error.errno not in _WITHOUT_LOCKS:
                raise not_readable(path, error, "Make it a file") from error
            if not reading:
                raise StorageFailed(
                    f"cannot be locked ({error.strerror or error})", where=str(path),
                    next_step="Mount the disk with locks that hold between machines, as NFS 4 has them",
                ) from error
        yield


@contextmanager
def _waited(held: IO[str], path: Path, *, alone: bool) -> Iterator[None]:
    """A lock while the body runs; if it takes long to get, that is said."""
    patience = time.monotonic() + PATIENCE_S
    with ExitStack() as stack:
        while True:
            late = time.monotonic() >= patience
            if late:
                _log.warning("%s: waiting until another command lets go of it", path.parent)
            try:
                stack.enter_context(locked(held, alone=alone, wait=late))
                break
            except BlockingIOError:
                time.sleep(_POLL_S)
        yield


@contextmanager
def taken(stream: BinaryIO) -> Iterator[None]:
    """Hold an open file against every other process while the body runs.

    Raises:
        BlockingIOError: if somebody has it, or has removed it since it was opened.
    """
    with locked(stream, alone=True):
        if not os.fstat(stream.fileno()).st_nlink:
            raise BlockingIOError
        yield


def free(path: Path) -> bool:
    """True if a file is there and no process holds it."""
    try:
        with path.open("rb") as held, locked(held, alone=False):
            return True
    except (BlockingIOError, FileNotFoundError):
        return False
