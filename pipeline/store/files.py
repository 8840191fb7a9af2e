"""Files: written whole or not at all, and checked when they are read."""

from __future__ import annotations

import fcntl
import json
import logging
import os
import re
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import chain
from pathlib import Path
from typing import IO, BinaryIO, TypeVar

from pydantic import BaseModel, ValidationError

from pipeline.errors import BadSettings, CorruptFile, NotFound, StillWritten, StorageFailed
from pipeline.store.receipts import Manifest, digest

SAFE_NAME = re.compile(r"^[a-z0-9][a-z0-9.-]{0,95}\Z")
M = TypeVar("M", bound=BaseModel)
#: Greatest size of settings, maps and files of ours that are read whole, MiB.
SMALL_MB = 64
REMEDY = "Run `pitchlore run` to make it anew"
_REMEDIES = {
    "matches": "Import the recording again, or `pitchlore verify --restore-from BACKUP`",
    "seasons": "`pitchlore verify --restore-from BACKUP`, or remove its files in seasons/ and play it anew",
    "evaluations": "Run `pitchlore evaluate` as before to make it anew",
    "paradigms": "Run `pitchlore paradigms` as before to make it anew",
    "report": "Run `pitchlore report` to make it anew",
    "quarantine": "`pitchlore quarantine --clear` removes it",
}
REMEDY_OF_VERSION = "Restore it: `pitchlore verify --restore-from BACKUP`; other versions are not affected"
#: How long a command waits for another one without a word, seconds; and how often it looks meanwhile.
PATIENCE_S, _POLL_S = 5.0, 0.01
#: How a sealed model begins.
_SEAL = re.compile(rb'\{\n "checksum": "([0-9a-f]{64})",\n')

_log = logging.getLogger(__name__)


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
        temporary = path.with_name(f".{path.name}.{os.getpid()}-{os.urandom(4).hex()}.tmp")
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
                _take(stream)
                stream.truncate(0)
                yield path, stream
        except BlockingIOError as error:
            raise StorageFailed("is being written by another process", where=str(path),
                                next_step="Wait until that has ended") from error
        except OSError as error:
            raise unwritable(path, error) from error

    def abandoned(self, folder: str) -> list[Path]:
        """The files in ``folder`` that were growing (:meth:`growing`) until their process was killed."""
        return [path for path in listed(self.root / folder) if path.is_file() and _free(path)]

    def discard(self, path: Path, useless: Callable[[bytes], bool]) -> bool:
        """Remove a file that was growing until its process was killed, if it is of no use.

        Args:
            path: from :meth:`abandoned`.
            useless: told from its bytes.

        Returns:
            Whether it was removed: not if it is of use, somebody has it again, or it is gone.
        """
        with suppress(BlockingIOError, FileNotFoundError), path.open("rb") as held:
            _take(held)
            if useless(held.read()):
                path.unlink()
                return True
        return False

    def sweep(self) -> int:
        """Remove temporary files and staging folders of dead processes. Returns their number."""
        swept = 0
        kinds = (".*.tmp*", "*/.*.tmp", "*/*/.*.tmp", "*/.*.staging")
        for path in [*chain.from_iterable(map(self.root.glob, kinds))]:
            owner = re.search(r"\.(\d+)-[0-9a-f]+\.(?:tmp|tmp\.wal|staging)$", path.name)
            if owner and not _alive(int(owner[1])):
                if path.is_dir():
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    path.unlink(missing_ok=True)
                swept += 1
        return swept

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
        with _holding(self.root / noun / ".lock", fcntl.LOCK_EX):
            yield

    @contextmanager
    def keeping(self) -> Iterator[None]:
        """No thread or process removes an output while the body runs."""
        with _holding(self.root / ".lock", fcntl.LOCK_SH, reading=True):
            yield

    @contextmanager
    def removing(self) -> Iterator[None]:
        """No other thread or process commits or removes an output, or is :meth:`keeping`, meanwhile."""
        with _holding(self.root / ".lock", fcntl.LOCK_EX):
            yield

    @contextmanager
    def committing(self) -> Iterator[None]:
        """No thread or process removes an output or takes a :meth:`snapshot` while the body runs."""
        with self.keeping(), _holding(self.root / ".commits", fcntl.LOCK_SH):
            yield

    @contextmanager
    def snapshot(self) -> Iterator[None]:
        """No thread or process commits or removes an output: what the body reads is of one moment."""
        with self.keeping(), _holding(self.root / ".commits", fcntl.LOCK_EX, reading=True):
            yield


