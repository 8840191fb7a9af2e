"""Versions: immutable numbered folders, claimed by one process and committed by one rename."""

from __future__ import annotations

import fcntl
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import polars as pl

from pipeline.errors import CorruptFile, NotFound, PitchloreError, StorageFailed
from pipeline.store.files import Files, pretty, read_model, sync, verified
from pipeline.store.receipts import SOFTWARE, FileRecord, Manifest, digest
from pipeline.store.tables import from_parquet, to_parquet
from schemas import Table

VERSION_FOLDER = re.compile(r"^v(\d{4,})$")


class Versions(Files):
    """Versions of a noun and their manifests."""

    def versions(self, noun: str) -> list[int]:
        """The committed versions of a noun, ascending."""
        folder = self.root / noun
        found = (VERSION_FOLDER.match(p.name) for p in folder.iterdir()) if folder.is_dir() else ()
        return sorted(int(m[1]) for m in found if m)

    def manifest(self, noun: str, version: int) -> Manifest:
        """The manifest of a version.

        Raises:
            NotFound: if there is no such version; the message lists those there are.
            CorruptFile: if it is not readable.
        """
        path = self.version_folder(noun, version) / "manifest.json"
        if not path.exists():
            have = ", ".join(map(str, self.versions(noun))) or "none yet"
            raise NotFound(f"{noun} has no version {version} (there are: {have})", where=str(self.root),
                           next_step="Name one of them, or run the stages first")
        manifest = read_model(path, Manifest)
        if manifest.version != version or manifest.noun != noun:
            raise CorruptFile(f"claims to be {manifest.noun} {manifest.version}", where=str(path),
                              next_step="Restore the version's folder from a backup")
        return manifest

    def unreadable_versions(self, noun: str) -> dict[str, str]:
        """Manifests that cannot be read: ``version N`` to what is wrong."""
        found = {}
        for version in self.versions(noun):
            try:
                self.manifest(noun, version)
            except (CorruptFile, NotFound) as error:
                found[f"version {version}"] = str(error)
        return found

    def manifests(self, noun: str) -> list[Manifest]:
        """The readable manifests of a noun, ascending; see also :meth:`unreadable_versions`."""
        found = []
        for version in self.versions(noun):
            with suppress(CorruptFile, NotFound):
                found.append(self.manifest(noun, version))
        return found

    def latest(self, noun: str) -> Manifest | None:
        """The manifest of the newest readable version, None if there is none."""
        manifests = self.manifests(noun)
        return manifests[-1] if manifests else None

    def version_folder(self, noun: str, version: int) -> Path:
        """Where a version's files are."""
        return self.root / noun / f"v{version:04d}"

    def read_version(self, manifest: Manifest, role: str) -> bytes:
        """A file of a version, checked against its manifest.

        Raises:
            NotFound: if the manifest has no such file.
            CorruptFile: if it is gone or its bytes are others.
        """
        folder = self.version_folder(manifest.noun, manifest.version)
        return verified(folder, manifest.files, role, f"{manifest.noun} version {manifest.version}")

    def read_version_table(self, manifest: Manifest, role: str, schema: type[Table]) -> pl.DataFrame:
        """A table of a version, checked like :meth:`read_version`."""
        where = str(self.version_folder(manifest.noun, manifest.version) / manifest.files[role].path
                    if role in manifest.files else manifest.noun)
        return from_parquet(self.read_version(manifest, role), schema, where=where)

    @contextmanager
    def claim(self, noun: str) -> Iterator[int]:
        """Hold the next free version number of a noun, against every other process.

        The number is claimed by the exclusive creation of a file and held by a lock on it, which
        dies with its process: a number whose claimant was killed before it committed is free again.
        """
        folder = self.root / noun
        folder.mkdir(parents=True, exist_ok=True)
        version = (self.versions(noun) or [0])[-1] + 1
        while True:
            path = folder / f"v{version:04d}.claim"
            with suppress(FileExistsError), path.open("x"):
                pass
            with path.open("r+") as held:
                try:
                    fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    version += 1
                    continue
                if self.version_folder(noun, version).exists():
                    version += 1
                    continue
                yield version
                return

    def commit_version(
        self,
        noun: str,
        version: int,
        *,
        parent: int | None,
        key: str,
        inputs: Mapping[str, str],
        settings: Mapping[str, Any],
        seed: int | None = None,
        tables: Mapping[str, tuple[pl.DataFrame, type[Table]]],
        blobs: Mapping[str, tuple[str, bytes]] | None = None,
        counts: Mapping[str, Any] | None = None,
    ) -> Manifest:
        """Write a claimed version aside and commit it by one rename.

        Raises:
            SchemaMismatch: if a table breaks its schema; nothing is written then.
            StorageFailed: if the disk refuses; the versions before it are as they were.
        """
        payloads: dict[str, tuple[str, bytes, str | None, int | None]]
        payloads = {f"{role}.parquet": (role, to_parquet(t, s, where=f"{noun} {version}"), s.tag(), t.height)
                    for role, (t, s) in tables.items()}
        payloads |= {f"{role}.{suffix}": (role, data, None, None)
                     for role, (suffix, data) in (blobs or {}).items()}
        files = {role: FileRecord(path=file, sha256=digest(data), size=len(data), table=tag, rows=rows)
                 for file, (role, data, tag, rows) in sorted(payloads.items())}
        manifest = Manifest(
            noun=noun, version=version, parent=parent, key=key, inputs=dict(inputs), settings=dict(settings),
            seed=seed, software=SOFTWARE, files=files, counts=dict(counts or {}),
        )
        final = self.version_folder(noun, version)
        staging = final.with_name(f".{final.name}.{os.getpid()}-{os.urandom(4).hex()}.staging")
        try:
            staging.mkdir(parents=True)
            try:
                for file, (_, data, _, _) in sorted(payloads.items()):
                    self.write_bytes(staging / file, data)
                self.write_bytes(staging / "manifest.json", pretty(manifest))
                os.rename(staging, final)  # noqa: PTH104 (the tests make os.rename fail)
                sync(final.parent, os.O_RDONLY | os.O_DIRECTORY)
            finally:
                shutil.rmtree(staging, ignore_errors=True)
        except OSError as error:
            raise StorageFailed(
                f"{noun} version {version} cannot be written ({error.strerror or error})", where=str(final),
                next_step="Free space or mend the folder, then run again; earlier versions are untouched",
            ) from error
        return manifest

    def verify_version(self, noun: str, version: int) -> list[str]:
        """What is wrong with a version's files, one line each; empty if nothing is."""
        try:
            manifest = self.manifest(noun, version)
        except PitchloreError as error:
            return [str(error)]
        problems = []
        for role in manifest.files:
            try:
                self.read_version(manifest, role)
            except PitchloreError as error:
                problems.append(str(error))
        folder = self.version_folder(noun, version)
        known = {record.path for record in manifest.files.values()} | {"manifest.json"}
        problems += [f"{folder / p.name}: is not in the manifest." for p in sorted(folder.iterdir())
                     if p.name not in known]
        return problems
