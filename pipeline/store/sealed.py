"""Receipts and manifests as JSON files that carry a checksum of themselves."""

from __future__ import annotations

import json
import os
import re
import time
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.errors import CorruptFile, not_readable
from pitchlore.pipeline.base.system import whole
from pitchlore.pipeline.store.receipts import Manifest

M = TypeVar("M", bound=BaseModel)
REMEDY = "Run `pitchlore run` to make it anew"
_REMEDIES = {
    "matches": "Import the recording again, or `pitchlore verify --restore-from BACKUP`",
    "seasons": "`pitchlore verify --restore-from BACKUP`, or remove its files in seasons/ and play it anew",
    "evaluations": "Run `pitchlore evaluate` as before to make it anew",
    "paradigms": "Run `pitchlore paradigms` as before to make it anew",
    "report": "Run `pitchlore report` to make it anew",
    "quarantine": "`pitchlore quarantine --clear` removes it",
    "runs": "Remove it: only what `pitchlore runs` says of that run is lost",
}
REMEDY_OF_VERSION = "Restore it: `pitchlore verify --restore-from BACKUP`; other versions are not affected"
#: Inode, size and time of change [ns] of a file: another stamp, another file.
Stamp = tuple[int, int, int]
#: Models that were read, by path, each with the stamp of its file; and their greatest number, some 200 MB.
_known: dict[str, tuple[Stamp, BaseModel]] = {}
_MOST = 1 << 15
#: A younger file is always read.
_TICK_NS = 1_000_000_000
#: How a sealed model begins.
_SEAL = re.compile(rb'\{\n "checksum": "([0-9a-f]{64})",\n')


def pretty(model: BaseModel) -> bytes:
    """A model as JSON that a person can read, the same bytes for the same model."""
    text = json.dumps(model.model_dump(mode="json"), indent=1, sort_keys=True, allow_nan=False)
    return text.encode() + b"\n"


def sealed(model: BaseModel) -> bytes:
    """A model as JSON (:func:`pretty`) with a first key ``checksum``: the SHA-256 of the file without it."""
    text = pretty(model)
    return b'{\n "checksum": "%b",\n' % digest(text).encode() + text.removeprefix(b"{\n")


def read_model(path: str, model: type[M]) -> M | None:
    """A model from its JSON file, checked against its own checksum; None if there is no such file, or link.

    A file that is as it was when this process read it last (by inode, size and time) is not read again.
    Earlier versions of Pitchlore wrote no checksum; such a file is not checked.

    Raises:
        CorruptFile: if it cannot be read as one, or is not what was written.
        ReadFailed: if the system refuses to read it, which says nothing about what is in it.
    """
    try:
        now_ns, stamp = time.time_ns(), stamp_of(path)
        known = _known.get(path)
        if known is not None and known[0] == stamp and isinstance(known[1], model):
            return known[1]
        data = whole(path)
    except OSError as error:
        if isinstance(error, FileNotFoundError) and not os.path.islink(path):  # noqa: PTH114 (as in stamp_of)
            return None
        raise not_readable(path, error, _remedy(path, model)) from error
    read = parsed(data, path, model)
    if settled(stamp, now_ns) and (len(_known) < _MOST or path in _known):
        _known[path] = stamp, read
    return read


def read_cache(path: Path, model: type[M]) -> M | None:
    """A model that only saves time, from its JSON file; None if there is none, or it is damaged."""
    try:
        return read_model(str(path), model)
    except CorruptFile:
        return None


def stamp_of(path: str) -> Stamp:
    """The stamp of a file.

    Raises:
        OSError: if there is none, or it cannot be looked at.
    """
    found = os.stat(path)  # noqa: PTH116 (a path object takes longer to make than the call)
    return found.st_ino, found.st_size, found.st_mtime_ns


def stamp_if_there(path: str) -> Stamp | None:
    """The stamp of a file, None if there is none."""
    try:
        return stamp_of(path)
    except FileNotFoundError:
        return None


def settled(stamp: Stamp, now_ns: int) -> bool:
    """True if a file is so old that another one would have another stamp.

    The clock of a file system ticks every few milliseconds: two files of one tick may look the same.

    Args:
        stamp: the file's.
        now_ns: the time before the stamp was taken.
    """
    return now_ns - stamp[2] > _TICK_NS


def read_anew() -> None:
    """Forget what was read: whoever checks the folder reads every file."""
    _known.clear()


def parsed(data: bytes, path: str | Path, model: type[M]) -> M:
    """A model from the bytes of its JSON file (see :func:`read_model`).

    Args:
        data: the bytes.
        path: where they are, for the error.
        model: the model's class.

    Raises:
        CorruptFile: if they cannot be read as one, or are not what was written.
    """
    seal = _SEAL.match(data)
    if seal is not None:
        data = b"{\n" + data[seal.end():]
        if digest(data).encode() != seal[1]:
            raise CorruptFile("is not what was written (its checksum differs)", where=str(path),
                              next_step=_remedy(path, model))
    try:
        return model.model_validate_json(data)
    except ValidationError as error:
        raise CorruptFile(f"is not a readable {model.__name__.lower()}", where=str(path),
                          next_step=_remedy(path, model)) from error


def _remedy(path: str | Path, model: type[BaseModel]) -> str:
    return REMEDY_OF_VERSION if model is Manifest else remedy_of(Path(path).parent.name)


def remedy_of(noun: str) -> str:
    """Advice on a damaged file of an output."""
    return _REMEDIES.get(noun, REMEDY)
