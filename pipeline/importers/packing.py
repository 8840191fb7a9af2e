"""Unpacking of recordings: gzip and Zstandard streams, piece by piece."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from typing import Protocol

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.matches.zstd import ZSTD_MAGIC, BrokenStream, ZstdFrame

#: Highest compression ratio. Deflate reaches 1,000; recordings of matches were seen to have 5 to 25.
MAX_RATIO = 400
_RATIO_MATTERS_FROM = 64 << 20
#: Most streams in one file; rotated logs have a few.
_MEMBERS = 1_000
_GZIP = b"\x1f\x8b"
#: Bytes of a file that is not packed that are given at once.
_BARE = 1 << 20
#: Compressed bytes that are inflated at once. If the stream is corrupt, the piece with the damage is lost. A
#: byte of deflate holds up to 1,000 bytes, one of Zstandard up to 32,768.
_PIECE = {"gzip": 1 << 12, "zstd": 1 << 9}


class Octets(Protocol):
    """Bytes in memory or on disk: their number, and their slices."""

    def __len__(self) -> int: ...

    def __getitem__(self, part: slice, /) -> bytes: ...


class Unpacking:
    """Content of a file, in pieces; of a cut or corrupt stream what comes before the damage.

    The checksum of a damaged stream is not verified, and the last bytes before the damage may be garbage; the
    readers skip or refuse those.

    Args:
        data: the file's bytes.
        name: the file's name, for messages.
        megabytes: greatest size of the content.

    Attributes:
        damage: after all pieces, why bytes are missing, else None.
        bare: whether the file is not packed.
    """

    def __init__(self, data: Octets, name: str, megabytes: int) -> None:
        self.damage: str | None = None
        self.bare = _kind(data, 0) is None
        self._data, self._name = data, name
        self.allow(megabytes)
        self._pieces = self._unpack()

    def allow(self, megabytes: int) -> None:
        """Set another greatest size of the content."""
        self._most = megabytes << 20

    def __iter__(self) -> Iterator[bytes]:
        """The pieces that were not given yet, none of them empty.

        Raises:
            BadRecording: if no byte can be inflated, or if the content exceeds its greatest size, or, beyond
                64 MiB, ``MAX_RATIO`` times the bytes that it was inflated from so far: a bomb is refused as
                soon as it is one, and not once it has grown to the ratio of the whole file.
        """
        return self._pieces

    def _unpack(self) -> Iterator[bytes]:
        data = self._data
        kind = _kind(data, 0)
        if kind is None:
            for at in range(0, len(data), _BARE):
                if piece := data[at : at + _BARE]:
                    yield piece
            return
        total = at = members = 0
        while self.damage is None and (kind := _kind(data, at)) is not None:
            members += 1
            if members > _MEMBERS:
                raise BadRecording(f"has more than {_MEMBERS} {kind} streams", where=self._name,
                                   next_step="Unpack it yourself if it is a recording of one match")
            stream = zlib.decompressobj(wbits=31) if kind == "gzip" else ZstdFrame()
            while not stream.eof and self.damage is None:
                piece = data[at : at + _PIECE[kind]]
                if not piece:
                    self.damage = f"the {kind} stream is cut off"
                    break
                try:
                    content = stream.decompress(piece)
                except (zlib.error, BrokenStream) as error:
                    self.damage = f"the {kind} stream is corrupt ({error})"
                    break
                at += len(piece) - len(stream.unused_data)
                total += len(content)
                if total > self._most or (total > _RATIO_MATTERS_FROM and total > MAX_RATIO * at):
                    raise BadRecording(
                        f"unpacks to more than {total >> 20} MiB from {at} bytes", where=self._name,
                        next_step="Make sure that it is a recording of one match; unpack it yourself if so",
                    )
                if content:
                    yield content
        # zeros may fill up a block
        if self.damage is None and any(data[i:i + _BARE].strip(b"\0") for i in range(at, len(data), _BARE)):
            self.damage = f"the {_kind(data, 0)} stream is followed by something else"
        if not total and self.damage is not None:
            raise BadRecording(self.damage, where=self._name, next_step="Copy or record it again")


def _kind(data: Octets, at: int) -> str | None:
    """Kind of the stream that begins at a place, else None."""
    head = data[at : at + len(ZSTD_MAGIC)]
    if head.startswith(_GZIP):
        return "gzip"
    return "zstd" if head == ZSTD_MAGIC else None