def check_root(path: Path) -> None:
    """Check that a path may be that of a data folder, new or old.

    Raises:
        BadSettings: if it, or a folder above it, is something else; if it is too long or not UTF-8; or if it
            has a ``?``, after which DuckDB and SQLite read options.
    """
    try:
        there = next((each for each in (path, *path.parents) if each.exists() or each.is_symlink()), None)
        what, where = None if there is None or there.is_dir() else "is not a folder", there
        if what is None and "?" in str(path.resolve()):
            what, where = "has a ? in its path, after which databases read options", path
        str(path.resolve()).encode()
    except UnicodeEncodeError:
        what, where = "has a path that is not UTF-8", path
    except (OSError, RuntimeError) as error:  # 3.12 and before raise RuntimeError for links in a circle
        what, where = f"cannot be used ({getattr(error, 'strerror', None) or 'its links go round'})", path
    if what is not None:
        raise BadSettings(what, where=str(where)[:200], next_step="Name the data folder with --data")


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


@contextmanager
def _holding(path: Path, lock: int, *, reading: bool = False) -> Iterator[None]:
    """A lock on a file, which is made if need be; waits until others let go of it.

    Args:
        path: of the file.
        lock: as for ``fcntl.flock``.
        reading: go without the lock if there is no such file and none can be made, as in a folder in which
            nobody can write.

    Raises:
        StorageFailed: if the file can be neither opened nor made.
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
        _wait(held, lock, path)
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


def unwritable(path: Path, error: OSError) -> StorageFailed:
    """The error of a file or folder that cannot be written."""
    return StorageFailed(
        f"cannot be written ({error.strerror or error})", where=str(path),
        next_step="Free space or mend the folder, then run again; nothing that was there is lost",
    )


def listed(folder: Path, end: str = "") -> list[Path]:
    """The paths in a folder whose names end so, sorted; none if there is no folder.

    Raises:
        StorageFailed: if the folder cannot be read: what cannot be seen is not gone.
    """
    try:
        return sorted(path for path in folder.iterdir() if path.name.endswith(end))
    except FileNotFoundError:
        return []
    except OSError as error:
        raise StorageFailed(f"cannot be read ({error.strerror or error})", where=str(folder),
                            next_step="Make it a folder that you may read") from error


def remove(path: Path) -> None:
    """Remove a file, if it is there.

    Raises:
        StorageFailed: if the disk refuses.
    """
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise unwritable(path, error) from error


def sync(path: Path, flags: int) -> None:
    """Make a file's bytes, or a folder's renames, survive a power cut."""
    descriptor = os.open(path, flags)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def safe(name: str) -> str:
    """The name, if it may become part of a path.

    Raises:
        BadSettings: if not.
    """
    if not SAFE_NAME.match(name):
        raise BadSettings(f"{name!r} is not a safe file name", next_step="Name it otherwise")
    return name


def pretty(model: BaseModel) -> bytes:
    """A model as JSON that a person can read, the same bytes for the same model."""
    text = json.dumps(model.model_dump(mode="json"), indent=1, sort_keys=True, allow_nan=False)
    return text.encode() + b"\n"


def sealed(model: BaseModel) -> bytes:
    """A model as JSON (:func:`pretty`) with a first key ``checksum``: the SHA-256 of the file without it."""
    text = pretty(model)
    return b'{\n "checksum": "%b",\n' % digest(text).encode() + text.removeprefix(b"{\n")


def read_model(path: Path, model: type[M]) -> M:
    """A model from its JSON file, checked against its own checksum.

    Earlier versions of Pitchlore wrote none; such a file is not checked.

    Raises:
        CorruptFile: if it cannot be read as one, or is not what was written.
    """
    remedy = REMEDY_OF_VERSION if model is Manifest else remedy_of(path.parent.name)
    try:
        data = path.read_bytes()
        seal = _SEAL.match(data)
        if seal is not None:
            data = b"{\n" + data[seal.end():]
            if digest(data).encode() != seal[1]:
                raise CorruptFile("is not what was written (its checksum differs)", where=str(path),
                                  next_step=remedy)
        return model.model_validate_json(data)
    except (ValidationError, OSError) as error:
        raise CorruptFile(f"is not a readable {model.__name__.lower()}", where=str(path),
                          next_step=remedy) from error


def remedy_of(noun: str) -> str:
    """Advice on a damaged file of an output."""
    return _REMEDIES.get(noun, REMEDY)


def _take(stream: BinaryIO) -> None:
    """Hold an open file against every other process until it is closed.

    Raises:
        BlockingIOError: if somebody has it, or has removed it since it was opened.
    """
    fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    if not os.fstat(stream.fileno()).st_nlink:
        raise BlockingIOError


def _free(path: Path) -> bool:
    """Whether a file is there and no process holds it."""
    try:
        with path.open("rb") as held:
            fcntl.flock(held, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except (BlockingIOError, FileNotFoundError):
        return False
    return True


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except OSError as error:
        return isinstance(error, PermissionError)
    return True
