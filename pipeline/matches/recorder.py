"""Writing of logs, while a match is played or all at once."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from typing import BinaryIO

import numpy as np
import polars as pl
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
from mcap.well_known import Profile
from mcap.writer import MCAP0_MAGIC

from pipeline.arrays import I64
from pipeline.errors import BadRecording
from pipeline.matches import cdr
from pipeline.matches.channels import ALWAYS, COMMAND, DECISION, FRAME, HEIGHT, REFEREE, TOPICS, declarations
from pipeline.matches.chunks import Piece, seal
from pipeline.matches.description import METADATA, describe
from pipeline.matches.frame import Frames, MatchInfo, MatchLog
from pipeline.matches.messages import Messages, lay_out
from pipeline.matches.records import encoded
from pipeline.store.tables import check
from schemas import Commands, Decisions, Quality, Referee, Table

#: Bytes of a chunk's content; three a side fill it in about 20 s of a match.
CHUNK_BYTES = 256 << 10
#: Compression level of zstd. Positive levels also code the bodies' coordinates, which are nearly noise, by
#: entropy. Files are then 4 to 6 % smaller; writing takes up to half as long again, and decompression two to
#: three times as long (DECISIONS.md, "Chunk compression").
LEVEL = -1

_SLICE = 1024  # frames that `write` lays out at once: they stay in the cache


class Recorder:
    """Log of a match in progress.

    A chunk is written and handed to the system when it is full, and at each :meth:`flush`. Messages in no
    chunk yet are lost with the process. A log that was not closed reads as truncated.

    Args:
        stream: buffered, writable; nothing has been written to it yet.
        info: description of the match at its start.
        chunk_bytes: a chunk is written when its uncompressed content would grow beyond this; only a single
            message may be larger.

    Raises:
        OSError: from any method, if the stream refuses a write.
    """

    def __init__(self, stream: BinaryIO, info: MatchInfo, *, chunk_bytes: int = CHUNK_BYTES) -> None:
        self._stream = stream
        self._info = info
        self._chunk_bytes = chunk_bytes
        self._compressor = zstandard.ZstdCompressor(level=LEVEL)
        self._pending: list[Piece] = []
        self._pending_bytes = 0
        self._written = self._crc = 0
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._put(MCAP0_MAGIC)
        self._put(encoded(Header(profile=Profile.ROS2, library="pitchlore")))
        self._describe(info, Quality.empty())
        self._declare(*ALWAYS)

    def frames(self, frames: Frames) -> None:
        """Append samples, in the order in which they are to be read.

        Raises:
            BadRecording: if a sample is before time zero, which the format cannot hold.
        """
        self._append(FRAME, cdr.pack_frames(frames, FRAME))

    def referee(self, events: pl.DataFrame) -> None:
        """Append rows of schema Referee; they take the match id of the log.

        Raises:
            SchemaMismatch: if the table is not one of schema Referee.
            BadRecording: as for :meth:`frames`.
        """
        self._append_rows(REFEREE, events, Referee, cdr.pack_referee)

    def decisions(self, decisions: pl.DataFrame) -> None:
        """Append rows of schema Decisions; they take the match id of the log.

        Raises:
            SchemaMismatch: if the table is not one of schema Decisions.
            BadRecording: as for :meth:`frames`.
        """
        self._append_rows(DECISION, decisions, Decisions, cdr.pack_decisions)

    def commands(self, commands: pl.DataFrame) -> None:
        """Append rows of schema Commands; they take the match id of the log.

        Raises:
            SchemaMismatch: if the table is not one of schema Commands.
            BadRecording: as for :meth:`frames`.
        """
        self._append_rows(COMMAND, commands, Commands, cdr.pack_commands)

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

    def close(self, *, info: MatchInfo | None = None, quality: pl.DataFrame | None = None) -> None:
        """Write pending messages, the description again, and the summary; the stream stays open.

        Args:
            info: facts of the match at its end; None if they are those of its start.
            quality: rows of schema Quality that the log carries.

        Raises:
            SchemaMismatch: if ``quality`` is not a table of schema Quality.
        """
        if quality is None or not len(quality):
            quality = Quality.empty()
        else:
            check(quality, Quality, where=self._info.match_id)
        self.flush()
        # once more: with what is known now, and so that one bad byte cannot make the log anonymous
        self._describe(info or self._info, quality)
        self._put(encoded(DataEnd(data_section_crc=self._crc)))
        self._put(self._summary())
        self._stream.flush()

    def _put(self, data: bytes) -> None:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._written += len(data)

    def _describe(self, info: MatchInfo, quality: pl.DataFrame) -> None:
        record = encoded(Metadata(name=METADATA, metadata=describe(info, quality)))
        self._metadata.append(MetadataIndex(offset=self._written, length=len(record), name=METADATA))
        self._put(record)

    def _declare(self, *channels: int) -> None:
        schemas, records = declarations(channels)
        self._schemas += schemas
        self._channels += records
        self._put(encoded(*schemas, *records))

    def _append_rows(
        self, channel: int, rows: pl.DataFrame, schema: type[Table],
        pack: Callable[[pl.DataFrame, int], Messages],
    ) -> None:
        if len(rows):
            check(rows, schema, where=self._info.match_id)
            self._append(channel, pack(rows, channel))

    def _append(self, channel: int, messages: Messages) -> None:
        if not len(messages):
            return
        t_ns: I64 = messages.heads["log_time"]
        if int(t_ns.min()) < 0:
            raise BadRecording(
                f"a message on {TOPICS[channel].name} has time {int(t_ns.min())} ns, before time zero",
                where=self._info.match_id, next_step="Count time from the earliest sample",
            )
        if all(declared.id != channel for declared in self._channels):
            self._declare(channel)
        content, starts = lay_out(messages)
        self._counts[channel] = self._counts.get(channel, 0) + len(messages)
        first = 0
        while first < len(messages):
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

    def _summary(self) -> bytes:
        """The summary section, the footer and the closing magic."""
        statistics = Statistics(
            attachment_count=0, channel_count=len(self._channels), channel_message_counts=self._counts,
            chunk_count=len(self._chunks), message_count=sum(self._counts.values()),
            message_end_time=max((c.message_end_time for c in self._chunks), default=0),
            message_start_time=min((c.message_start_time for c in self._chunks), default=0),
            metadata_count=len(self._metadata), schema_count=len(self._schemas),
        )
        groups = {
            Opcode.SCHEMA: encoded(*self._schemas),
            Opcode.CHANNEL: encoded(*self._channels),
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


def write(log: MatchLog, stream: BinaryIO, *, chunk_bytes: int = CHUNK_BYTES) -> None:
    """Write a whole match; the same match gives the same bytes.

    Events, decisions, commands and heights are written beside the frames of their time, so that a part of the
    file is a part of the match.

    Args:
        log: the match; its rows of schema Quality are written, too.
        stream: buffered, writable; nothing has been written to it yet, and it stays open.
        chunk_bytes: see :class:`Recorder`.

    Raises:
        BadRecording: if a sample or an event is before time zero.
        SchemaMismatch: if a table does not fit its schema.
        OSError: if the stream refuses a write.
    """
    left: dict[int, Messages] = {}
    if len(log.referee):
        check(log.referee, Referee, where=log.info.match_id)
        referee = log.referee.sort("t_ns", maintain_order=True)
        left[REFEREE] = cdr.pack_referee(referee, REFEREE)
    if len(log.decisions):
        check(log.decisions, Decisions, where=log.info.match_id)
        decisions = log.decisions.sort("t_ns", maintain_order=True)
        left[DECISION] = cdr.pack_decisions(decisions, DECISION)
    if len(log.commands):
        check(log.commands, Commands, where=log.info.match_id)
        left[COMMAND] = cdr.pack_commands(log.commands, COMMAND)
    if len(log.heights.t_ns):
        left[HEIGHT] = cdr.pack_heights(log.heights, HEIGHT)
    recorder = Recorder(stream, log.info, chunk_bytes=chunk_bytes)
    for part in _slices(log.frames):
        recorder.frames(part)
        for channel, messages in left.items():
            upto = int(np.searchsorted(messages.heads["log_time"], part.t_ns.max(), side="right"))
            recorder._append(channel, messages[:upto])
            left[channel] = messages[upto:]
    for channel, messages in left.items():
        recorder._append(channel, messages)
    recorder.close(quality=log.quality)


def _slices(frames: Frames) -> Iterator[Frames]:
    for first in range(0, len(frames), _SLICE):
        last = min(first + _SLICE, len(frames))
        offsets = frames.offsets[first:last + 1]
        yield Frames(
            frames.number[first:last], frames.t_ns[first:last], frames.ball[first:last],
            offsets - offsets[0], frames.robots[offsets[0]:offsets[-1]],
        )
