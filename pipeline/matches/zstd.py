"""Zstandard streams of foreign files, piece by piece."""

from __future__ import annotations

import zstandard

Decompressor = zstandard.ZstdDecompressor
#: What a Zstandard frame begins with.
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
#: Largest window, bytes: what the format's own tools accept without being asked for more.
_WINDOW = 1 << 27


class BrokenStream(Exception):
    """A Zstandard stream is corrupt; the message says how."""


class ZstdFrame:
    """One frame of a Zstandard stream, with the interface of ``zlib.decompressobj``."""

    def __init__(self) -> None:
        self._frame = zstandard.ZstdDecompressor(max_window_size=_WINDOW).decompressobj()

    @property
    def eof(self) -> bool:
        """True if the end of the frame was reached."""
        return self._frame.eof

    @property
    def unused_data(self) -> bytes:
        """Bytes that were given beyond the end of the frame."""
        return self._frame.unused_data

    def decompress(self, piece: bytes) -> bytes:
        """Content of the next piece of the frame.

        Raises:
            BrokenStream: if it is corrupt.
        """
        try:
            return self._frame.decompress(piece)
        except zstandard.ZstdError as error:
            raise BrokenStream(str(error)) from error
