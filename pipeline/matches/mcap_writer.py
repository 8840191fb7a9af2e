"""Writing of MCAP files in chunks, while what they log goes on."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

from pitchlore.pipeline.matches.chunks import Piece, seal
from pitchlore.pipeline.matches.records import ADDRESS_BYTES, MESSAGE, as_array, encoded
from pitchlore.pipeline.numbers.arrays import I64, U8

#: Name of the program in the header of our logs.
LIBRARY = "pitchlore"
#: Bytes of a chunk's content; three robots a side fill it in about 20 s of a match.
CHUNK_BYTES = 256 << 10
#: Compression level of zstd. Positive levels also code the bodies' coordinates, which are nearly noise, by
#: entropy. Files are then 4 to 6 % smaller; writing takes up to half as long again, and decompression two to
#: three times as long (docs/decisions/log.md, "Chunk compression").
LEVEL = -1

# A message record: opcode, length; channel, sequence, log and publish time.
_HEAD = struct.Struct("<BQHIQQ")


class McapWriter:
    """An MCAP file that grows.

    A chunk is written and handed to the system when it is full, and at each :meth:`flush`. Messages in no
    chunk yet are lost with the process. A file that was not closed reads as truncated.

    Args:
        stream: buffered, writable; nothing has been written to it yet.
        profile: MCAP's name for the kind of messages.
        library: name of the program, in the header.
        chunk_bytes: a chunk is written when its uncompressed content would grow beyond this; only a single
            message may be larger.

    Raises:
        OSError: from any method, if the stream refuses a write.
    """

    def __init__(
        self, stream: BinaryIO, *, profile: str, library: str, chunk_bytes: int = CHUNK_BYTES,
    ) -> None:
        self._stream = stream
        self._chunk_bytes = chunk_bytes
        self._compressor = zstandard.ZstdCompressor(level=LEVEL)
        self._pending: list[Piece] = []
        self._pending_bytes = 0
        self._written = self._crc = 0
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._schemas: list[Schema] = []
        self._channels: dict[int, Channel] = {}
        self._put(MCAP0_MAGIC)
        self._put(encoded(Header(profile=profile, library=library)))

    def describe(self, name: str, metadata: dict[str, str]) -> None:
        """Write a metadata record."""
        record = encoded(Metadata(name=name, metadata=metadata))
        self._metadata.append(MetadataIndex(offset=self._written, length=len(record), name=name))
        self._put(record)

    def declare(self, schemas: Sequence[Schema], channels: Sequence[Channel]) -> None:
        """Declare channels with the schemas of their messages."""
        self._schemas += schemas
        self._channels |= {channel.id: channel for channel in channels}
        self._put(encoded(*schemas, *channels))

    def declare_plain(self, encoding: str, topics: Mapping[int, tuple[str, dict[str, str]]]) -> None:
        """Declare channels whose messages have no schema.

        Args:
            encoding: encoding of the messages.
            topics: topic and metadata of each channel, by its id.
        """
        self.declare((), [
            Channel(id=channel, topic=name, message_encoding=encoding, metadata=metadata, schema_id=0)
            for channel, (name, metadata) in topics.items()
        ])

    def declared(self, channel: int) -> bool:
        """True if there is such a channel."""
        return channel in self._channels

    def append(self, channel: int, t_ns: I64, starts: I64, content: U8) -> None:
        """Append message records of a channel.

        Args:
            channel: its id.
            t_ns: int64 [K], their log times, not negative.
            starts: int64 [K + 1], where each starts in ``content``, and where the last one ends.
            content: uint8, the records.
        """
        self._counts[channel] = self._counts.get(channel, 0) + len(t_ns)
        first = 0
        while first < len(t_ns):
            room = self._chunk_bytes - self._pending_bytes
            last = int(np.searchsorted(starts, starts[first] + room, side="right")) - 1
            if last <= first and self._pending:
                self.flush()
                continue
            last = max(last, first + 1)
            start, end = int(starts[first]), int(starts[last])
            places = starts[first:last] - start + self._pending_bytes
            self._pending.append(Piece(channel, t_ns[first:last], places, content[start:end]))
            self._pending_bytes += end - start
            first = last

    def append_plain(self, messages: Sequence[tuple[int, int, bytes]]) -> None:
        """Append messages, each its channel, log time (ns, not negative) and content, in their order."""
        first = 0
        while first < len(messages):
            channel = messages[first][0]
            last = first + 1
            while last < len(messages) and messages[last][0] == channel:
                last += 1
            run = messages[first:last]
            starts = np.cumsum([0, *(_HEAD.size + len(content) for _, _, content in run)])
            records = (
                _HEAD.pack(MESSAGE, ADDRESS_BYTES + len(content), channel, 0, t_ns, t_ns) + content
                for _, t_ns, content in run)
            self.append(channel, np.array([t_ns for _, t_ns, _ in run]), starts, as_array(b"".join(records)))
            first = last

    def flush(self) -> None:
        """Write the pending messages as a chunk of their own, so that a killed process loses nothing.

        The chunk is not synced, so a failing machine may still lose it. Small chunks cost room: chunks of a
        second (60 frames of six robots) make a log 2.2 % larger, chunks of 1,024 frames 0.02 %.
        """
        if self._pending:
            data, index = seal(self._pending, self._compressor, self._written)
            self._pending, self._pending_bytes = [], 0
            self._chunks.append(index)
            self._put(data)
            self._stream.flush()

    def close(self) -> None:
        """Write pending messages and the summary; the stream stays open."""
        self.flush()
        self._put(encoded(DataEnd(data_section_crc=self._crc)))
        self._put(self._summary())
        self._stream.flush()

    def _put(self, data: bytes) -> None:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._written += len(data)

    def _summary(self) -> bytes:
        """The summary section, the footer and the closing magic."""
        channels = self._channels.values()
        statistics = Statistics(
            attachment_count=0, channel_count=len(channels), channel_message_counts=self._counts,
            chunk_count=len(self._chunks), message_count=sum(self._counts.values()),
            message_end_time=max((c.message_end_time for c in self._chunks), default=0),
            message_start_time=min((c.message_start_time for c in self._chunks), default=0),
            metadata_count=len(self._metadata), schema_count=len(self._schemas),
        )
        groups = {
            Opcode.SCHEMA: encoded(*self._schemas),
            Opcode.CHANNEL: encoded(*channels),
            Opcode.STATISTICS: encoded(statistics),
            Opcode.CHUNK_INDEX: encoded(*self._chunks),
            Opcode.METADATA_INDEX: encoded(*self._metadata),
        }
        section, offsets = b"", []
        for opcode, group in groups.items():
            if group:
                offsets.append(SummaryOffset(
                    group_opcode=opcode, group_start=self._written + len(section), group_length=len(group)
                ))
            section += group
        footer = Footer(self._written, self._written + len(section), summary_crc=0)
        section += encoded(*offsets)
        covered = section + encoded(footer)[:-4]
        footer.summary_crc = zlib.crc32(covered)
        return section + encoded(footer) + MCAP0_MAGIC
