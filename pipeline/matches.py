"""Match logs as MCAP: the recorder and the reader, beside each other.

Both move whole chunks between bytes and numpy arrays (:mod:`pipeline.cdr`); no loop runs over
messages. Every byte that is written is covered by a CRC, and every CRC is checked on reading:
what is damaged is reported and left out, what is whole is kept.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC
from io import BytesIO
from types import TracebackType
from typing import BinaryIO, NamedTuple, Protocol, Self, TypeVar

import lz4.frame
import numpy as np
import numpy.typing as npt
import polars as pl
import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.well_known import MessageEncoding, Profile, SchemaEncoding
from mcap.writer import MCAP0_MAGIC
from pydantic import ValidationError

from pipeline import cdr
from pipeline.cdr import Messages
from pipeline.chunks import FRAMING_BYTES, DamagedChunk, Piece, as_array, chunk_size, chunk_span, find_records, seal, unseal
from pipeline.errors import BadRecording, DamagedLog
from pipeline.frame import AWAY, HOME, I64, Frames, MatchInfo, MatchLog
from pipeline.tables import check
from pipeline.timeline import Flaw, quality_table
from schemas import Decisions, Matches, Quality, Referee

#: A recorder that is killed loses at most so much: about 20 s of a match of three a side.
CHUNK_BYTES = 256 << 10
#: A log whose chunks declare more than this together is not read.
MAX_LOG_BYTES = 2 << 30
#: Name of the metadata record that says which match it is.
METADATA = "pitchlore"


class _Topic(NamedTuple):
    """A channel of the log; its id, and its schema's, is its place in ``TOPICS`` counted from 1."""

    name: str
    definition: str
    parts: tuple[str, ...]
    head: np.dtype[np.void]


TOPICS = (
    _Topic("/frame", "Frame", ("Robot",), cdr.FRAME_HEAD),
    _Topic("/referee", "RefereeEvent", (), cdr.REFEREE_HEAD),
    _Topic("/decision", "Decision", (), cdr.DECISION_HEAD),
)
FRAME, REFEREE, DECISION = 1, 2, 3
_SLICE = 1024  # frames that `write` hands over at once: their chunk content stays in the cache


# --- writing -----------------------------------------------------------------------------------


