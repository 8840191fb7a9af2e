"""Name, version and source of this software."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path

from pitchlore.pipeline.base.digests import digest

__version__ = "0.1.0"

#: Name and version of this software, as logs and reports state their writer.
RELEASE = f"pitchlore {__version__}"


@cache
def software() -> str:
    """Name, version and source hash of this code: provenance of its outputs, never part of a key."""
    return f"{RELEASE}+{source_hash(('pipeline', 'schemas'), ('.py', '.msg', '.csv'))}"


def source_hash(packages: Sequence[str], suffixes: Sequence[str]) -> str:
    """First 8 hex digits of the SHA-256 of all files in some of Pitchlore's packages with these endings."""
    sources = sorted(
        (f"{package}/{path.relative_to(root).as_posix()}", path)
        for package in packages
        for root in [Path(str(files(f"pitchlore.{package}")))]
        for path in root.rglob("*")
        if path.suffix in suffixes
    )
    return digest(b"\0".join(name.encode() + b"\0" + path.read_bytes() for name, path in sources))[:8]
