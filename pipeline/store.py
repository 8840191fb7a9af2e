"""The only room that touches the data folder: atomic files, receipts, versions, quarantine.

A stage's output is content-addressed: its name carries a key over its inputs, settings, seed,
schema and software version. A receipt names the current files of one output; it is written last
and by one rename, so whatever kills a run leaves either the old output or the new one, whole.
Nothing here reads a clock: the same work gives the same bytes.
"""

from __future__ import annotations

import fcntl
import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

import polars as pl
from pydantic import BaseModel, ValidationError

from pipeline.errors import BadSettings, CorruptFile, NotFound, PitchloreError, StorageFailed, in_one_line
from pipeline.receipts import SOFTWARE, FileRecord, Manifest, Quarantined, Receipt, digest
from pipeline.tables import from_parquet, to_parquet
from schemas import Table

SAFE_NAME = re.compile(r"^[a-z0-9][a-z0-9.-]{0,95}$")
KEYED_FILE = re.compile(r"-[0-9a-f]{12}\.(?!receipt\.)[a-z0-9_-]+\.[a-z]+$")
VERSION_FOLDER = re.compile(r"^v(\d{4,})$")
M = TypeVar("M", bound=BaseModel)
REMEDY_OF_VERSION = "Restore the version's folder from a backup; the other versions are not affected"
REMEDY = "Delete it and run again to make it anew, or restore it from a backup"


