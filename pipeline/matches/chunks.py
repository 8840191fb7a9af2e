"""MCAP's chunks as bytes: filled and sealed, opened and checked.

Sizes and checksums are verified before the bytes are used.

Source: the MCAP specification, sections Chunk, Message Index.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard

from pipeline.matches.frame import I64
from pipeline.matches.records import CHUNK, FRAMING_BYTES, MESSAGE_INDEX, U8, Records, as_array, walk

#: Most bytes of content; a chunk that declares more is not decompressed.
MAX_CHUNK_BYTES = 64 << 20

_FRAMING = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQII")
_INDEX_HEAD = struct.Struct("<HI")  # channel, bytes that follow


class DamagedChunk(Exception):
    """A chunk that cannot be used, and why; the reader of the file reports it as a flaw."""


class _ChunkHead(NamedTuple):
    """Fixed part of a chunk record.

    Attributes:
        start_ns, end_ns: first and last log time, both included.
        size: bytes of the content, uncompressed.
        crc: CRC-32 of the content, 0 if there is none.
        name_bytes: length of the compression's name.
    """

    start_ns: int
    end_ns: int
    size: int
    crc: int
    name_bytes: int

    @classmethod
    def of(cls, body: memoryview) -> _ChunkHead | None:
        """Head of a chunk record; None if the record is too short."""
        return cls(*_CHUNK_HEAD.unpack_from(body)) if len(body) >= _CHUNK_HEAD.size else None


class Piece(NamedTuple):
    """Consecutive messages of one channel in a chunk.

    Attributes:
        channel: their channel's id.
        t_ns: int64 [K], their log times.
        starts: int64 [K], where their records start in the chunk's content.
        content: uint8, their records.
    """

    channel: int
    t_ns: I64
    starts: I64
    content: U8


class SealedChunk(NamedTuple):
    """A chunk with the message indexes that follow it, and its entry in the chunk index.

    Attributes:
        data: all their bytes.
        length: length of the chunk record.
        index_offsets: channel to where its message index starts in ``data``.
        start_ns, end_ns: first and last log time, both included.
        stored, size: bytes of the content, compressed and uncompressed.
    """

    data: bytes
    length: int
    index_offsets: dict[int, int]
    start_ns: int
    end_ns: int
    stored: int
    size: int


class ChunkBuffer:
    """The content of the chunk in progress.

    Args:
        chunk_bytes: most bytes of content; only a single message may be larger.
        level: compression level of zstd.
    """

    def __init__(self, chunk_bytes: int, level: int) -> None:
        self._capacity = chunk_bytes
        self._compressor = zstandard.ZstdCompressor(level=level)
        self._pieces: list[Piece] = []
        self._size = 0

    def add(self, channel: int, t_ns: I64, content: U8, starts: I64) -> Iterator[SealedChunk]:
        """Add messages, and yield each chunk that becomes full.

        Args:
            channel: their channel's id.
            t_ns: int64 [K], their log times.
            content: uint8, their records, one after another.
            starts: int64 [K + 1], start of each record, and the end of the last one.
        """
        first, count = 0, len(t_ns)
        while first < count:
            room = self._capacity - self._size
            last = int(np.searchsorted(starts, starts[first] + room, side="right")) - 1
            if last <= first and self._pieces:
                yield from self.seal()
                continue
            last = max(last, first + 1)
            start, end = int(starts[first]), int(starts[last])
            self._pieces.append(Piece(
                channel, t_ns[first:last], starts[first:last] - start + self._size, content[start:end]
            ))
            self._size += end - start
            first = last

    def seal(self) -> Iterator[SealedChunk]:
        """Yield the chunk in progress, unless it is empty, and begin the next one."""
        if self._pieces:
            sealed = _seal(self._pieces, self._compressor)
            self._pieces, self._size = [], 0
            yield sealed


def _seal(pieces: Sequence[Piece], compressor: zstandard.ZstdCompressor) -> SealedChunk:
    """Chunk of at least one piece, compressed, with its CRC and message indexes."""
    content = pieces[0].content if len(pieces) == 1 else np.concatenate([p.content for p in pieces])
    start, end = min(int(p.t_ns.min()) for p in pieces), max(int(p.t_ns.max()) for p in pieces)
    blob = compressor.compress(content.data)
    compression = b"zstd"
    fixed = _ChunkHead(start, end, len(content), zlib.crc32(content.data), len(compression))
    head = _CHUNK_HEAD.pack(*fixed) + compression + len(blob).to_bytes(8, "little")
    parts = [_FRAMING.pack(CHUNK, len(head) + len(blob)), head, blob]
    length = at = sum(map(len, parts))
    index_offsets = {}
    for channel in sorted({piece.channel for piece in pieces}):
        own = [piece for piece in pieces if piece.channel == channel]
        columns = [np.concatenate([p.t_ns for p in own]), np.concatenate([p.starts for p in own])]
        entries = np.stack(columns, axis=1).astype("<u8").tobytes()
        index_offsets[channel] = at
        parts += [
            _FRAMING.pack(MESSAGE_INDEX, _INDEX_HEAD.size + len(entries)),
            _INDEX_HEAD.pack(channel, len(entries)), entries,
        ]
        at += FRAMING_BYTES + _INDEX_HEAD.size + len(entries)
    return SealedChunk(b"".join(parts), length, index_offsets, start, end, len(blob), len(content))


def chunk_span(body: memoryview) -> tuple[int, int]:
    """First and last log time that a chunk declares, both included; 0 and 0 if it is too short."""
    head = _ChunkHead.of(body)
    return (head.start_ns, head.end_ns) if head else (0, 0)


def chunk_size(body: memoryview) -> int:
    """Bytes of content that a chunk declares; 0 if it declares more than ``MAX_CHUNK_BYTES``."""
    head = _ChunkHead.of(body)
    return head.size if head and head.size <= MAX_CHUNK_BYTES else 0


def unseal(body: memoryview) -> tuple[U8, Records]:
    """Content of a chunk and the records in it, after all checks.

    Raises:
        DamagedChunk: if its size exceeds ``MAX_CHUNK_BYTES`` or differs from what it declares, its CRC
            does not hold, it does not decompress, or its content is not a sequence of whole records.
    """
    head = _ChunkHead.of(body)
    if head is None:
        raise DamagedChunk("is too short")
    size, name_end = head.size, _CHUNK_HEAD.size + head.name_bytes
    blob = body[name_end + 8:]
    if name_end + 8 > len(body) or int.from_bytes(body[name_end:name_end + 8], "little") != len(blob):
        raise DamagedChunk("has a damaged header")
    if size > MAX_CHUNK_BYTES:
        raise DamagedChunk(f"declares {size} bytes, over the limit of {MAX_CHUNK_BYTES}")
    content = _decompress(blob, bytes(body[_CHUNK_HEAD.size:name_end]), size)
    if head.crc and zlib.crc32(content) != head.crc:
        raise DamagedChunk("does not have the content that its CRC vouches for")
    array = as_array(content)
    records, end = walk(array, 0, size)
    if end != size:
        raise DamagedChunk("is not a row of whole records")
    return array, records


def _decompress(blob: memoryview, compression: bytes, size: int) -> bytes | memoryview:
    """Decompressed bytes, exactly ``size``; little more is allocated, whatever the compressed bytes say."""
    content: bytes | memoryview
    try:
        if compression == b"":
            content = blob
        elif compression == b"zstd":
            # zstd believes the size in its own header rather than the limit that it is given
            declared = zstandard.frame_content_size(blob)
            if declared not in (-1, size):
                raise DamagedChunk("declares two different sizes")
            decompressor = zstandard.ZstdDecompressor()
            content = decompressor.decompress(blob, max_output_size=size, allow_extra_data=False)
        elif compression == b"lz4":
            content = lz4.frame.LZ4FrameDecompressor().decompress(blob, max_length=size + 1)
        else:
            raise DamagedChunk(f"is compressed by {compression!r}, which is neither zstd nor lz4")
    except (zstandard.ZstdError, RuntimeError, EOFError) as error:
        raise DamagedChunk("does not decompress") from error
    if len(content) != size:
        raise DamagedChunk("does not have the size that it declares")
    return content
