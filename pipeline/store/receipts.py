"""Receipts, manifests, and the keys that say whether work is already done. No disk in here."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from pipeline import __version__
from schemas import Table


def _code() -> str:
    """SHA-256 over the stages' and schemas' source and data: what is computed changes only with it."""
    sources = sorted(
        (f"{package}/{path.relative_to(root).as_posix()}", path)
        for package in ("pipeline", "schemas")
        for root in [Path(str(files(package)))]
        for path in root.rglob("*")
        if path.suffix in (".py", ".msg", ".csv")
    )
    return digest(b"\0".join(name.encode() + b"\0" + path.read_bytes() for name, path in sources))


def digest(data: bytes) -> str:
    """SHA-256 in hex."""
    return hashlib.sha256(data).hexdigest()


#: Name, version and code of what writes receipts; part of every key.
SOFTWARE = f"pitchlore {__version__}+{_code()[:8]}"


class FileRecord(BaseModel):
    """One file that a receipt or manifest vouches for.

    Attributes:
        path: relative to the data folder (receipts) or the version's folder (manifests).
        sha256: of its bytes.
        size: in bytes.
        table: ``name/version`` of its schema, None for what is not a table.
        rows: of the table.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    path: str
    sha256: str
    size: int
    table: str | None = None
    rows: int | None = None


class Receipt(BaseModel):
    """Proof of one output of one stage: what it was made from and what it is.

    Attributes:
        noun: the stage.
        name: the output, unique in its noun; usually a match id.
        key: hash over noun, name, inputs, settings, seed, schemas and software.
        inputs: label to SHA-256.
        settings: of the stage.
        seed: None where the stage draws nothing.
        software: name, version and code of the writer.
        files: by what they hold.
        details: counts and facts that later stages and reports need.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    noun: str
    name: str
    key: str
    inputs: dict[str, str]
    settings: dict[str, Any]
    seed: int | None = None
    software: str
    files: dict[str, FileRecord]
    details: dict[str, Any] = Field(default_factory=dict)

    def digests(self) -> dict[str, str]:
        """The files' SHA-256 labelled ``noun/name/file``: what a later stage states as its inputs."""
        return {f"{self.noun}/{self.name}/{role}": f.sha256 for role, f in sorted(self.files.items())}


class Manifest(BaseModel):
    """What an immutable version holds and came from.

    Attributes:
        noun: knowledge or policies.
        version: from 1.
        parent: the version it follows, None for the first.
        key: hash over inputs, settings, seed, schemas and software, without the parent.
        inputs: label to SHA-256.
        settings, seed, software: as in a receipt.
        files: paths relative to the version's folder.
        counts: what a person wants to know at a glance.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    noun: str
    version: int
    parent: int | None
    key: str
    inputs: dict[str, str]
    settings: dict[str, Any]
    seed: int | None = None
    software: str
    files: dict[str, FileRecord]
    counts: dict[str, Any] = Field(default_factory=dict)


class Quarantined(BaseModel):
    """A match that a stage could not take, and why.

    Attributes:
        noun: the stage that refused it.
        name: the match, or the file's name.
        error: class of the error.
        reason: the error's one line.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    noun: str
    name: str
    error: str
    reason: str


def canonical(value: object) -> bytes:
    """JSON bytes that are the same for the same value: sorted keys, no spaces, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def fingerprint(settings: BaseModel) -> str:
    """SHA-256 in hex of all that settings say.

    Ids are made of it, so its JSON stays spelt with spaces, and a field that was renamed keeps its first
    name here, as its ``serialization_alias``.
    """
    return digest(json.dumps(settings.model_dump(mode="json", by_alias=True), sort_keys=True).encode())


def key_of(
    noun: str,
    name: str,
    *,
    inputs: Mapping[str, str],
    settings: Mapping[str, Any],
    seed: int | None = None,
    tables: tuple[type[Table], ...] = (),
) -> str:
    """The 16 hex digits that stand for one piece of work."""
    work = [noun, name, dict(inputs), dict(settings), seed, [table.tag() for table in tables], SOFTWARE]
    return digest(canonical(work))[:16]
