"""Recordings that were imported before, known by the stamps of their files, so that none is opened again.

To know a recording by its content takes its bytes. Once it is imported, the size and time of change of its
files tell that it is the same. This is a cache: without it, every recording is opened.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.sealed import Stamp, read_cache, sealed, settled

#: The cache in a data folder.
NAME = ".recordings.json"
#: Most recordings that are remembered; the oldest are forgotten first.
_MOST = 100_000


class KnownRecordings(Frozen):
    """Recordings of known content.

    Attributes:
        recordings: stamps of the files and SHA-256 of the content, by the files' paths.
    """

    recordings: Mapping[str, tuple[str, str]] = {}


class Arrivals:
    """The recordings of a data folder whose content is known.

    A bucket has none: another machine may write to it.

    Args:
        store: the data folder.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        known = read_cache(store.root / NAME, KnownRecordings) if store.mirror is None else None
        self._known = dict(known.recordings) if known is not None else {}
        self._before = dict(self._known)

    def content(self, files: Sequence[Path]) -> str | None:
        """SHA-256 of a recording's content; None if it is not known, or a file has changed since."""
        stamps, sha256 = self._known.get(_name(files), ("", ""))
        return sha256 if stamps and stamps == stamps_of(files) else None

    def before_it_grew(self, files: Sequence[Path]) -> str | None:
        """SHA-256 of what a recording was when it was imported, if it goes on since; else None."""
        stamps, sha256 = self._known.get(_name(files), ("", ""))
        if not stamps or len(files) != 1:
            return None
        hashed, left = hashlib.sha256(), int(stamps.split(", ")[1])
        with suppress(OSError), files[0].open("rb") as file:
            while left and (data := file.read(min(left, 1 << 20))):
                hashed.update(data)
                left -= len(data)
            if file.read(1) and hashed.hexdigest() == sha256:
                return sha256
        return None

    def note(self, files: Sequence[Path], stamps: str, sha256: str) -> None:
        """Note the content of a recording whose files had these stamps before they were read."""
        if stamps:
            self._known.pop(_name(files), None)
            self._known[_name(files)] = stamps, sha256

    def keep(self) -> None:
        """Write what was noted."""
        if self._store.mirror is None and self._known != self._before:
            newest = dict(list(self._known.items())[-_MOST:])
            self._store.keep(self._store.root / NAME, sealed(KnownRecordings(recordings=newest)))


def stamps_of(files: Sequence[Path]) -> str:
    """The stamps of some files; empty if one is missing, or so young that another may look the same."""
    now_ns = time.time_ns()
    try:
        stamps = [_stamp(file) for file in files]
    except OSError:
        return ""
    return " ".join(map(str, stamps)) if all(settled(stamp, now_ns) for stamp in stamps) else ""


def _stamp(file: Path) -> Stamp:
    """Inode, size and time of the last change that the system saw, ns; ``cp -p`` cannot set that."""
    found = file.stat()
    return found.st_ino, found.st_size, max(found.st_ctime_ns, found.st_mtime_ns)


def _name(files: Sequence[Path]) -> str:
    return "\0".join(str(file.absolute()) for file in files)
