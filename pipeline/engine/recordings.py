"""Recordings that are to be imported: files that are named, and those of the inbox."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from pydantic import BaseModel, field_serializer

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.base.errors import DamagedLog, NoFrames, PitchloreError, not_readable
from pitchlore.pipeline.base.text import printable
from pitchlore.pipeline.importers.packets.recording import PacketRecording
from pitchlore.pipeline.store import Store

#: Where recordings are dropped for the next run, in the data folder.
INBOX = "inbox"
#: Folder of logs of matches in progress; a log that a killed process left there is imported.
PLAYING = "playing"
#: Folder of recordings of packets in progress; one that a killed process left there goes to the inbox.
WATCHING = "watching"


class Recording(BaseModel):
    """A file to import, or the files of one recording of football.

    Attributes:
        file: the recording, or its first file.
        mapping: a TOML file with its names, units, axes and teams; None for the map that its match has, or
            else the plain form.
        provider: provider of the files (``importers.football.providers``); None if the content tells.
        more: the other files of that provider's recording, in its order.
        form: name of a map that is known already (``importers.forms.presets``), in place of ``mapping``.
    """

    file: Path
    mapping: Path | None = None
    provider: str | None = None
    more: tuple[Path, ...] = ()
    form: str | None = None

    @field_serializer("file", "mapping", when_used="json")
    def _printable(self, path: Path | None) -> str | None:
        """A path for Prefect's records; its bytes need not be UTF-8."""
        return None if path is None else printable(str(path))

    @field_serializer("more", when_used="json")
    def _all_printable(self, paths: tuple[Path, ...]) -> list[str]:
        return [printable(str(path)) for path in paths]

    def at(self, path: Callable[[Path], Path]) -> Recording:
        """The recording with its paths by a function of paths."""
        return self.model_copy(update={
            "file": path(self.file), "mapping": None if self.mapping is None else path(self.mapping),
            "more": tuple(map(path, self.more)),
        })

    def files(self) -> list[Path]:
        """All its files, in order."""
        return [self.file, *self.more]

    def label(self, store: Store) -> str:
        """The recording's path, or its URL in the store's bucket, for people."""
        return printable(store.named(self.file))


def inbox(store: Store) -> list[Recording]:
    """Recordings in the data folder's inbox with their maps, sorted by name, then abandoned logs.

    A log is abandoned if the process that played its match was killed. A recording of packets that was
    abandoned goes to the inbox. The copy of a bucket gets the files of its inbox first.

    Raises:
        StorageFailed: if the bucket cannot be reached.
    """
    if store.mirror is not None:
        store.mirror.pull(store.root / INBOX)
    for file in store.abandoned(WATCHING):
        with suppress(FileNotFoundError):  # another run has moved it
            store.moved(file, INBOX)
    return waiting(store)


def waiting(store: Store) -> list[Recording]:
    """Recordings in the inbox with their maps, then abandoned logs, as they are; nothing is moved."""
    left = [Recording(file=file) for file in store.abandoned(PLAYING)]
    return [recording for recording in _dropped(store) if _is_inside(recording, store)] + left


def strangers(store: Store) -> dict[str, str]:
    """All in the inbox that is never read, with the reason: pipes, devices, links that lead out."""
    why = "it, or its map, is a link that leads out of the inbox, or no regular file; not read. Remove that."
    return {recording.label(store): why for recording in _dropped(store) if not _is_inside(recording, store)}


def _dropped(store: Store) -> list[Recording]:
    """All in the inbox that is no folder, no map and not hidden, with their maps, sorted by name."""

    def refuse(error: OSError) -> None:
        if not isinstance(error, FileNotFoundError):  # there is no inbox yet
            raise not_readable(str(error.filename), error, "Make it a folder") from error

    found = (Path(folder, name) for folder, folders, files in os.walk(store.root / INBOX, onerror=refuse)
             for name in (*folders, *files))
    return [with_map(path) for path in sorted(found)
            if path.suffix != ".toml" and not path.name.startswith(".")
            and (path.is_symlink() or not path.is_dir())]


def _is_inside(recording: Recording, store: Store) -> bool:
    """True if the recording and its map are regular files in the inbox, or links to such."""
    try:
        real = [path.resolve(strict=True) for path in (recording.file, recording.mapping) if path is not None]
    except (OSError, RuntimeError):  # a link to nothing, or to itself
        return False
    return all(path.is_file() and path.is_relative_to((store.root / INBOX).resolve()) for path in real)


def with_map(file: Path) -> Recording:
    """Recording with the map beside it, if there is one.

    The map of ``x.csv`` is ``x.csv.toml``, else ``map.toml`` in its folder.
    """
    maps = (file.with_name(f"{file.name}.toml"), file.with_name("map.toml"))
    return Recording(file=file, mapping=next((m for m in maps if os.path.lexists(m)), None))


def useless(store: Store) -> list[Path]:
    """Remove and return the logs and recordings that were killed before anything was in them."""
    return [file for folder, empty in ((PLAYING, _nothing_logged), (WATCHING, _nothing_recorded))
            for file in store.abandoned(folder) if store.discard(file, empty)]


def _nothing_recorded(data: bytes) -> bool:
    """True if a recording has no packet."""
    try:
        return not any(True for _ in PacketRecording(data, "").packets())
    except DamagedLog:
        return True


def _nothing_logged(data: bytes) -> bool:
    """True if a log has no frame."""
    try:
        log.read(data, where="")
    except NoFrames:
        return True
    except PitchloreError:
        return not data
    return False