class Store:
    """The data folder.

    Args:
        root: the folder; made when something is written.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    # --- files ---------------------------------------------------------------------------

    @contextmanager
    def aside(self, path: Path) -> Iterator[Path]:
        """A temporary path beside ``path``; what is there in the end is moved to ``path``.

        The file is there whole or not at all, even through a crash.

        Raises:
            StorageFailed: if the disk refuses; the old file, if any, is as it was.
        """
        temporary = path.with_name(f".{path.name}.{os.getpid()}-{os.urandom(4).hex()}.tmp")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                yield temporary
                _sync(temporary, os.O_RDONLY)
                os.replace(temporary, path)  # noqa: PTH105 (the tests make os.replace fail)
                _sync(path.parent, os.O_RDONLY | os.O_DIRECTORY)
            finally:
                temporary.unlink(missing_ok=True)
        except OSError as error:
            raise StorageFailed(
                f"cannot be written ({error.strerror or error})", where=str(path),
                next_step="Free space or mend the folder, then run again; nothing that was there is lost",
            ) from error

    def write_bytes(self, path: Path, data: bytes) -> None:
        """Atomically write bytes (see :meth:`aside`)."""
        with self.aside(path) as temporary:
            temporary.write_bytes(data)

    def sweep(self) -> int:
        """Remove temporary files and staging folders of processes that are gone; how many."""
        swept = 0
        for path in [*self.root.glob("*/.*.tmp"), *self.root.glob("*/.*.staging"), *self.root.glob(".*.tmp")]:
            owner = re.search(r"\.(\d+)-[0-9a-f]+\.(?:tmp|staging)$", path.name)
            if owner and not _alive(int(owner[1])):
                if path.is_dir():
                    shutil.rmtree(path, ignore_errors=True)
                else:
                    path.unlink(missing_ok=True)
                swept += 1
        return swept

    def foreign(self, path: Path) -> bytes:
        """The bytes of a file that is not ours; it is only ever read.

        Raises:
            NotFound: if it cannot be read.
        """
        try:
            return path.read_bytes()
        except OSError as error:
            raise NotFound(f"cannot be read ({error.strerror or error})", where=str(path),
                           next_step="Name an existing file that you may read") from error

    # --- receipts ------------------------------------------------------------------------

    def receipt(self, noun: str, name: str) -> Receipt | None:
        """The receipt of an output, None if there is none.

        Raises:
            CorruptFile: if the receipt is not readable.
        """
        path = self._receipt_path(noun, name)
        return _read_model(path, Receipt) if path.exists() else None

    def receipts(self, noun: str) -> Iterator[Receipt]:
        """All readable receipts of a noun, in order of name; see also :meth:`unreadable`."""
        for path in sorted((self.root / noun).glob("*.receipt.json")):
            with suppress(CorruptFile):
                yield _read_model(path, Receipt)

    def unreadable(self, noun: str) -> dict[str, str]:
        """Receipts and manifests of a noun that cannot be read: name to what is wrong."""
        found = {}
        for path in sorted((self.root / noun).glob("*.receipt.json")):
            try:
                _read_model(path, Receipt)
            except CorruptFile as error:
                found[path.name.removesuffix(".receipt.json")] = str(error)
        for version in self.versions(noun):
            try:
                self.manifest(noun, version)
            except (CorruptFile, NotFound) as error:
                found[f"version {version}"] = str(error)
        return found

    def holding(self, noun: str, name: str, key: str) -> Receipt | None:
        """The receipt of an output if it stands for this very work and its files are there."""
        try:
            receipt = self.receipt(noun, name)
        except CorruptFile:
            return None
        if receipt is None or receipt.key != key:
            return None
        for record in receipt.files.values():
            path = self.root / record.path
            if not path.exists() or path.stat().st_size != record.size:
                return None
        return receipt

    def commit(
        self,
        noun: str,
        name: str,
        key: str,
        *,
        inputs: Mapping[str, str],
        settings: Mapping[str, Any],
        seed: int | None = None,
        tables: Mapping[str, tuple[pl.DataFrame, type[Table]]] | None = None,
        blobs: Mapping[str, tuple[str, bytes]] | None = None,
        details: Mapping[str, Any] | None = None,
    ) -> Receipt:
        """Write an output's files, then its receipt: the commit is the receipt's rename.

        Args:
            noun: the stage.
            name: the output.
            key: from :func:`key_of`.
            inputs: label to SHA-256.
            settings: of the stage, JSON-able.
            seed: of the stage.
            tables: what a file holds, to the table and its schema.
            blobs: what a file holds, to its suffix and bytes.
            details: JSON-able facts.

        Raises:
            SchemaMismatch: if a table breaks its schema; nothing is written then.
            StorageFailed: if the disk refuses; the old output stands.
        """
        payloads: dict[str, tuple[str, bytes, str | None, int | None]] = {}
        for role, (frame, schema) in sorted((tables or {}).items()):
            data = to_parquet(frame, schema, where=f"{noun} {name}")
            payloads[role] = ("parquet", data, schema.tag(), frame.height)
        for role, (suffix, data) in sorted((blobs or {}).items()):
            payloads[role] = (suffix, data, None, None)
        files = {}
        for role, (suffix, data, table, rows) in payloads.items():
            relative = f"{noun}/{_safe(name)}-{key[:12]}.{role}.{suffix}"
            self.write_bytes(self.root / relative, data)
            files[role] = FileRecord(
                path=relative, sha256=digest(data), size=len(data), table=table, rows=rows
            )
        receipt = Receipt(
            noun=noun, name=name, key=key, inputs=dict(inputs), settings=dict(settings), seed=seed,
            software=SOFTWARE, files=files, details=dict(details or {}),
        )
        self.write_bytes(self._receipt_path(noun, name), _pretty(receipt))
        return receipt

    def read(self, receipt: Receipt, role: str) -> bytes:
        """A file's bytes, checked against the receipt.

        Raises:
            NotFound: if the receipt has no such file.
            CorruptFile: if it is gone or its bytes are others.
        """
        return _verified(self.root, receipt.files, role, f"{receipt.noun} {receipt.name}")

    def read_table(self, receipt: Receipt, role: str, schema: type[Table]) -> pl.DataFrame:
        """A table, its bytes checked against the receipt and its tag against the schema.

        Raises:
            NotFound, CorruptFile, SchemaMismatch: as for :meth:`read` and :func:`from_parquet`.
        """
        data = self.read(receipt, role)
        return from_parquet(data, schema, where=str(self.root / receipt.files[role].path))

    def intact(self, receipt: Receipt) -> bool:
        """Whether all files of a receipt are there, byte for byte."""
        try:
            for role in receipt.files:
                self.read(receipt, role)
        except CorruptFile:
            return False
        return True

    def forget(self, noun: str, name: str) -> bool:
        """Remove an output, its receipt first; whether there was one."""
        path = self._receipt_path(noun, name)
        if not path.exists():
            return False
        with suppress(CorruptFile):
            files = _read_model(path, Receipt).files.values()
            path.unlink()
            for record in files:
                (self.root / record.path).unlink(missing_ok=True)
        path.unlink(missing_ok=True)
        return True

    def prune(self, noun: str) -> list[Path]:
        """Remove the files of a noun that no receipt names any more; which."""
        if self.unreadable(noun):
            return []
        named = {self.root / record.path
                 for receipt in self.receipts(noun) for record in receipt.files.values()}
        left = [path for path in sorted((self.root / noun).glob("*"))
                if path.is_file() and KEYED_FILE.search(path.name) and path not in named]
        for path in left:
            path.unlink()
        return left

    @contextmanager
    def locked(self, noun: str) -> Iterator[None]:
        """Hold a noun against every other thread and process for a moment."""
        folder = self.root / noun
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / ".lock").open("a") as held:
            fcntl.flock(held, fcntl.LOCK_EX)
            yield

    def verify_receipts(self, noun: str) -> list[str]:
        """What is wrong with the files that a noun's receipts name, one line each."""
        problems = []
        for path in sorted((self.root / noun).glob("*.receipt.json")):
            try:
                receipt = _read_model(path, Receipt)
                for role in receipt.files:
                    self.read(receipt, role)
            except PitchloreError as error:
                problems.append(str(error))
        return problems

    def _receipt_path(self, noun: str, name: str) -> Path:
        return self.root / noun / f"{_safe(name)}.receipt.json"

    # --- versions ------------------------------------------------------------------------

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
        manifest = _read_model(path, Manifest)
        if manifest.version != version or manifest.noun != noun:
            raise CorruptFile(f"claims to be {manifest.noun} {manifest.version}", where=str(path),
                              next_step="Restore the version's folder from a backup")
        return manifest

    def manifests(self, noun: str) -> list[Manifest]:
        """The readable manifests of a noun, ascending; see also :meth:`unreadable`."""
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
        return _verified(folder, manifest.files, role, f"{manifest.noun} version {manifest.version}")

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
                self.write_bytes(staging / "manifest.json", _pretty(manifest))
                os.rename(staging, final)  # noqa: PTH104 (the tests make os.rename fail)
                _sync(final.parent, os.O_RDONLY | os.O_DIRECTORY)
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

    # --- quarantine ----------------------------------------------------------------------

    def quarantine(self, noun: str, name: str, error: Exception) -> Quarantined:
        """Record why a stage could not take a match; nothing of the match is touched."""
        record = Quarantined(noun=noun, name=name, error=type(error).__name__, reason=in_one_line(error))
        self.write_bytes(self._quarantine_path(noun, name), _pretty(record))
        return record

    def release(self, noun: str, name: str) -> None:
        """Forget a quarantine, because the stage took the match now."""
        self._quarantine_path(noun, name).unlink(missing_ok=True)

    def quarantined(self) -> list[Quarantined]:
        """All that is in quarantine, in order of stage and name."""
        return [_read_model(p, Quarantined) for p in sorted((self.root / "quarantine").glob("*.json"))]

    def _quarantine_path(self, noun: str, name: str) -> Path:
        return self.root / "quarantine" / f"{_safe(noun)}.{_safe(name)}.json"


