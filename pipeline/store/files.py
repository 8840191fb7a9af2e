"""Files: written whole or not at all, and checked when they are read."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import cached_property
from pathlib import Path
from typing import BinaryIO

from pitchlore.pipeline.base.digests import Content
from pitchlore.pipeline.base.errors import NotFound, StillWritten, StorageFailed, unwritable
from pitchlore.pipeline.base.system import open_to_read, read_at
from pitchlore.pipeline.store.atomic import aside
from pitchlore.pipeline.store.buckets import check_local
from pitchlore.pipeline.store.foreign import ForeignFile
from pitchlore.pipeline.store.locks import free, holding, taken
from pitchlore.pipeline.store.meter import count_read, count_written
from pitchlore.pipeline.store.mirrors import Mirror, located, mirror_of
from pitchlore.pipeline.store.paths import listed, remove, safe
from pitchlore.pipeline.store.temporaries import sweep

#: Greatest size of settings, maps and files of ours that are read whole, MiB.
SMALL_MB = 64


class Files:
    """A folder whose files are written atomically.

    Args:
        root: the folder, made when something is written; or the URL of a bucket.

    Attributes:
        root: the folder; of a bucket, that of its local copy (:mod:`pipeline.store.mirrors`).

    Raises:
        BadSettings: if a URL is not that of a bucket, or the environment does not say how to reach it.
    """

    def __init__(self, root: Path) -> None:
        self.root = located(root)

    @cached_property
    def mirror(self) -> Mirror | None:
        """The bucket that the folder is the copy of; None if the folder is the data itself."""
        return mirror_of(self.root)

    @property
    def closed(self) -> bool:
        """True if nothing can be written into the folder: it is mounted read-only, or another user's."""
        return self.root.exists() and not os.access(self.root, os.W_OK)

    @property
    def where(self) -> str:
        """The folder's path, or its bucket's URL, for messages."""
        return self.named(self.root)

    def named(self, path: Path) -> str:
        """The path of a file of the folder, or its URL in the bucket, for messages."""
        inside = self.mirror is not None and path.is_relative_to(self.mirror.folder)
        return self.mirror.where(path) if self.mirror is not None and inside else str(path)

    def here(self, path: Path) -> Path:
        """The local path of a file. A URL in the folder's bucket is brought to the copy.

        Raises:
            NotFound: if the bucket has it no more.
            BucketFailed: if the bucket cannot be reached.
        """
        local = path if self.mirror is None else self.mirror.local(path)
        if self.mirror is not None and local.is_relative_to(self.mirror.folder):
            self.mirror.bring(local)
        return local

    def catch_up(self, within: float = 0.0) -> None:
        """Bring the copy of a bucket up to date (:meth:`pipeline.store.mirrors.Mirror.sync`)."""
        if self.mirror is not None:
            self.mirror.sync(within)

    def catch_up_or_say(self) -> None:
        """Bring the copy of a bucket up to date (:meth:`pipeline.store.mirrors.Mirror.sync_or_say`)."""
        if self.mirror is not None:
            self.mirror.sync_or_say()

    @staticmethod
    def aside(path: Path) -> AbstractContextManager[Path]:
        """A temporary path that is moved to ``path`` (:func:`pipeline.store.atomic.aside`)."""
        return aside(path)

    def write_bytes(self, path: Path, data: Content) -> None:
        """Atomically write bytes to a file that is none of the data folder's own (see :meth:`aside`)."""
        with self.aside(path) as temporary:
            temporary.write_bytes(data)
        count_written(len(data))

    def keep(self, path: Path, data: Content) -> None:
        """Write a file of the data folder, whatever was there: to the bucket first, if it is in one."""
        if self.mirror is not None and path.is_relative_to(self.mirror.folder):
            self.mirror.put(path, data)
            count_written(len(data))
        else:
            self.write_bytes(path, data)

    def drop(self, path: Path) -> None:
        """Remove a file of the data folder, if it is there."""
        if self.mirror is not None:
            self.mirror.remove(path)
        else:
            remove(path)

    @contextmanager
    def growing(self, folder: str, name: str) -> Iterator[tuple[Path, BinaryIO]]:
        """A file that grows while the body runs, locked against other processes. It stays after a kill.

        Raises:
            StorageFailed: if another process has it, or the disk refuses.
        """
        path = self.root / folder / safe(name)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("ab") as stream, taken(stream):
                stream.truncate(0)
                yield path, stream
        except BlockingIOError as error:
            raise StorageFailed("is being written by another process", where=str(path),
                                next_step="Wait until that has ended") from error
        except OSError as error:
            raise unwritable(path, error) from error

    def abandoned(self, folder: str) -> list[Path]:
        """The files in ``folder`` that were growing (:meth:`growing`) until their process was killed."""
        there = (path for path in map(Path, listed(self.root / folder)) if not path.name.startswith("."))
        return [path for path in there if path.is_file() and free(path)]

    def moved(self, path: Path, folder: str) -> Path:
        """Move a file that grew into another folder of the data folder; to the bucket, if it is in one.

        Returns:
            Where it is; with a number in its name if another file has that.

        Raises:
            FileNotFoundError: if somebody else moved it.
        """
        target, number = self.root / folder / path.name, 1
        while target.exists():
            number += 1
            target = self.root / folder / f"{path.stem}-{number}{path.suffix}"
        if self.mirror is not None:
            self.keep(target, path.read_bytes())
            path.unlink()
        else:
            target.parent.mkdir(parents=True, exist_ok=True)
            path.replace(target)
        return target

    def discard(self, path: Path, useless: Callable[[bytes], bool]) -> bool:
        """Remove a file that was growing until its process was killed, if it is of no use.

        Args:
            path: from :meth:`abandoned`.
            useless: seen from its bytes.

        Returns:
            Whether it was removed: not if it is of use, somebody has it again, or it is gone.
        """
        with suppress(BlockingIOError, FileNotFoundError), path.open("rb") as held, taken(held):
            if useless(held.read()):
                path.unlink()
                return True
        return False

    def set_aside(self, path: Path, folder: str) -> Path | None:
        """Move a file that was growing until its process was killed or gave it up to another folder.

        Args:
            path: from :meth:`abandoned`.
            folder: in which it gets a number: ``x.mcap`` becomes ``x-1.mcap``, the next one ``x-2.mcap``.

        Returns:
            Its new path; None if somebody has it again, or it is gone.
        """
        numbers = [int(there.stem.rpartition("-")[2]) for there in self.were_set_aside(folder, path.name)]
        home = self.root / folder / f"{path.stem}-{max(numbers, default=0) + 1}{path.suffix}"
        with suppress(BlockingIOError, FileNotFoundError), path.open("rb") as held, taken(held):
            try:
                home.parent.mkdir(parents=True, exist_ok=True)
                return path.rename(home)
            except OSError as error:
                raise unwritable(home, error) from error
        return None

    def were_set_aside(self, folder: str, name: str) -> list[Path]:
        """The files that :meth:`set_aside` has moved to a folder under a name."""
        stem, _, suffix = name.rpartition(".")
        numbered = re.compile(rf"{re.escape(stem)}-[0-9]+\.{re.escape(suffix)}")
        return [path for path in map(Path, listed(self.root / folder)) if numbered.fullmatch(path.name)]

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
            path: path of the file.
            megabytes: its greatest size.

        Raises:
            NotFound, BadSettings: as :meth:`opened`.
        """
        with self.opened(path, megabytes=megabytes) as file:
            return file[:]

    @contextmanager
    def opened(self, path: Path, *, megabytes: int) -> Iterator[ForeignFile]:
        """A file that is not ours, open while the body runs; it is only ever read.

        Args:
            path: path of the file.
            megabytes: its greatest size.

        Raises:
            BadSettings: if the path is a URL.
            NotFound: if it cannot be read, is no regular file (a pipe or a device might never end), or is
                larger.
        """
        check_local(path)
        try:
            descriptor = open_to_read(str(path))
        except OSError as error:
            raise NotFound(f"cannot be read ({error.strerror or error})", where=self.named(path),
                           next_step="Name an existing file that you may read") from error
        try:
            seen = os.fstat(descriptor)
            if not stat.S_ISREG(seen.st_mode) or (not seen.st_size and _has_bytes(descriptor)):  # /proc
                raise NotFound("is not a regular file", where=self.named(path), next_step="Name a file")
            file = ForeignFile(descriptor, self.named(path))
            if len(file) > megabytes << 20:
                raise NotFound(f"is larger than the limit of {megabytes} MiB", where=self.named(path),
                               next_step="If you trust it, raise megabytes in the [imports] settings")
            count_read(len(file))
            yield file
        finally:
            os.close(descriptor)

    @contextmanager
    def locked(self, noun: str) -> Iterator[None]:
        """Lock a noun against every other thread and process while the body runs."""
        with holding(self.root / noun / ".lock", alone=True):
            yield

    def now_ns(self) -> int:
        """The time by the clock of the folder's disk, which may be another machine's, ns; 0 if unknown."""
        lock = self.root / ".lock"
        try:
            os.utime(lock)
            return lock.stat().st_mtime_ns
        except OSError:
            return 0

    @contextmanager
    def keeping(self) -> Iterator[None]:
        """No thread or process removes an output while the body runs."""
        with holding(self.root / ".lock", alone=False, reading=True):
            yield

    @contextmanager
    def removing(self) -> Iterator[None]:
        """No other thread or process commits or removes an output, or is :meth:`keeping`, meanwhile."""
        with holding(self.root / ".lock", alone=True):
            yield

    @contextmanager
    def committing(self) -> Iterator[None]:
        """No thread or process removes an output or takes a :meth:`snapshot` while the body runs."""
        with self.keeping(), holding(self.root / ".commits", alone=False):
            yield

    @contextmanager
    def snapshot(self) -> Iterator[None]:
        """No thread or process commits or removes an output: what the body reads is of one moment."""
        with self.keeping(), holding(self.root / ".commits", alone=True, reading=True):
            yield


def _stamp(path: Path) -> tuple[int, ...] | None:
    """The inode, size and time of change of a file, None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns


def _has_bytes(descriptor: int) -> bool:
    try:
        return bool(read_at(descriptor, 1, 0))
    except OSError:  # /proc/self/mem
        return True
