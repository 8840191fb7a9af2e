"""Bytes that may be too many for memory, and that are needed once."""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from types import TracebackType

from pitchlore.pipeline.base.digests import Content
from pitchlore.pipeline.base.errors import unwritable


class Spool:
    """Bytes that grow in a file without a name, in the system's temporary folder (``TMPDIR``).

    They are read through a map of the file, of which the system keeps in memory what it has room for. The
    file's room is free again when it is closed and nobody has the map, or when the process ends.

    Attributes:
        stream: the file, to be written inside of :func:`spooling`.
    """

    def __init__(self) -> None:
        with spooling():
            self.stream = TemporaryFile()  # noqa: SIM115 (closed on exit)

    def __enter__(self) -> Spool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # what a full disk has refused is refused again: nobody needs it now
        with suppress(OSError):
            self.stream.close()

    def write(self, data: Content) -> None:
        """Append bytes.

        Raises:
            StorageFailed: if the folder is full.
        """
        with spooling():
            self.stream.write(data)

    def mapped(self) -> Content:
        """All bytes; the map stays when the spool is closed.

        Raises:
            StorageFailed: if the folder is full.
        """
        with spooling():
            self.stream.flush()
            if not self.stream.tell():  # an empty file has no map
                return b""
            return mmap.mmap(self.stream.fileno(), 0, access=mmap.ACCESS_READ)


@contextmanager
def spooling() -> Iterator[None]:
    """Report errors of the temporary folder as such.

    Raises:
        StorageFailed: if the folder cannot be written, or is full.
    """
    try:
        yield
    except OSError as error:
        raise unwritable(Path(gettempdir()), error) from error
