"""MCAP's chunks as bytes: sealed, opened and checked.

Sizes and checksums are verified before the bytes are used.

Source: the MCAP specification, sections Chunk, Message Index.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from typing import NamedTuple

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex

from pitchlore.pipeline.matches.records import McapRecords, as_array, walk
from pitchlore.pipeline.matches.zstd import Decompressor
from pitchlore.pipeline.numbers.arrays import I64, U8

#: Most bytes of content; a chunk that declares more is not decompressed.
MAX_CHUNK_BYTES = 64 << 20

_CHUNK_HEAD = struct.Struct("<QQQII")


class DamagedChunk(Exception):
    """A chunk that cannot be used, and why; the reader of the file reports it as a flaw."""


class ChunkHead(NamedTuple):
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
    def of(cls, body: memoryview) -> ChunkHead:
        """Head of a chunk record; zeros if the record is too short."""
        return cls(*_CHUNK_HEAD.unpack_from(body)) if len(body) >= _CHUNK_HEAD.size else cls(0, 0, 0, 0, 0)


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


def seal(
    pieces: Sequence[Piece], compressor: zstandard.ZstdCompressor, place: int
) -> tuple[bytes, ChunkIndex]:
    """Bytes of a chunk with the message indexes that follow it, and its entry in the chunk index.

    Args:
        pieces: the messages, at least one piece.
        compressor: compressor of the content.
        place: where the chunk starts in the file.
    """
    content = pieces[0].content if len(pieces) == 1 else np.concatenate([p.content for p in pieces])
    chunk = Chunk(
        compression="zstd", data=compressor.compress(content.data),
        message_start_time=min(int(p.t_ns.min()) for p in pieces),
        message_end_time=max(int(p.t_ns.max()) for p in pieces),
        uncompressed_crc=zlib.crc32(content.data), uncompressed_size=len(content),
    )
    builder = RecordBuilder()
    chunk.write(builder)
    length = builder.count
    index_offsets = {}
    for channel in sorted({piece.channel for piece in pieces}):
        own = [piece for piece in pieces if piece.channel == channel]
        columns = [np.concatenate([p.t_ns for p in own]), np.concatenate([p.starts for p in own])]
        entries = np.stack(columns, axis=1).astype("<u8").tobytes()
        index_offsets[channel] = place + builder.count
        builder.start_record(Opcode.MESSAGE_INDEX)
        builder.write2(channel)
        builder.write4(len(entries))
        builder.write(entries)
        builder.finish_record()  # type: ignore[no-untyped-call]
    size = builder.count
    return builder.end(), ChunkIndex(  # type: ignore[no-untyped-call]
        chunk_start_offset=place, chunk_length=length, message_index_offsets=index_offsets,
        message_index_length=size - length, message_start_time=chunk.message_start_time,
        message_end_time=chunk.message_end_time, compression=chunk.compression,
        compressed_size=len(chunk.data), uncompressed_size=chunk.uncompressed_size,
    )


def unseal(body: memoryview, frames: Decompressor) -> tuple[U8, McapRecords]:
    """Content of a chunk and the records in it, after all checks; all chunks of a file share a decompressor.

    Raises:
        DamagedChunk: if its size exceeds ``MAX_CHUNK_BYTES`` or differs from what it declares, its CRC
            does not hold, it does not decompress, or its content is not a sequence of whole records.
    """
    if len(body) < _CHUNK_HEAD.size:
        raise DamagedChunk("is too short")
    head = ChunkHead.of(body)
    size, name_end = head.size, _CHUNK_HEAD.size + head.name_bytes
    blob = body[name_end + 8:]
    if name_end + 8 > len(body) or int.from_bytes(body[name_end:name_end + 8], "little") != len(blob):
        raise DamagedChunk("has a damaged header")
    if size > MAX_CHUNK_BYTES:
        raise DamagedChunk(f"declares {size} bytes, over the limit of {MAX_CHUNK_BYTES}")
    content = _decompress(blob, bytes(body[_CHUNK_HEAD.size:name_end]), size, frames)
    if head.crc and zlib.crc32(content) != head.crc:
        raise DamagedChunk("does not have the content that its CRC vouches for")
    array = as_array(content)
    records, end = walk(array, 0, size)
    if end != size:
        raise DamagedChunk("is not a row of whole records")
    return array, records


def unseal_cut(body: memoryview) -> tuple[U8, McapRecords]:
    """The whole records of a chunk that the file ends in, as far as they decompress; no CRC vouches for them.

    Args:
        body: body of the chunk's record, as far as it is there.
    """
    head = ChunkHead.of(body)
    name_end = _CHUNK_HEAD.size + head.name_bytes
    blob, compression = body[name_end + 8:], bytes(body[_CHUNK_HEAD.size:name_end])
    content: bytes | memoryview = b""
    if head.size <= MAX_CHUNK_BYTES:
        try:
            if compression == b"":
                content = blob[:head.size]
            elif compression == b"zstd":
                content = _zstd_frames(blob, head.size)
            elif compression == b"lz4":
                content = _lz4_frames(blob, head.size)
        except (zstandard.ZstdError, RuntimeError, EOFError):
            content = b""
    array = as_array(content)
    return array, walk(array, 0, len(array))[0]


def _decompress(blob: memoryview, compression: bytes, size: int, frames: Decompressor) -> bytes | memoryview:
    """Decompressed bytes, exactly ``size``; little more is allocated, whatever the compressed bytes say."""
    content: bytes | memoryview
    try:
        if compression == b"":
            content = blob
        elif compression == b"zstd":
            content = _one_frame(blob, size, frames) or _zstd_frames(blob, size + 1)
        elif compression == b"lz4":
            content = _lz4_frames(blob, size + 1)
        else:
            raise DamagedChunk(f"is compressed by {compression!r}, which is neither zstd nor lz4")
    except (zstandard.ZstdError, RuntimeError, EOFError) as error:
        raise DamagedChunk("does not decompress") from error
    if len(content) != size:
        raise DamagedChunk("does not have the size that it declares")
    return content


def _one_frame(blob: memoryview, size: int, frames: Decompressor) -> bytes | None:
    """Content of a single frame that declares the size, in half the time; None if it is anything else."""
    declared = zstandard.frame_content_size(blob)  # zstd believes it rather than the limit that it is given
    if declared > size:
        raise DamagedChunk("declares two different sizes")
    try:
        if declared == size:
            return frames.decompress(blob, max_output_size=size, allow_extra_data=False)
    except zstandard.ZstdError:
        return None
    return None


def _zstd_frames(blob: memoryview, most: int) -> bytes:
    """Content of all frames, at most ``most`` bytes; RFC 8878 allows several, and some to be skipped."""
    frames = zstandard.ZstdDecompressor(max_window_size=MAX_CHUNK_BYTES)
    return frames.stream_reader(blob, read_across_frames=True).read(most)


def _lz4_frames(blob: memoryview | bytes, most: int) -> bytes:
    """Content of all frames, at most ``most`` bytes."""
    content = b""
    while len(blob) and len(content) < most:
        frame = lz4.frame.LZ4FrameDecompressor()
        content += frame.decompress(blob, max_length=most - len(content))
        blob = frame.unused_data or b""
    return content
