"""Temporary files and staging folders: whose they are, and what dead processes have left of them."""

from __future__ import annotations

import os
import re
import shutil
import time
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path
from platform import node

from pitchlore.pipeline.base.system import alive

#: Name of a temporary: its maker's machine (earlier versions did not say it), process, and a random part.
_OWNER = re.compile(r"\.(?:([0-9a-f]{8})\.)?(\d+)-[0-9a-f]+\.(?:tmp|tmp\.wal|staging)$")
#: Temporaries of another machine, or where the system does not tell who lives, are removed when they are so
#: old, seconds: no write takes as long.
_OLD_S = 24 * 3600.0
#: Depth of the folders that have some.
_DEPTH = 3


def temporary_beside(path: Path, kind: str) -> Path:
    """A new temporary path beside a path; ``kind`` is tmp or staging."""
    return path.with_name(f".{path.name}.{machine()}.{os.getpid()}-{os.urandom(4).hex()}.{kind}")


@cache
def machine() -> str:
    """8 hex digits of this machine, since it was started, and of this space of process numbers.

    On a shared disk, or in a container, the number of a process says nothing to other machines.
    """
    parts = [node()]
    for path in ("/proc/sys/kernel/random/boot_id", "/proc/self/ns/pid"):
        try:
            parts.append(str(Path(path).readlink()) if path.endswith("pid") else Path(path).read_text())
        except OSError:  # no Linux
            parts.append("")
    return sha256("\n".join(parts).encode()).hexdigest()[:8]


def sweep(root: Path, depth: int = _DEPTH) -> int:
    """Remove what dead processes have left in a folder, and in its folders to a depth. Returns the number.

    A temporary of another machine may be in use as long as it is young, whatever its process number is here.
    """
    swept = 0
    for entry in _hidden(root, depth):
        owner = _OWNER.search(entry.name)
        if owner and _is_dead(entry, owner[1] or machine(), int(owner[2])):
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                Path(entry.path).unlink(missing_ok=True)
            swept += 1
    return swept


def _hidden(folder: Path | str, depth: int) -> Iterator[os.DirEntry[str]]:
    """The hidden entries of a folder, and of its folders to some depth."""
    try:
        with os.scandir(folder) as found:
            entries = list(found)
    except OSError:
        return
    for entry in entries:
        if entry.name.startswith("."):
            yield entry
        elif depth > 1 and entry.is_dir(follow_symlinks=False):
            yield from _hidden(entry.path, depth - 1)


def _is_dead(entry: os.DirEntry[str], where: str, pid: int) -> bool:
    """True if nobody writes a temporary any more."""
    known = alive(pid) if where == machine() else None
    if known is not None:
        return not known
    try:
        return time.time() - entry.stat(follow_symlinks=False).st_mtime > _OLD_S
    except OSError:
        return False
