"""Errors that say what is wrong, where, and what to do next, in one line."""

from __future__ import annotations

import errno
from functools import partial
from pathlib import Path
from typing import Any

from pitchlore.pipeline.base.text import printable, without_password

#: Most characters of a part of an error: a recording's own text may be in it.
_CHARACTERS = 500


class PitchloreError(Exception):
    """A failure that the user can act on.

    Args:
        what: the problem, without a full stop.
        where: the file, chunk, row or time with the problem.
        next_step: the user's next step, as an imperative.
    """

    #: Whether the same call may succeed when it is simply tried again.
    transient = False
    #: Text of a map that mends what is wrong, if one was made.
    offer = ""
    #: Whether all other work would fail by it, too, so that none is begun any more.
    for_all = False

    def __init__(self, what: str, *, where: str = "", next_step: str = "") -> None:
        self.what = printable(without_password(what), _CHARACTERS).rstrip(". ")
        self.where = printable(without_password(where), _CHARACTERS)
        self.next_step = without_password(next_step)
        super().__init__(what, where, next_step)

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self), where=self.where, next_step=self.next_step), (self.what,), vars(self)

    def __str__(self) -> str:
        line = f"{self.where}: {self.what}" if self.where else self.what
        return f"{line}. {self.next_step}." if self.next_step else f"{line}."


def in_one_line(error: BaseException) -> str:
    """The message of an error in one line; an error that is not ours is named by its class."""
    if isinstance(error, PitchloreError):
        return str(error)
    said = without_password(" ".join(str(error).split()))
    return printable(f"{type(error).__name__}: {said}", _CHARACTERS)


class BadRecording(PitchloreError):
    """A foreign recording cannot be understood."""


class DamagedLog(PitchloreError):
    """A match log (MCAP) from which nothing can be salvaged, or that may not be trusted."""


class NoFrames(DamagedLog):
    """A match log in which not one frame can be read."""


class SchemaMismatch(PitchloreError):
    """A table does not have the columns, types or bounds of its schema."""


class CorruptFile(PitchloreError):
    """A file's bytes are not those that its receipt or manifest vouches for."""


class NotFound(PitchloreError):
    """Something that was asked for by name does not exist."""


class BadSettings(PitchloreError):
    """A settings file or argument cannot be used."""


class BadQuery(PitchloreError):
    """An SQL query that the catalogue refuses."""


class StorageFailed(PitchloreError):
    """The disk refused a write (full, read-only, gone); trying again may help."""

    transient = True


class ReadFailed(StorageFailed):
    """The system refuses to read a file that may well be whole: no permission, a failing or absent disk."""

    for_all = True


class BucketFailed(StorageFailed):
    """A bucket cannot be reached, or refuses, however often it was asked."""

    for_all = True


class Overtaken(PitchloreError):
    """Another machine has written to a bucket what was to be written now; what it wrote stands."""


class StillWritten(PitchloreError):
    """A file changed while it was read: somebody writes it."""

    transient = True


class WorkerLost(PitchloreError):
    """A process that worked for this one was killed."""


class ClusterFailed(PitchloreError):
    """A cluster cannot be reached, has ended, or has workers that cannot do this work."""

    for_all = True


def unwritable(path: Path, error: OSError) -> StorageFailed:
    """The error of a file or folder that cannot be written."""
    return StorageFailed(f"cannot be written ({error.strerror or error})", where=str(path), next_step=(
        "Free space or mend the folder, then run again; nothing that was there is lost"))


#: Errors by which a file is not there, or something else is in its place. All others say nothing about it.
_GONE = frozenset((errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ELOOP, errno.ENXIO))
#: Advice on a file that may not be read.
_CLOSED = "Let this user read it, or call the command as its owner; nothing says that it is damaged"


def not_readable(path: Path | str, error: OSError, remedy: str) -> CorruptFile | ReadFailed:
    """The error of a file of ours that cannot be read: of a lost one with its remedy, else the system's."""
    what = f"cannot be read ({error.strerror or error})"
    if error.errno in _GONE:
        first = "Remove what is there. " if error.errno == errno.EISDIR else ""
        return CorruptFile(what, where=str(path), next_step=first + remedy)
    return ReadFailed(what, where=str(path), next_step=_CLOSED if isinstance(error, PermissionError) else (
        "Mend the disk, or mount it anew, then call the command again; nothing was changed"))
