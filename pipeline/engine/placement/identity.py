"""Identity of the code and of its packages, which have to be the same wherever work is done."""

from __future__ import annotations

import re
import sys
import tomllib
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path

from pitchlore.pipeline.base.software import __version__, source_hash

#: Packages of this software.
_OURS = ("flows", "pipeline", "schemas")
#: Files that decide what it does.
_CODE = (".py", ".msg", ".csv", ".json", ".toml")


@cache
def identity() -> dict[str, str]:
    """Versions of this code, of Python and of the packages that Pitchlore needs, by name."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    found = {"pitchlore": f"{__version__}+{source_hash(_OURS, _CODE)}", "Python": python}
    for requirement in _requirements():
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        if "extra ==" not in requirement:
            with suppress(metadata.PackageNotFoundError):
                found[name] = metadata.version(name)
    return found


def _requirements() -> list[str]:
    """The packages that this code needs, as its installation says, else its checkout."""
    with suppress(metadata.PackageNotFoundError):
        return metadata.requires("pitchlore") or []
    text = (Path(__file__).resolve().parents[3] / "pyproject.toml").read_text(encoding="utf-8")
    return list(tomllib.loads(text)["project"]["dependencies"])


def first_difference(theirs: dict[str, str], ours: dict[str, str]) -> tuple[str, str, str] | None:
    """Name of the first that is not the same, its version there and here; None if all is the same."""
    for name in [*ours, *theirs]:
        if ours.get(name) != theirs.get(name):
            return name, theirs.get(name, "none"), ours.get(name, "none")
    return None
