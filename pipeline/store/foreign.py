"""Files that are not ours, read piece by piece: memory does not depend on their size."""

from __future__ import annotations

import os

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.base.system import read_at

#: Bytes that are read by one call; the system reads less than 2 GiB.
_AT_ONCE = 1 << 30


class ForeignFile:
    """An open file, like the ``bytes`` that it has: its length, and its slices.

    Its size is that at which it was opened. If it is cut meanwhile, slices are shorter.

    Args:
        descriptor: descriptor of the file, open for reading.
        where: its path, for messages.
    """

    def __init__(self, descriptor: int, where: str) -> None:
        self._descriptor, self._where = descriptor, where
        self._size = os.fstat(descriptor).st_size

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, part: slice) -> bytes:
        """Bytes from ``part.start`` to ``part.stop``, as of ``bytes``.

        Raises:
            NotFound: if they cannot be read.
        """
        first, last, _ = part.indices(self._size)
        pieces = []
        try:
            while first < last and (piece := read_at(self._descriptor, min(last - first, _AT_ONCE), first)):
                pieces.append(piece)
                first += len(piece)
        except OSError as error:
            raise NotFound(f"cannot be read ({error.strerror or error})", where=self._where,
                           next_step="Copy it to another disk") from error
        return pieces[0] if len(pieces) == 1 else b"".join(pieces)