class Recorder:
    """A log that is written while the match is played.

    Whole chunks are written and flushed as they fill; what is not yet in a chunk is lost with the
    process. As a context manager it closes the log unless an exception ends it: a log that was not
    closed reads as truncated.

    Args:
        stream: buffered, writable; nothing has been written to it yet.
        info: what is known of the match at its start.
        chunk_bytes: a chunk is written when its uncompressed content would grow beyond this.
        level: of zstd.

    Raises:
        OSError: from any method, if the stream refuses a write.
    """

    def __init__(
        self, stream: BinaryIO, info: MatchInfo, *, chunk_bytes: int = CHUNK_BYTES, level: int = 1
    ) -> None:
        self._stream = stream
        self._info = info
        self._chunk_bytes = chunk_bytes
        self._compressor = zstandard.ZstdCompressor(level=level)
        self._written = self._crc = 0
        self._pending: list[Piece] = []
        self._pending_bytes = 0
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._schemas, self._channels = _declarations()
        self._put(MCAP0_MAGIC)
        self._put(_encoded(Header(profile=Profile.ROS2, library="pitchlore")))
        self._describe(info, Quality.empty())
        self._put(_encoded(*self._schemas, *self._channels))

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
        check(events, Referee, where=self._info.match_id)
        self._append(REFEREE, cdr.pack_referee(events, REFEREE))

    def decisions(self, decisions: pl.DataFrame) -> None:
        """Append rows of schema Decisions; they take the match id of the log.

        Raises:
            SchemaMismatch: if the table is not one of schema Decisions.
            BadRecording: as for :meth:`frames`.
        """
        check(decisions, Decisions, where=self._info.match_id)
        self._append(DECISION, cdr.pack_decisions(decisions, DECISION))

    def close(self, *, info: MatchInfo | None = None, quality: pl.DataFrame | None = None) -> None:
        """Write what is pending, the description again, and the summary; the stream stays open.

        Args:
            info: what is known of the match at its end, if that is more than at its start.
            quality: rows of schema Quality that the log is to carry.

        Raises:
            SchemaMismatch: if ``quality`` is not a table of schema Quality.
        """
        quality = Quality.empty() if quality is None else quality
        check(quality, Quality, where=self._info.match_id)
        self._flush()
        # once more: with what is known now, and so that one bad byte cannot make the log anonymous
        self._describe(info or self._info, quality)
        self._put(_encoded(DataEnd(data_section_crc=self._crc)))
        self._put(self._summary())
        self._stream.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()

    def _put(self, data: bytes) -> None:
        self._stream.write(data)
        self._crc = zlib.crc32(data, self._crc)
        self._written += len(data)

    def _describe(self, info: MatchInfo, quality: pl.DataFrame) -> None:
        record = _encoded(Metadata(name=METADATA, metadata=_description(info, quality)))
        self._metadata.append(MetadataIndex(offset=self._written, length=len(record), name=METADATA))
        self._put(record)

    def _append(self, channel: int, messages: Messages) -> None:
        t_ns: I64 = messages.heads["log_time"]
        if len(messages) and int(t_ns.min()) < 0:
            raise BadRecording(
                f"a message on {TOPICS[channel - 1].name} has time {int(t_ns.min())} ns, before time zero",
                where=self._info.match_id, next_step="Count time from the earliest sample",
            )
        content, starts = cdr.lay_out(messages)
        first = 0
        while first < len(messages):
            room = self._chunk_bytes - self._pending_bytes
            last = int(np.searchsorted(starts, starts[first] + room, side="right")) - 1
            if last == first and self._pending:
                self._flush()
                continue
            last = max(last, first + 1)  # a message larger than a chunk gets one of its own
            self._pending.append(Piece(
                channel, t_ns[first:last], starts[first:last] - starts[first] + self._pending_bytes,
                content[starts[first]:starts[last]],
            ))
            self._pending_bytes += int(starts[last] - starts[first])
            self._counts[channel] = self._counts.get(channel, 0) + last - first
            first = last

    def _flush(self) -> None:
        """Write what is pending as one chunk with its indexes."""
        if not self._pending:
            return
        chunk = seal(self._pending, self._compressor)
        self._pending, self._pending_bytes = [], 0
        self._chunks.append(ChunkIndex(
            chunk_length=chunk.length, chunk_start_offset=self._written, compression="zstd",
            compressed_size=chunk.stored, message_end_time=chunk.end_ns,
            message_index_length=len(chunk.data) - chunk.length,
            message_index_offsets={c: self._written + at for c, at in chunk.index_offsets.items()},
            message_start_time=chunk.start_ns, uncompressed_size=chunk.size,
        ))
        self._put(chunk.data)
        self._stream.flush()

    def _summary(self) -> bytes:
        """The summary section, the footer and the closing magic."""
        statistics = Statistics(
            attachment_count=0, channel_count=len(self._channels), channel_message_counts=self._counts,
            chunk_count=len(self._chunks), message_count=sum(self._counts.values()),
            message_end_time=max((c.message_end_time for c in self._chunks), default=0),
            message_start_time=min((c.message_start_time for c in self._chunks), default=0),
            metadata_count=len(self._metadata), schema_count=len(self._schemas),
        )
        groups: tuple[tuple[Opcode, list[McapRecord]], ...] = (
            (Opcode.SCHEMA, [*self._schemas]),
            (Opcode.CHANNEL, [*self._channels]),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, [*self._chunks]),
            (Opcode.METADATA_INDEX, [*self._metadata]),
        )
        section, offsets = b"", []
        for opcode, records in groups:
            group = _encoded(*records)
            if group:
                offsets.append(SummaryOffset(
                    group_opcode=opcode, group_start=self._written + len(section), group_length=len(group)
                ))
            section += group
        footer = Footer(self._written, self._written + len(section), summary_crc=0)
        section += _encoded(*offsets)
        covered = section + _encoded(footer)[:-4]
        footer.summary_crc = zlib.crc32(covered)
        return section + _encoded(footer) + MCAP0_MAGIC


