"""Files: written whole or not at all, and checked when they are read."""

from __future__ import annotations

import fcntl
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from pipeline.errors import NotFound, StillWritten, StorageFailed
from pipeline.store.locks import free, holding, take
from pipeline.store.paths import listed, safe, sync, unwritable
from pipeline.store.temporaries import beside, sweep

#: Greatest size of settings, maps and files of ours that are read whole, MiB.
SMALL_MB = 64


class Files:
    """A folder whose files are written atomically.

    Args:
        root: the folder; made when something is written.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    @contextmanager
    def aside(self, path: Path) -> Iterator[Path]:
        """A temporary path beside ``path``; what is there in the end is moved to ``path``.

        The file is there whole or not at all, even through a crash.

        Raises:
            StorageFailed: if the disk refuses, or if there is a device or a folder; the old file, if any,
                is as it was.
        """
        if not path.name or (path.exists() and not path.is_file()):
            raise StorageFailed("is no regular file, and is not replaced by one", where=str(path),
                                next_step="Name a file")
        temporary = beside(path, "tmp")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                yield temporary
                sync(temporary, os.O_RDONLY)
                os.replace(temporary, path)  # noqa: PTH105 (the tests make os.replace fail)
                sync(path.parent, os.O_RDONLY | os.O_DIRECTORY)
            finally:
                temporary.unlink(missing_ok=True)
        except OSError as error:
            raise unwritable(path, error) from error

    def write_bytes(self, path: Path, data: bytes) -> None:
        """Atomically write bytes (see :meth:`aside`)."""
        with self.aside(path) as temporary:
            temporary.write_bytes(data)

    @contextmanager
    def growing(self, folder: str, name: str) -> Iterator[tuple[Path, BinaryIO]]:
        """A file that grows while the body runs, locked against other processes. It stays after a kill.

        Raises:
            StorageFailed: if another process has it, or the disk refuses.
        """
        path = self.root / folder / safe(name)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("ab") as stream:
                take(stream)
                stream.truncate(0)
                yield path, stream
        except BlockingIOError as error:
            raise StorageFailed("is being written by another process", where=str(path),
                                next_step="Wait until that has ended") from error
        except OSError as error:
            raise unwritable(path, error) from error

    def abandoned(self, folder: str) -> list[Path]:
        """The files in ``folder`` that were growing (:meth:`growing`) until their process was killed."""
        return [path for path in map(Path, listed(self.root / folder)) if path.is_file() and free(path)]

    def discard(self, path: Path, useless: Callable[[bytes], bool]) -> bool:
        """Remove a file that was growing until its process was killed, if it is of no use.

        Args:
            path: from :meth:`abandoned`.
            useless: told from its bytes.

        Returns:
            Whether it was removed: not if it is of use, somebody has it again, or it is gone.
        """
        with suppress(BlockingIOError, FileNotFoundError), path.open("rb") as held:
            take(held)
            if useless(held.read()):
                path.unlink()
                return True
        return False

    def sweep(self) -> int:
        """Remove temporary files and staging folders of dead processes. Returns their number."""
        return sweep(self.root)

    def unchanged(self, path: Path) -> Callable[[], None]:
        """A function that checks that a file that is not ours is as it is now.

        Half a copy is no bad recording; call it before something is made of the file, or said against it.

        Raises:
            StillWritten: from that function, if the file has changed or is gone.
        """
        begun = _stamp(path)

        def check() -> None:
            if _stamp(path) != begun:
                raise StillWritten("is still being written", where=str(path),
                                   next_step="Nothing to do: the next run takes it")

        return check

    def foreign(self, path: Path, *, megabytes: int = SMALL_MB) -> bytes:
        """The bytes of a file that is not ours; it is only ever read.

        Args:
            path: of the file.
            megabytes: its greatest size.

        Raises:
            NotFound: if it cannot be read, is no regular file (a pipe or a device might never end), or is
                larger.
        """
        try:
            with open(path, "rb", opener=_without_waiting) as file:
                found = os.fstat(file.fileno())
                if not stat.S_ISREG(found.st_mode):
                    raise NotFound("is not a regular file", where=str(path), next_step="Name a file")
                data = file.read(min(found.st_size, megabytes << 20) + 1)
        except OSError as error:
            raise NotFound(f"cannot be read ({error.strerror or error})", where=str(path),
                           next_step="Name an existing file that you may read") from error
        if len(data) > megabytes << 20:
            raise NotFound(f"is larger than the limit of {megabytes} MiB", where=str(path),
                           next_step="If you trust it, raise megabytes in the [imports] settings")
        return data

    @contextmanager
    def locked(self, noun: str) -> Iterator[None]:
        """Lock a noun against every other thread and process while the body runs."""
        with holding(self.root / noun / ".lock", fcntl.LOCK_EX):
            yield

    @contextmanager
    def keeping(self) -> Iterator[None]:
        """No thread or process removes an output while the body runs."""
        with holding(self.root / ".lock", fcntl.LOCK_SH, reading=True):
            yield

    @contextmanager
    def removing(self) -> Iterator[None]:
        """No other thread or process commits or removes an output, or is :meth:`keeping`, meanwhile."""
        with holding(self.root / ".lock", fcntl.LOCK_EX):
            yield

    @contextmanager
    def committing(self) -> Iterator[None]:
        """No thread or process removes an output or takes a :meth:`snapshot` while the body runs."""
        with self.keeping(), holding(self.root / ".commits", fcntl.LOCK_SH):
            yield

    @contextmanager
    def snapshot(self) -> Iterator[None]:
        """No thread or process commits or removes an output: what the body reads is of one moment."""
        with self.keeping(), holding(self.root / ".commits", fcntl.LOCK_EX, reading=True):
            yield


def _stamp(path: Path) -> tuple[int, ...] | None:
    """The inode, size and time of change of a file, None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns


def _without_waiting(path: str, flags: int) -> int:
    """A descriptor; a pipe without a writer is opened at once."""
    return os.open(path, flags | os.O_NONBLOCK)
