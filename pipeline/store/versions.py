"""Versions: immutable numbered folders, committed by one rename; in a bucket by a manifest that is new."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from pitchlore.pipeline.base.digests import Content
from pitchlore.pipeline.base.errors import CorruptFile, NotFound, Overtaken, StorageFailed
from pitchlore.pipeline.base.software import software
from pitchlore.pipeline.base.system import sync_folder
from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.store.mirrors import Mirror, key_of
from pitchlore.pipeline.store.paths import listed
from pitchlore.pipeline.store.reading import Reading
from pitchlore.pipeline.store.receipts import FileRecord, Manifest
from pitchlore.pipeline.store.sealed import REMEDY_OF_VERSION, read_cache, read_model, sealed
from pitchlore.pipeline.store.temporaries import temporary_beside
from pitchlore.pipeline.store.work import Made, Work, contents

VERSION_FOLDER = re.compile(r"^v(\d{4,})$")
#: Key of a file of a version; the folder, and the name.
_FILE = re.compile(r"(.+/v\d{4,})/((?!manifest\.json$)[^/]+)")


class Confirmed(Frozen):
    """The key of work, and the version that equals its outcome."""

    key: str
    version: int


class Versions(Reading):
    """Versions of a noun and their manifests."""

    def versions(self, noun: str) -> list[int]:
        """The committed versions of a noun, ascending."""
        found = (VERSION_FOLDER.match(path.rpartition("/")[2]) for path in listed(self.root / noun))
        return sorted(int(m[1]) for m in found if m)

    def manifest(self, noun: str, version: int) -> Manifest:
        """The manifest of a version.

        Raises:
            NotFound: if there is no such version; the message lists those there are.
            CorruptFile: if it is damaged or lost.
        """
        path = self.version_folder(noun, version) / "manifest.json"
        manifest = self.record(str(path), Manifest)
        if manifest is None:
            there = self.versions(noun)
            if version in there:
                raise CorruptFile("is lost", where=str(path), next_step=REMEDY_OF_VERSION)
            have = ", ".join(map(str, there)) or "none yet"
            raise NotFound(f"{noun} has no version {version} (there are: {have})", where=self.where,
                           next_step="Name one of them, or run the stages first")
        if manifest.version != version or manifest.noun != noun:
            raise CorruptFile(f"claims to be {manifest.noun} {manifest.version}", where=str(path),
                              next_step=REMEDY_OF_VERSION)
        return manifest

    def tried_versions(self, noun: str) -> Iterator[tuple[int, Manifest | CorruptFile]]:
        """The versions of a noun, ascending, each with its manifest, or with the error of a damaged one."""
        for version in self.versions(noun):
            try:
                yield version, self.manifest(noun, version)
            except CorruptFile as error:
                yield version, error

    def manifests(self, noun: str) -> list[Manifest]:
        """The manifests of a noun, ascending.

        Raises:
            CorruptFile: if one is damaged, unless the store may leave it out.
        """
        found = []
        for _, manifest in self.tried_versions(noun):
            if isinstance(manifest, Manifest):
                found.append(manifest)
            else:
                self.go_on_without(manifest)
        return found

    def latest(self, noun: str) -> Manifest | None:
        """The manifest of the newest version, None if there is none.

        Raises:
            CorruptFile: if it is damaged: an older one is not the newest. See also :meth:`newest_whole`.
        """
        versions = self.versions(noun)
        return self.manifest(noun, versions[-1]) if versions else None

    def whole_versions(self, noun: str) -> list[Manifest]:
        """The manifests of a noun, ascending, but damaged ones.

        Who makes something of them says what it was made without (:mod:`pipeline.engine.versions`).
        """
        return [found for _, found in self.tried_versions(noun) if isinstance(found, Manifest)]

    def newest_whole(self, noun: str) -> Manifest | None:
        """The newest of :meth:`whole_versions`, None if there is none."""
        return next(reversed(self.whole_versions(noun)), None)

    @contextmanager
    def claim(self, noun: str) -> Iterator[int]:
        """Hold the next version number of a noun: nobody else on this machine makes a version meanwhile.

        If a process is killed before its commit, its number is free again. Of machines that share a bucket,
        several may hold the same number: the first to commit has it (:meth:`commit_version`).

        Raises:
            BucketFailed: if the bucket cannot be reached.
        """
        with self.locked(noun):
            self.catch_up()
            yield (self.versions(noun) or [0])[-1] + 1

    def commit_version(self, work: Work, made: Made, version: int, *, parent: int | None) -> Manifest:
        """Write a version aside and commit it by one rename; in a bucket by creating its manifest, the last.

        Args:
            work: work that made it.
            made: its tables and other files.
            version: the number, from :meth:`claim`.
            parent: the version that it follows, None for the first.

        Raises:
            SchemaMismatch: if a table breaks its schema; nothing is written then.
            StorageFailed: if the disk refuses; the versions before it are as they were.
            Overtaken: if another machine has made the version meanwhile.
        """
        noun = work.noun
        written = contents(made, where=f"{noun} {version}")
        manifest = Manifest(
            noun=noun, name=work.name, version=version, parent=parent, key=work.key, inputs=dict(work.inputs),
            settings=dict(work.settings), seed=work.seed, versions=work.versions, software=software(),
            files={role: record for role, (record, _) in written.items()},
            details=dict(made.details),
        )
        final = self.version_folder(noun, version)
        staging = temporary_beside(final, "staging")
        try:
            staging.mkdir(parents=True)
            try:
                for record, data in written.values():
                    self.write_bytes(staging / record.path, data)
                self.write_bytes(staging / "manifest.json", sealed(manifest))
                if self.mirror is not None:
                    self._publish(self.mirror, final, dict(written.values()), sealed(manifest))
                os.rename(staging, final)  # noqa: PTH104 (the tests make os.rename fail)
                sync_folder(final.parent)
            finally:
                shutil.rmtree(staging, ignore_errors=True)
        except OSError as error:
            raise StorageFailed(
                f"{noun} version {version} cannot be written ({error.strerror or error})", where=str(final),
                next_step="Free space or mend the folder, then run again; earlier versions are untouched",
            ) from error
        return manifest

    @staticmethod
    def _publish(mirror: Mirror, final: Path, files: Mapping[FileRecord, Content], manifest: bytes) -> None:
        """Write a version to a bucket, the manifest last, unless there is one."""
        mirror.put_all({final / record.path: data for record, data in files.items()}, local=False)
        if not mirror.create(final / "manifest.json", manifest, local=False):
            raise Overtaken("has been made by another machine meanwhile", where=mirror.where(final),
                            next_step="Run again: it goes on from what stands")
        shutil.rmtree(final, ignore_errors=True)  # if it is there, it is the same one

    def prune_versions(self) -> list[Path]:
        """Remove from the bucket the files of versions that their manifests do not name.

        They are of makers that were overtaken. A version that stands is never made again, so nobody needs
        them. Files of a version without a readable manifest stay: somebody may be making it.

        Returns:
            The paths that the removed files have in the copy; none without a bucket.

        Raises:
            BucketFailed: if the bucket cannot be reached.
        """
        if self.mirror is None:
            return []
        keys = [entry.key for entry in self.mirror.bucket.listing()]
        left = [self.mirror.folder / key for key in keys if _overtaken(self.mirror.folder, key)]
        for path in left:
            self.mirror.remove(path)
        return left

    def confirm(self, work: Work, version: int) -> None:
        """Note that this work gives the content of an existing version, so that it is not done again."""
        self.keep(self._confirmed(work.noun), sealed(Confirmed(key=work.key, version=version)))

    def standing(self, work: Work) -> Manifest | None:
        """The newest version, if it is of this work or was confirmed for it; else None."""
        newest = self.newest_whole(work.noun)
        if newest is None or newest.key == work.key:
            return newest
        same = Confirmed(key=work.key, version=newest.version)
        return newest if read_cache(self._confirmed(work.noun), Confirmed) == same else None

    def _confirmed(self, noun: str) -> Path:
        return self.root / noun / "confirmed.json"


def _overtaken(copy: Path, key: str) -> bool:
    """True if a key is that of a file in the folder of a version whose manifest does not name it."""
    found = _FILE.fullmatch(key)
    if found is None:
        return False
    folder, name = found.groups()
    with suppress(CorruptFile):
        manifest = read_model(f"{copy}/{folder}/manifest.json", Manifest)
        return manifest is not None and all(
            name not in (record.path, key_of(f"{folder}/{record.path}", record.sha256).rpartition("/")[2])
            for record in manifest.files.values())
    return False