def write(log: MatchLog, stream: BinaryIO, *, chunk_bytes: int = CHUNK_BYTES, level: int = 1) -> None:
    """Write a whole match; the same log gives the same bytes.

    Events and decisions are laid beside the frames of their time, so that a part of the file is a
    part of the match.

    Args:
        log: what to write; its quality rows go along.
        stream: buffered, writable; nothing has been written to it yet, and it stays open.
        chunk_bytes: see :class:`Recorder`.
        level: of zstd.

    Raises:
        BadRecording: if a sample or an event is before time zero.
        SchemaMismatch: if a table does not fit its schema.
        OSError: if the stream refuses a write.
    """
    check(log.referee, Referee, where=log.info.match_id)
    check(log.decisions, Decisions, where=log.info.match_id)
    recorder = Recorder(stream, log.info, chunk_bytes=chunk_bytes, level=level)
    referee = cdr.pack_referee(log.referee.sort("t_ns", maintain_order=True), REFEREE)
    decisions = cdr.pack_decisions(log.decisions.sort("t_ns", maintain_order=True), DECISION)
    done = {REFEREE: 0, DECISION: 0}
    for part in _slices(log.frames):
        recorder.frames(part)
        for channel, messages in ((REFEREE, referee), (DECISION, decisions)):
            upto = int(np.searchsorted(messages.heads["log_time"], part.t_ns.max(), side="right"))
            recorder._append(channel, messages[done[channel]:upto])
            done[channel] = max(done[channel], upto)
    recorder._append(REFEREE, referee[done[REFEREE]:])
    recorder._append(DECISION, decisions[done[DECISION]:])
    recorder.close(quality=log.quality)


def _slices(frames: Frames) -> Iterator[Frames]:
    for first in range(0, len(frames), _SLICE):
        last = min(first + _SLICE, len(frames))
        offsets = frames.offsets[first:last + 1]
        yield Frames(
            frames.number[first:last], frames.t_ns[first:last], frames.ball[first:last],
            offsets - offsets[0], frames.robots[offsets[0]:offsets[-1]],
        )


def _declarations() -> tuple[list[Schema], list[Channel]]:
    schemas = [
        Schema(
            id=i, name=f"pitchlore/msg/{topic.definition}", encoding=SchemaEncoding.ROS2,
            data=cdr.definition(topic.definition, *topic.parts).encode(),
        )
        for i, topic in enumerate(TOPICS, start=1)
    ]
    channels = [
        Channel(id=i, topic=topic.name, message_encoding=MessageEncoding.CDR, metadata={}, schema_id=i)
        for i, topic in enumerate(TOPICS, start=1)
    ]
    return schemas, channels


def _encoded(*records: McapRecord) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())


def _description(info: MatchInfo, quality: pl.DataFrame) -> dict[str, str]:
    """The metadata: info and quality as JSON, and a CRC of their own that tells which copy is good."""
    texts = {
        "info": json.dumps(info.model_dump(mode="json"), sort_keys=True),
        "quality": json.dumps(quality.drop("match_id").to_dicts(), sort_keys=True),
    }
    return {**texts, "crc32": _checksum(texts)}


def _checksum(texts: dict[str, str]) -> str:
    return f"{zlib.crc32(json.dumps([texts.get('info'), texts.get('quality')]).encode()):08x}"


# --- reading -----------------------------------------------------------------------------------

_FOOTER_BYTES = FRAMING_BYTES + 20
_DATA_END_BYTES = FRAMING_BYTES + 4
R = TypeVar("R", bound=McapRecord)


class _Summary(NamedTuple):
    """The summary section of a file, after its CRC was checked.

    Attributes:
        start: where it starts.
        schemas, channels: by id.
        chunks: the index of the chunks.
        messages: how many the file has, None where it does not say.
        landmarks: places in the data section where a record starts, ascending.
    """

    start: int
    schemas: dict[int, Schema]
    channels: dict[int, Channel]
    chunks: list[ChunkIndex]
    messages: int | None
    landmarks: list[int]