def _sync(path: Path, flags: int) -> None:
    """Make a file's bytes, or a folder's renames, survive a power cut."""
    descriptor = os.open(path, flags)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _safe(name: str) -> str:
    if not SAFE_NAME.match(name):
        raise BadSettings(f"{name!r} is not a safe file name", next_step="Name it otherwise")
    return name


def _pretty(model: BaseModel) -> bytes:
    text = json.dumps(model.model_dump(mode="json"), indent=1, sort_keys=True, allow_nan=False)
    return text.encode() + b"\n"


def _read_model(path: Path, model: type[M]) -> M:
    try:
        return model.model_validate_json(path.read_bytes())
    except (ValidationError, OSError) as error:
        raise CorruptFile(f"is not a readable {model.__name__.lower()}", where=str(path),
                          next_step=REMEDY if model is Receipt else REMEDY_OF_VERSION) from error


def _verified(folder: Path, files: Mapping[str, FileRecord], role: str, what: str) -> bytes:
    if role not in files:
        raise NotFound(f"{what} has no {role} (there are: {', '.join(sorted(files))})",
                       next_step="Run the stages again")
    path = folder / files[role].path
    remedy = "Import the recording again" if what.startswith("matches ") else REMEDY
    try:
        data = path.read_bytes()
    except OSError as error:
        raise CorruptFile(f"cannot be read ({error.strerror})", where=str(path),
                          next_step=remedy) from error
    if digest(data) != files[role].sha256:
        raise CorruptFile("is not what was written (SHA-256 differs)", where=str(path), next_step=remedy)
    return data


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
