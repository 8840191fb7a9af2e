"""Recordings in a folder that is named in place of files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from pitchlore.pipeline.base.errors import NotFound, PitchloreError
from pitchlore.pipeline.base.text import number_of, printable
from pitchlore.pipeline.importers.packing import Unpacking
from pitchlore.pipeline.importers.readers import HEAD_BYTES, READERS
from pitchlore.pipeline.settings import ImportSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.paths import listed

#: Other files that are named; more are counted.
_NAMED = 8


def recordings_in(
    store: Store, named: Sequence[Path], limits: ImportSettings = ImportSettings()
) -> tuple[tuple[Path, ...], list[str]]:
    """Files to import: those that are named, and those of each named folder and the folders in it.

    A folder's maps, hidden files and hidden folders are left out, and so is the data folder.

    Args:
        store: store of the data folder.
        named: files and folders.
        limits: bounds of a file's size.

    Returns:
        The files, a folder's sorted by path; and for each folder with others a line that names those.

    Raises:
        NotFound: if a folder holds no recording.
        ReadFailed: if a folder, or one in it, cannot be read.
    """
    files, notes = list[Path](), list[str]()
    for path in named:
        if not path.is_dir():
            files.append(path)
            continue
        inside = _files(path, store.root.resolve())
        found = [file for file in inside if _is_recording(store, file, limits)]
        others = [printable(str(file.relative_to(path))) for file in inside if file not in {*found}]
        if not found:
            raise NotFound("holds no recording that can be read by itself" + _listed(others), where=str(path),
                           next_step="Name one of its files to see why not: pitchlore import FILE")
        files += found
        if others:
            notes.append(f"{path}: {number_of(len(found), 'recording')}; no recordings, and passed over"
                         f"{_listed(others)}.")
    return tuple(files), notes


def _files(folder: Path, data: Path) -> list[Path]:
    """All in a folder and the folders in it, but for maps and what is hidden or in the data folder.

    Pipes, links to nothing and links to folders are among them: their import says why they are not read.

    Raises:
        ReadFailed: if a folder cannot be read: what cannot be seen is not gone.
    """
    found, folders = list[Path](), [folder]
    while folders:
        for path in map(Path, listed(folders.pop())):
            if path.name.startswith(".") or Path(os.path.realpath(path)).is_relative_to(data):
                continue
            if path.is_dir() and not path.is_symlink():
                folders.append(path)
            elif path.suffix != ".toml":
                found.append(path)
    return sorted(found)


def _is_recording(store: Store, file: Path, limits: ImportSettings) -> bool:
    """True if a file begins as one of the formats does, or cannot be read, which its import will say."""
    head = b""
    try:
        with store.opened(file, megabytes=limits.megabytes) as data:
            for piece in Unpacking(data, file.name, limits.megabytes):
                head += piece
                if len(head) >= HEAD_BYTES:
                    break
    except PitchloreError:
        return True
    return bool(head) and any(reader.detects(head[:HEAD_BYTES]) for reader in READERS)


def _listed(names: Sequence[str]) -> str:
    """A colon and names, the last ones counted; nothing without names."""
    more = [f"{len(names) - _NAMED} more"] if len(names) > _NAMED else []
    return f": {', '.join([*names[:_NAMED], *more])}" if names else ""