def read(data: bytes | memoryview, *, where: str, default_info: MatchInfo | None = None) -> MatchLog:
    """Read a log, whoever wrote it, as far as it is whole.

    Frames keep the order of the file, events are in order of time, decisions in that of their
    schema. What is damaged or cut off is left out, said in the rows of ``quality`` and in
    ``info.incomplete_reason``, and ``info.complete`` is False; it is True only if every checksum
    that the file has holds. A chunk that declares more than ``MAX_CHUNK_BYTES`` counts as damaged
    and is never decompressed. Messages on channels that are not the log's, or that are not
    well-formed, are counted as 'skipped'.

    Args:
        data: the file's bytes; they are not changed.
        where: the file's name, for errors and notes.
        default_info: what to take for a file that does not say which match it is (one that was not
            written here). Its times then count from its earliest message.

    Raises:
        DamagedLog: if the file is not MCAP, none of its frames can be read, it declares more than
            ``MAX_LOG_BYTES``, or it does not say which match it is and ``default_info`` is None.
    """
    return _Reading(memoryview(data).cast("B"), where).log(default_info)


class _Reading:
    """One file on its way from bytes to arrays."""

    def __init__(self, view: memoryview, where: str) -> None:
        self._view, self._where = view, where
        self._flaws: list[Flaw] = []
        self._reasons: list[str] = []
        self._skipped: dict[str, list[I64]] = {}
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._parts: dict[int, list[Messages]] = {FRAME: [], REFEREE: [], DECISION: []}
        self._seen = self._budget = 0

    def log(self, default_info: MatchInfo | None) -> MatchLog:
        """The match."""
        magic = len(MCAP0_MAGIC)
        if MCAP0_MAGIC not in (bytes(self._view[:magic]), bytes(self._view[-magic:])):
            raise DamagedLog("is not an MCAP file", where=self._where, next_step="Import it if it is a recording")
        summary = self._summary()
        records, found_end = self._records(summary)
        self._declare(self._view, records)
        own, bad_copies = self._description(records)
        info = own[0] if own else default_info
        if info is None:
            what = "the record that says which match it is is damaged" if bad_copies else "does not say which match it is"
            raise DamagedLog(what, where=self._where, next_step="Give the teams and the pitch with `default_info`")
        self._check_data_section(records, found_end, bad_copies)
        self._read_all(records, summary)
        missing = (summary.messages or 0) - self._seen if summary else 0
        if missing > 0:
            self._reasons.append(f"{missing} of {self._seen + missing} messages are missing")
        return self._assemble(info, own[1] if own else Quality.empty(), foreign=not own)

    def _damaged(self, note: str, *, flaw: str = "damaged chunk", span: tuple[int, int] | None = None) -> None:
        start, end = (span[0], span[1] + 1) if span else (None, None)
        self._flaws.append(Flaw(flaw, start, end, 1, f"{self._where}: {note}"))
        self._reasons.append(note)

    def _skip(self, label: str, t_ns: I64) -> None:
        if len(t_ns):
            self._skipped.setdefault(label, []).append(t_ns)

    # the file's frame: summary, records, checksums, declarations

    def _summary(self) -> _Summary | None:
        """The summary, or None if there is none, or none that can be trusted."""
        view, end = self._view, len(self._view) - len(MCAP0_MAGIC)
        footer_start = end - _FOOTER_BYTES
        footer = _decode(Footer, view[footer_start + FRAMING_BYTES:end]) if footer_start > 0 else None
        if footer is None or bytes(view[end:]) != MCAP0_MAGIC or view[footer_start] != Opcode.FOOTER:
            self._damaged("the file is cut off, or its end is damaged", flaw="truncated")
            return None
        if footer.summary_crc == 0:
            return None
        start = footer.summary_start or footer_start
        if start > footer_start or zlib.crc32(view[start:end - 4]) != footer.summary_crc:
            self._damaged("the summary is damaged (CRC)")
            return None
        records, _, _ = find_records(as_array(view), start, footer_start, [])
        chunks = _decoded(ChunkIndex, Opcode.CHUNK_INDEX, view, records)
        statistics = _decoded(Statistics, Opcode.STATISTICS, view, records)
        places = [chunk.chunk_start_offset for chunk in chunks]
        places += [m.offset for m in _decoded(MetadataIndex, Opcode.METADATA_INDEX, view, records)]
        self._declare(view, records)
        return _Summary(
            start, chunks, statistics[0].message_count if statistics else None,
            sorted([*places, start - _DATA_END_BYTES]),
        )

    def _survey(self, summary: _Summary | None) -> Records:
        """The records of the data section; says where they are damaged or end too early."""
        content = as_array(self._view)
        stop = summary.start if summary else len(content)
        records, end, damaged = find_records(
            content, len(MCAP0_MAGIC), stop, summary.landmarks if summary else []
        )
        for place in damaged:
            self._damaged(f"the record at byte {place} is damaged")
        if not len(records.opcodes) or records.opcodes[-1] != Opcode.DATA_END:
            if not self._reasons:
                self._damaged(f"the data end without notice at byte {end}", flaw="truncated")
        return records

    def _check_data_section(self, records: Records) -> None:
        """Check the CRC over everything before the DataEnd, unless damage has been found already."""
        ends = _decoded(DataEnd, Opcode.DATA_END, self._view, records)
        if self._reasons or not ends or ends[0].data_section_crc == 0:
            return
        if zlib.crc32(self._view[:int(records.bodies[-1]) - FRAMING_BYTES]) != ends[0].data_section_crc:
            self._damaged("bytes outside the chunks' content are damaged (CRC of the data section)")

    def _declare(self, content: memoryview, records: Records) -> None:
        """Take note of schemas and channels; the first declaration counts."""
        for schema in _decoded(Schema, Opcode.SCHEMA, content, records):
            self._schemas.setdefault(schema.id, schema)
        for channel in _decoded(Channel, Opcode.CHANNEL, content, records):
            self._channels.setdefault(channel.id, channel)

    def _description(self, records: Records) -> tuple[MatchInfo, pl.DataFrame] | None:
        """What the file says of its match: the last copy whose own CRC holds."""
        good = None
        for copy in _decoded(Metadata, Opcode.METADATA, self._view, records):
            if copy.name != METADATA:
                continue
            described = _described(copy.metadata)
            good = described or good
            if described is None:
                self._damaged("a copy of the metadata is damaged (CRC)")
        return good

    # the messages

    def _read_chunks(self, records: Records, summary: _Summary | None) -> None:
        """Read all chunks, and the messages between them, in the order of the file."""
        is_chunk = records.opcodes == Opcode.CHUNK
        chunks = dict(zip(records.bodies[is_chunk].tolist(), records.lengths[is_chunk].tolist(), strict=True))
        spans = {}
        for index in summary.chunks if summary else ():
            body = index.chunk_start_offset + FRAMING_BYTES
            chunks[body] = index.chunk_length - FRAMING_BYTES
            spans[body] = (index.message_start_time, index.message_end_time)
        edges = [0, *sorted(chunks), len(self._view)]
        loose = records.keep(records.opcodes == Opcode.MESSAGE)
        declared = 0
        for number, (body, after) in enumerate(pairwise(edges)):
            if number:
                sealed = self._view[body:body + chunks[body]]
                declared += chunk_size(sealed)
                if declared > MAX_LOG_BYTES:
                    raise DamagedLog(
                        f"declares more than {MAX_LOG_BYTES} bytes", where=self._where,
                        next_step="Do not trust it; split it if it is yours",
                    )
                try:
                    self._read_messages(*unseal(sealed))
                except DamagedChunk as error:
                    self._damaged(
                        f"chunk {number} of {len(chunks)} {error}", span=spans.get(body, chunk_span(sealed))
                    )
            if len(loose.bodies):
                between = (loose.bodies > body) & (loose.bodies < after)
                self._read_messages(as_array(self._view), loose.keep(between))

    def _read_messages(self, content: U8, records: Records) -> None:
        """Sort messages by channel, and take out those that are whole."""
        if (records.opcodes != Opcode.MESSAGE).any():
            self._declare(content.data, records)
            records = records.keep(records.opcodes == Opcode.MESSAGE)
        self._seen += len(records.bodies)
        ids = np.unique(records.channels).tolist()
        for channel in ids:
            own = records if len(ids) == 1 else records.keep(records.channels == channel)
            if channel < 0:
                self._skip("messages without a whole address", np.zeros(len(own.bodies), np.int64))
                continue
            topic, why_not = self._topic(channel)
            head = TOPICS[topic - 1].head
            whole = own.lengths >= head.itemsize - FRAMING_BYTES
            if topic in self._parts:
                self._parts[topic].append(take_out(content, own.bodies))


    # the match

