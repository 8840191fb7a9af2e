"""Removal of old versions, on purpose: what was removed is noted, so that it is told from what was lost."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from pitchlore.pipeline.base.errors import CorruptFile, unwritable
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.store.mirrors import Mirror
from pitchlore.pipeline.store.sealed import read_model, sealed
from pitchlore.pipeline.store.temporaries import temporary_beside
from pitchlore.pipeline.store.versions import Versions

_RESTORE = "Copy it from a backup of the data folder: versions that it noted as removed count as lost"


class Thinned(Frozen):
    """Numbers of the versions of a noun that were removed on purpose, ascending."""

    versions: tuple[int, ...] = ()


def removed_versions(store: Versions, noun: str) -> tuple[frozenset[int], list[str]]:
    """Numbers of the versions of a noun that were removed on purpose; and the damage of their note."""
    try:
        found = read_model(str(_note(store, noun)), Thinned)
    except CorruptFile as error:
        return frozenset(), [f"{error.where}: {error.what}. {_RESTORE}."]
    return frozenset(found.versions) if found is not None else frozenset(), []


def remove_versions(store: Versions, noun: str, versions: Iterable[int]) -> None:
    """Remove versions of a noun, each at once; they are noted before. Numbers are never given again.

    Who calls it holds the locks of the noun and of removal, and keeps the newest version. After a kill some
    of them may still be there: the next call with them removes these.

    Raises:
        CorruptFile: if the note of those removed before is damaged; nothing is removed then.
        StorageFailed: if the disk refuses, or the bucket cannot be reached.
    """
    gone = sorted(versions)
    if not gone:
        return
    before, damage = removed_versions(store, noun)
    if damage:
        raise CorruptFile("is damaged", where=str(_note(store, noun)), next_step=_RESTORE)
    store.keep(_note(store, noun), sealed(Thinned(versions=tuple(sorted(before.union(gone))))))
    for folder in (store.version_folder(noun, version) for version in gone):
        if store.mirror is not None:
            _remove_objects(store.mirror, folder)
        elif folder.exists():
            _remove_folder(folder)


def _note(store: Versions, noun: str) -> Path:
    return store.root / noun / "thinned.json"


def _remove_folder(folder: Path) -> None:
    """Remove a folder by one rename; what a kill leaves then is swept as any temporary folder."""
    aside = temporary_beside(folder, "staging")
    try:
        os.rename(folder, aside)  # noqa: PTH104 (as in Versions.commit_version)
    except OSError as error:
        raise unwritable(folder, error) from error
    shutil.rmtree(aside, ignore_errors=True)


def _remove_objects(mirror: Mirror, folder: Path) -> None:
    """Remove the objects of a version, its manifest first: without one there is no version."""
    mirror.remove(folder / "manifest.json")
    for entry in mirror.bucket.listing(mirror.key(folder) + "/"):
        mirror.remove(mirror.folder / entry.key)
