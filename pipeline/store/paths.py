"""Paths of a data folder: which may be, what a folder holds, and removal."""

from __future__ import annotations

import os
import re
from pathlib import Path

from pitchlore.pipeline.base.errors import BadSettings, ReadFailed, unwritable
from pitchlore.pipeline.store.buckets import check_local

SAFE_NAME = re.compile(r"^[a-z0-9][a-z0-9.-]{0,95}\Z")


def named_path(word: str | Path) -> Path:
    """The path that a user names: ``~`` and ``~NAME`` at its start are homes, but in ``./~``.

    No path begins with ``~`` afterwards: some libraries would take that for a home once more.

    Raises:
        BadSettings: if there is no such home, the path has a NUL, which no system takes, or it is empty, as
            that of a shell's variable that is not set.
    """
    path = Path(word)
    if word == "":
        raise BadSettings("a path is empty", where="''",
                          next_step="Write . for this folder, or set the variable")
    if "\0" in str(path):
        raise _unusable("has a NUL in its path", path, "Name another")
    if not path.parts or not path.parts[0].startswith("~"):
        return path
    if not str(word).startswith("~"):
        return path.absolute()
    try:
        return path.expanduser()
    except RuntimeError as error:
        raise _unusable("there is no such user's home", path, f"Write ./{path}, if it is here") from error


def check_root(path: Path) -> None:
    """Check that a path may be that of a data folder, new or old.

    Raises:
        BadSettings: as for :func:`check_folder`; or if it has a ``?``, after which DuckDB and SQLite read
            options.
    """
    remedy = "Name the data folder with --data"
    check_folder(path, remedy)
    if "?" in str(path.resolve()):
        raise _unusable("has a ? in its path, after which databases read options", path, remedy)


def check_folder(path: Path, remedy: str) -> None:
    """Check that a path may be that of a folder, new or old.

    Args:
        path: path of the folder.
        remedy: the advice, if it may not.

    Raises:
        BadSettings: if it, or a folder above it, is something else; if it is a URL; or if it is too long or
            not UTF-8.
    """
    check_local(path)
    try:
        there = next((each for each in (path, *path.parents) if each.exists() or each.is_symlink()), None)
        str(path.resolve()).encode()
    except UnicodeEncodeError as error:
        raise _unusable("has a path that is not UTF-8", path, remedy) from error
    except (OSError, RuntimeError) as error:  # 3.12 and before raise RuntimeError for links in a circle
        reason = getattr(error, "strerror", None) or "its links go round"
        raise _unusable(f"cannot be used ({reason})", path, remedy) from error
    if there is not None and not there.is_dir():
        raise _unusable("is not a folder", there, remedy)


def _unusable(what: str, path: Path, remedy: str) -> BadSettings:
    return BadSettings(what, where=str(path)[:200], next_step=remedy)


def listed(folder: Path, end: str = "") -> list[str]:
    """The paths in a folder whose names end so, sorted; none if there is no folder.

    They are texts: a folder may have many thousands.

    Raises:
        ReadFailed: if the folder cannot be read: what cannot be seen is not gone.
    """
    try:
        with os.scandir(folder) as entries:
            return sorted(entry.path for entry in entries if entry.name.endswith(end))
    except FileNotFoundError:
        return []
    except OSError as error:
        raise ReadFailed(f"cannot be read ({error.strerror or error})", where=str(folder),
                         next_step="Make it a folder that you may read") from error


def remove(path: Path) -> None:
    """Remove a file, if it is there.

    Raises:
        StorageFailed: if the disk refuses.
    """
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise unwritable(path, error) from error


def safe(name: str) -> str:
    """The name, if it may become part of a path.

    Raises:
        BadSettings: if not.
    """
    if not SAFE_NAME.match(name):
        raise BadSettings(f"{name!r} is not a safe file name", next_step="Name it otherwise")
    return name
