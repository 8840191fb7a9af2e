"""Digests of bytes and of settings: keys and ids are made of them."""

from __future__ import annotations

import hashlib
import json
from mmap import mmap
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from pydantic import BaseModel

#: Bytes in memory, or a map of those of a file.
Content: TypeAlias = bytes | mmap


def digest(data: Content) -> str:
    """SHA-256 in hex."""
    return hashlib.sha256(data).hexdigest()


def digest_of_file(path: Path) -> str:
    """SHA-256 of a file in hex; memory does not grow with the file.

    Raises:
        OSError: if it cannot be read.
    """
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def canonical(value: object) -> bytes:
    """JSON bytes that are the same for the same value: sorted keys, no spaces, no NaN."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()


def fingerprint(settings: BaseModel) -> str:
    """SHA-256 in hex of settings as JSON.

    Ids are made of it. So its JSON keeps its spaces, and a renamed field keeps its first name here, as its
    ``serialization_alias``.
    """
    return digest(json.dumps(settings.model_dump(mode="json", by_alias=True), sort_keys=True).encode())
