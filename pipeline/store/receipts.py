"""Receipts and manifests: records of each output, its inputs, and the code that made it."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from pitchlore.pipeline.base.digests import Content, digest
from pitchlore.pipeline.base.toml import Frozen


class FileRecord(Frozen):
    """One file that a receipt or manifest vouches for.

    Attributes:
        path: relative to the data folder (receipts) or the version's folder (manifests).
        sha256: SHA-256 of its bytes.
        size: in bytes.
        table: ``name/version`` of its schema, None if it is not a table.
        rows: number of rows of the table.
    """

    path: str = Field(pattern=r"^\w[\w.-]*(/\w[\w.-]*)?$")  # inside the folder
    sha256: str
    size: int
    table: str | None = None
    rows: int | None = None

    @classmethod
    def of(cls, path: str, data: Content, **about: Any) -> FileRecord:
        """The record of bytes at a path."""
        return cls(path=path, sha256=digest(data), size=len(data), **about)


class Receipt(Frozen):
    """Record of one piece of work: its inputs and its files.

    Attributes:
        noun: the stage.
        name: the output, unique in its noun; usually a match id.
        key: key of the work (:class:`pipeline.store.work.Work`).
        inputs: label to SHA-256.
        settings: settings of the stage.
        seed: None where the stage draws nothing.
        versions: versions of the stage that made it, and of those that it ran itself.
        software: name, version and source hash of the code that made it; provenance only.
        files: by what they hold.
        details: counts and facts that later stages and reports need.
    """

    noun: str
    name: str
    key: str
    inputs: dict[str, str]
    settings: dict[str, Any]
    seed: int | None = None
    versions: dict[str, int]
    software: str
    files: dict[str, FileRecord]
    details: dict[str, Any] = Field(default_factory=dict)

    def digests(self) -> dict[str, str]:
        """SHA-256 of each file, labelled ``noun/name/role``: the inputs of a later stage."""
        return {f"{self.noun}/{self.name}/{role}": f.sha256 for role, f in sorted(self.files.items())}


class Manifest(Receipt):
    """Record of one immutable version. Paths are relative to the version's folder.

    Attributes:
        version: from 1.
        parent: the version that it follows or was made from, None for the first.
    """

    version: int
    parent: int | None


class Quarantined(Frozen):
    """A match or recording that a stage refused, and the reason.

    Attributes:
        noun: the stage that refused it.
        name: the match, or the file's name.
        error: class of the error.
        reason: the error's one line.
    """

    noun: str
    name: str
    error: str
    reason: str
