"""What must be the same where work is done: the code, and the packages that it computes with."""

from __future__ import annotations

import re
import sys
from functools import cache
from hashlib import sha256
from importlib import metadata
from importlib.resources import files
from pathlib import Path

#: Packages of this software.
_OURS = ("flows", "pipeline", "schemas")
#: Files that decide what it does.
_CODE = (".py", ".msg", ".csv", ".json", ".toml")


@cache
def identity() -> dict[str, str]:
    """Versions of this code, of Python and of the packages that Pitchlore needs, by name."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    found = {"pitchlore": f"{metadata.version('pitchlore')}+{_code()[:8]}", "Python": python}
    for requirement in metadata.requires("pitchlore") or ():
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        if "extra ==" not in requirement:
            found[name] = metadata.version(name)
    return found


def difference(theirs: dict[str, str]) -> str:
    """The first that is not the same elsewhere, in words; empty if all is."""
    ours = identity()
    for name in [*ours, *theirs]:
        if ours.get(name) != theirs.get(name):
            return f"{name} {theirs.get(name, 'none')}, here {ours.get(name, 'none')}"
    return ""


def _code() -> str:
    """SHA-256 of all our source files."""
    sources = [(f"{package}/{path.relative_to(root).as_posix()}", path) for package in _OURS
               for root in [Path(str(files(package)))] for path in root.rglob("*") if path.suffix in _CODE]
    joined = b"\0".join(name.encode() + b"\0" + path.read_bytes() for name, path in sorted(sources))
    return sha256(joined).hexdigest()
