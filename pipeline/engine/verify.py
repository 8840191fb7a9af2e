"""Verification of a data folder: files, and what versions and outputs were made from."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pitchlore.pipeline.base.errors import NotFound, PitchloreError
from pitchlore.pipeline.engine import imitations
from pitchlore.pipeline.engine.knowledge import lineage
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.paths import listed
from pitchlore.pipeline.store.sealed import REMEDY_OF_VERSION
from pitchlore.pipeline.store.thinning import removed_versions
from pitchlore.pipeline.store.verification import Verification, restore, verify, verify_parts


def verify_all(store: Store, *, season: bool = False) -> Verification:
    """Check a data folder, and those of its seasons and imitations: files, checksums, lineage.

    Args:
        store: the data folder.
        season: whether it is that of a season, which may discard matches after it has learned from them.
    """
    versions = [(noun, version) for noun in STAGES.versioned for version in store.versions(noun)]
    found = verify(store, STAGES.receipted, versions)
    verify_parts(store, found)
    found.others += _parents(store)
    if not season:
        found.others += _matches(store)
    inner_folders = [] if season else [
        *((store.root / "seasons" / name, True) for name in store.names("seasons")),
        *((Path(folder), False) for folder in listed(store.root / imitations.FOLDER))]
    for folder, discards in inner_folders:
        if folder.is_dir():
            inner = verify_all(Store(folder), season=discards)
            found.files += inner.files
            found.size += inner.size
            found.unsealed += inner.unsealed
            found.damages += inner.damages
            found.others += inner.others
    return found


def verify_knowledge(store: Store, version: int | None = None) -> Verification:
    """Check the versions of the knowledge, or one of them.

    Raises:
        NotFound: if there is no version of that number.
    """
    if version is not None and version not in store.versions("knowledge"):
        store.manifest("knowledge", version)  # says which there are
    numbers = store.versions("knowledge") if version is None else [version]
    return verify(store, (), [("knowledge", number) for number in numbers])


def backup_at(path: Path) -> Files:
    """A backup of the data folder.

    Args:
        path: its folder, or the URL of its bucket.

    Raises:
        NotFound: if there is none.
        StorageFailed: if it is in a bucket that cannot be reached.
    """
    backup = Files(path)
    backup.catch_up()
    if not backup.root.is_dir():
        raise NotFound("is not a folder", where=str(path), next_step="Name a copy of the data folder")
    if backup.mirror is not None and next(backup.root.glob("*/*.receipt.json"), None) is None:
        raise NotFound("there is no data folder", where=backup.where,
                       next_step="Name a copy of the data folder")
    return backup


def mend(found: Verification, store: Store, backup: Files) -> list[Path]:
    """Restore damaged files from a backup of the data folder. Returns those that were restored.

    Raises:
        StorageFailed: if the disk or the bucket refuses.
    """
    return [damage.path for damage in found.damages if restore(damage, store, backup)]


def _parents(store: Store) -> Iterator[str]:
    """The versions that are lost, and that others follow or were made from, a line each."""
    for noun in STAGES.versioned:
        there = store.versions(noun)
        removed, damage = removed_versions(store, noun)
        yield from damage
        for version in there:
            try:
                manifest = store.manifest(noun, version)
            except PitchloreError:
                continue  # it is among the problems already
            where = f"{noun} version {manifest.version}"
            if manifest.parent not in (None, *there, *removed):
                yield f"{where}: version {manifest.parent}, which it follows, is gone. {REMEDY_OF_VERSION}."
            try:
                if noun == "knowledge":
                    list(lineage(store, manifest))
                elif "knowledge_version" in manifest.details:
                    store.manifest("knowledge", manifest.details["knowledge_version"])
            except PitchloreError as error:
                yield f"{where}: {error}"


def _matches(store: Store) -> Iterator[str]:
    """The outputs whose match is gone, a line each."""
    matches = {*store.names("matches")}
    for noun in STAGES.nouns(Per.MATCH):
        for name in store.names(noun):
            if name not in matches:
                yield (f"{noun} {name}: its match is gone. "
                       f"Import it again, or remove what is left: `pitchlore forget {name}`.")
