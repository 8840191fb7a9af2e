"""Match logs as MCAP: the recorder and the reader, beside each other.

Both move whole chunks between bytes and numpy arrays (:mod:`pipeline.cdr`); no loop runs over
messages. Every byte that is written is covered by a CRC, and every CRC is checked on reading:
what is damaged is reported and left out, what is whole is kept.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable, Iterator
from datetime import UTC
from io import BytesIO
from itertools import pairwise
from types import TracebackType
from typing import BinaryIO, NamedTuple, Self, TypeVar

import numpy as np
import polars as pl
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
from pipeline.channels import DECISION, FRAME, REFEREE, TOPICS, Inbox
from pipeline.chunks import (
    FRAMING_BYTES,
    U8,
    ChunkBuffer,
    DamagedChunk,
    Records,
    SealedChunk,
    as_array,
    chunk_size,
    chunk_span,
    find_records,
    unseal,
    walk,
)
from pipeline.errors import BadRecording, DamagedLog
from pipeline.frame import AWAY, HOME, I64, Frames, MatchInfo, MatchLog
from pipeline.tables import check
from pipeline.timeline import Flaw, quality_table
from schemas import Decisions, Matches, Quality, Referee

#: A recorder that is killed loses at most so much: about 20 s of a match of three a side.
CHUNK_BYTES = 256 << 10
#: Of zstd. Positive levels code bodies' coordinates, which are nearly noise, by entropy: files are 6 %
#: smaller, but take half as long again to write and more than twice as long to decompress.
LEVEL = -1
#: A log whose chunks declare more than this together is not read.
MAX_LOG_BYTES = 2 << 30
#: Name of the metadata record that says which match it is.
METADATA = "pitchlore"

_SLICE = 1024  # frames that `write` lays out at once: they stay in the cache
_REASONS = 3  # that ``incomplete_reason`` names; ``quality`` has them all


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
        self, stream: BinaryIO, info: MatchInfo, *, chunk_bytes: int = CHUNK_BYTES, level: int = LEVEL
    ) -> None:
        self._stream = stream
        self._info = info
        self._buffer = ChunkBuffer(chunk_bytes, level)
        self._written = self._crc = 0
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
        if len(events):
            check(events, Referee, where=self._info.match_id)
            self._append(REFEREE, cdr.pack_referee(events, REFEREE))

    def decisions(self, decisions: pl.DataFrame) -> None:
        """Append rows of schema Decisions; they take the match id of the log.

        Raises:
            SchemaMismatch: if the table is not one of schema Decisions.
            BadRecording: as for :meth:`frames`.
        """
        if len(decisions):
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
        if quality is None or not len(quality):
            quality = Quality.empty()
        else:
            check(quality, Quality, where=self._info.match_id)
        for chunk in self._buffer.seal():
            self._put_chunk(chunk)
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
        if not len(messages):
            return
        t_ns: I64 = messages.heads["log_time"]
        if int(t_ns.min()) < 0:
            raise BadRecording(
                f"a message on {TOPICS[channel].name} has time {int(t_ns.min())} ns, before time zero",
                where=self._info.match_id, next_step="Count time from the earliest sample",
            )
        content, starts = cdr.lay_out(messages)
        self._counts[channel] = self._counts.get(channel, 0) + len(messages)
        for chunk in self._buffer.add(channel, t_ns, content, starts):
            self._put_chunk(chunk)

    def _put_chunk(self, chunk: SealedChunk) -> None:
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


def write(log: MatchLog, stream: BinaryIO, *, chunk_bytes: int = CHUNK_BYTES, level: int = LEVEL) -> None:
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
    events: list[tuple[int, Messages]] = []
    if len(log.referee):
        check(log.referee, Referee, where=log.info.match_id)
        referee = log.referee.sort("t_ns", maintain_order=True)
        events.append((REFEREE, cdr.pack_referee(referee, REFEREE)))
    if len(log.decisions):
        check(log.decisions, Decisions, where=log.info.match_id)
        decisions = log.decisions.sort("t_ns", maintain_order=True)
        events.append((DECISION, cdr.pack_decisions(decisions, DECISION)))
    recorder = Recorder(stream, log.info, chunk_bytes=chunk_bytes, level=level)
    done = dict.fromkeys(TOPICS, 0)
    for part in _slices(log.frames):
        recorder.frames(part)
        for channel, messages in events:
            upto = int(np.searchsorted(messages.heads["log_time"], part.t_ns.max(), side="right"))
            recorder._append(channel, messages[done[channel]:upto])
            done[channel] = max(done[channel], upto)
    for channel, messages in events:
        recorder._append(channel, messages[done[channel]:])
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
            id=i, name=f"pitchlore/msg/{topic.message}", encoding=SchemaEncoding.ROS2,
            data=topic.definition().encode(),
        )
        for i, topic in TOPICS.items()
    ]
    channels = [
        Channel(id=i, topic=topic.name, message_encoding=MessageEncoding.CDR, metadata={}, schema_id=i)
        for i, topic in TOPICS.items()
    ]
    return schemas, channels


def _encoded(*records: McapRecord) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


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
R = TypeVar("R")


class _Summary(NamedTuple):
    """The summary section of a file, after its CRC was checked.

    Attributes:
        start: where it starts.
        chunks: the index of the chunks.
        messages: how many the file has, None where it does not say.
        landmarks: places in the data section where a record starts, ascending.
    """

    start: int
    chunks: list[ChunkIndex]
    messages: int | None
    landmarks: list[int]


def read(data: bytes | memoryview, *, where: str, default_info: MatchInfo | None = None) -> MatchLog:
    """Read a log, whoever wrote it, as far as it is whole.

    Frames keep the order of the file, events are in order of time, decisions in that of their
    schema. What is damaged or cut off is left out and said in the rows of ``quality`` and in
    ``info.incomplete_reason``; ``info.complete`` is True only if every checksum that the file has
    holds. A chunk that declares more than ``chunks.MAX_CHUNK_BYTES`` counts as damaged and is never
    decompressed. Messages that are not the log's, or not well-formed, are counted as 'skipped'.

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
    """One file on its way from bytes to arrays: what was found in it so far, and what is wrong."""

    def __init__(self, view: memoryview, where: str) -> None:
        self._view, self._where = view, where
        self._flaws: list[Flaw] = []
        self._reasons: list[str] = []
        self._schemas: dict[int, Schema] = {}
        self._inbox = Inbox()

    def log(self, default_info: MatchInfo | None) -> MatchLog:
        """The match; see :func:`read`."""
        magic = len(MCAP0_MAGIC)
        if MCAP0_MAGIC not in (bytes(self._view[:magic]), bytes(self._view[-magic:])):
            raise self._error("is not an MCAP file", "Import recordings of other formats first")
        summary = self._summary()
        records = self._survey(summary)
        self._declare(self._view, records)
        own = self._description(records)
        info = own[0] if own else default_info
        if info is None:
            raise self._error(
                self._reasons[0] if self._reasons else "does not say which match it is",
                "Say which match it is: its teams, pitch and kind (default_info)",
            )
        self._read_chunks(records, summary)
        missing = (summary.messages or 0) - self._inbox.seen if summary else 0
        if missing > 0:
            note = f"{missing} of {self._inbox.seen + missing} messages are missing"
            if self._reasons:  # the rows of quality say already why
                self._reasons.append(note)
            else:
                self._damaged(note)
        self._check_data_section(records)
        return self._assemble(info, own[1] if own else Quality.empty(), foreign=own is None)

    def _error(self, what: str, next_step: str) -> DamagedLog:
        return DamagedLog(what, where=self._where, next_step=next_step)

    def _damaged(
        self, note: str, *, flaw: str = "damaged chunk", span: tuple[int, int] | None = None
    ) -> None:
        start, end = (span[0], span[1] + 1) if span and span[0] <= span[1] < 2**63 - 1 else (None, None)
        self._flaws.append(Flaw(flaw, start, end, 1, f"{self._where}: {note}"))
        self._reasons.append(note)

    def _decoded(
        self, opcode: Opcode, decode: Callable[[ReadDataStream], R], content: memoryview, records: Records
    ) -> list[R]:
        """All records of a kind."""
        found = []
        for i in np.flatnonzero(records.opcodes == opcode).tolist():
            body, length = int(records.bodies[i]), int(records.lengths[i])
            try:
                found.append(decode(ReadDataStream(BytesIO(content[body:body + length]))))
            except (McapError, struct.error, UnicodeDecodeError):
                self._damaged(f"the {opcode.name.lower().replace('_', ' ')} record at byte {body} is damaged")
        return found

    # what is around the messages

    def _summary(self) -> _Summary | None:
        """The summary, or None if there is none, or none that can be trusted."""
        view, end = self._view, len(self._view) - len(MCAP0_MAGIC)
        footer_start = end - _FOOTER_BYTES
        if footer_start < 0 or bytes(view[end:]) != MCAP0_MAGIC or view[footer_start] != Opcode.FOOTER:
            self._damaged("the file is cut off, or its end is damaged", flaw="truncated")
            return None
        footer = Footer.read(ReadDataStream(BytesIO(view[footer_start + FRAMING_BYTES:end])))
        if footer.summary_crc == 0:
            return None
        start = footer.summary_start or footer_start
        if start > footer_start or zlib.crc32(view[start:end - 4]) != footer.summary_crc:
            self._damaged("the summary at its end is damaged (CRC)")
            return None
        records, _ = walk(as_array(view), start, footer_start)
        self._declare(view, records)
        chunks = self._decoded(Opcode.CHUNK_INDEX, ChunkIndex.read, view, records)
        metadata = self._decoded(Opcode.METADATA_INDEX, MetadataIndex.read, view, records)
        statistics = self._decoded(Opcode.STATISTICS, Statistics.read, view, records)
        landmarks = [*(c.chunk_start_offset for c in chunks), *(m.offset for m in metadata)]
        return _Summary(
            start, chunks, statistics[0].message_count if statistics else None,
            sorted([*landmarks, start - _DATA_END_BYTES]),
        )

    def _survey(self, summary: _Summary | None) -> Records:
        """The records of the data section; where they are damaged or end too early, it says so."""
        content = as_array(self._view)
        stop, landmarks = (summary.start, summary.landmarks) if summary else (len(content), [])
        records, end, damaged = find_records(content, len(MCAP0_MAGIC), stop, landmarks)
        for place in damaged:
            self._damaged(f"the record at byte {place} is damaged")
        if not self._reasons and (not len(records.opcodes) or records.opcodes[-1] != Opcode.DATA_END):
            self._damaged(f"its data end without notice at byte {end}", flaw="truncated")
        return records

    def _check_data_section(self, records: Records) -> None:
        """Check the CRC over all before the DataEnd, unless it is known already that it cannot hold."""
        ends = self._decoded(Opcode.DATA_END, DataEnd.read, self._view, records)
        if self._reasons or not ends or ends[-1].data_section_crc == 0:
            return
        if zlib.crc32(self._view[:int(records.bodies[-1]) - FRAMING_BYTES]) != ends[-1].data_section_crc:
            self._damaged("bytes outside the chunks' content are damaged (CRC of the data section)")

    def _declare(self, content: memoryview, records: Records) -> None:
        """Take note of schemas and channels; the first declaration, the summary's, counts."""
        for schema in self._decoded(Opcode.SCHEMA, Schema.read, content, records):
            self._schemas.setdefault(schema.id, schema)
        for channel in self._decoded(Opcode.CHANNEL, Channel.read, content, records):
            by = self._schemas.get(channel.schema_id)
            definition = None
            if by and (channel.message_encoding, by.encoding) == (MessageEncoding.CDR, SchemaEncoding.ROS2):
                definition = by.data.decode(errors="replace")
            self._inbox.declare(channel.id, channel.topic, definition)

    def _description(self, records: Records) -> tuple[MatchInfo, pl.DataFrame] | None:
        """What the file says of its match: the last copy whose own CRC holds."""
        copies = self._decoded(Opcode.METADATA, Metadata.read, self._view, records)
        described = [copy.metadata for copy in copies if copy.name == METADATA]
        sound = [texts for texts in described if texts.get("crc32") == _checksum(texts)]
        if len(sound) < len(described):
            self._damaged("a copy of the metadata that say which match it is is damaged")
        if not sound:
            return None
        try:
            info = MatchInfo.model_validate_json(sound[-1]["info"])
            rows = [{**row, "match_id": info.match_id} for row in json.loads(sound[-1]["quality"])]
            return info, pl.DataFrame(rows, schema=Quality.dtypes()) if rows else Quality.empty()
        except (ValidationError, ValueError, TypeError, KeyError, pl.exceptions.PolarsError) as error:
            raise self._error(
                "its metadata are of another version of pitchlore", "Read it with the version that wrote it"
            ) from error

    # the messages

    def _read_chunks(self, records: Records, summary: _Summary | None) -> None:
        """Read all chunks, and the messages between them, in the order of the file."""
        found = records.keep(records.opcodes == Opcode.CHUNK)
        loose = records.keep(records.opcodes == Opcode.MESSAGE)
        bounds = dict(zip(found.bodies.tolist(), (found.bodies + found.lengths).tolist(), strict=True))
        spans = {}
        for index in summary.chunks if summary else ():
            body = index.chunk_start_offset + FRAMING_BYTES
            bounds[body] = index.chunk_start_offset + index.chunk_length
            spans[body] = (index.message_start_time, index.message_end_time)
        chunks = {body: self._view[body:bounds[body]] for body in sorted(bounds)}
        declared = sum(map(chunk_size, chunks.values()))
        if declared > MAX_LOG_BYTES:
            raise self._error(f"declares more than {MAX_LOG_BYTES} bytes", "Split it if you trust it")
        self._inbox.reserve(declared + int(loose.lengths.sum()) + FRAMING_BYTES * len(loose.lengths))
        for number, (body, after) in enumerate(pairwise([0, *chunks, len(self._view)])):
            if number:
                try:
                    self._read_messages(*unseal(chunks[body]))
                except DamagedChunk as damage:
                    span = spans.get(body, chunk_span(chunks[body]))
                    self._damaged(f"chunk {number} of {len(chunks)} {damage}", span=span)
            if len(loose.bodies):
                between = (loose.bodies > body) & (loose.bodies < after)
                self._read_messages(as_array(self._view), loose.keep(between))

    def _read_messages(self, content: U8, records: Records) -> None:
        if (records.opcodes != Opcode.MESSAGE).any():
            self._declare(content.data, records)
        self._inbox.take(content, records)

    # the match

    def _assemble(self, info: MatchInfo, carried: pl.DataFrame, *, foreign: bool) -> MatchLog:
        frames = self._inbox.frames()
        if not len(frames) and (self._reasons or foreign):
            why = self._reasons[0] if self._reasons else "it has no /frame of ours"
            raise self._error(f"none of its frames can be read ({why})", "Get another copy of the file")
        referee = self._inbox.referee(info.match_id)
        decisions = self._inbox.decisions(info.match_id)
        flaws = [*self._flaws, *self._inbox.skipped(self._where)]
        origin = 0
        if foreign:
            times = [frames.t_ns, referee["t_ns"].to_numpy(), decisions["t_ns"].to_numpy()]
            origin = min(int(t_ns.min()) for t_ns in times if len(t_ns))
            frames.t_ns[:] -= origin
            referee = referee.with_columns(pl.col("t_ns") - origin)
            decisions = decisions.with_columns(pl.col("t_ns", "end_ns") - origin)
        if self._reasons:
            reasons = [info.incomplete_reason] if info.incomplete_reason else []
            reasons += self._reasons[:_REASONS]
            if len(self._reasons) > _REASONS:
                reasons.append(f"{len(self._reasons) - _REASONS} more (see quality)")
            info = info.model_copy(update={"complete": False, "incomplete_reason": "; ".join(reasons)})
        quality = carried
        if flaws:
            found = quality_table(info.match_id, flaws).with_columns(pl.col("start_ns", "end_ns") - origin)
            quality = pl.concat([carried, found])
        return MatchLog(info, frames, referee, decisions, quality)


# --- the table -----------------------------------------------------------------------------------


def row(log: MatchLog) -> pl.DataFrame:
    """The match as one row of schema Matches.

    The sampling rate is 1 / median of the positive intervals between consecutive samples; the score
    is the last that the referee is known to have said.
    """
    info, frames = log.info, log.frames
    steps = np.diff(frames.t_ns)
    steps = steps[steps > 0]
    robots, samples = frames.robots, frames.robot_frames()
    most = max(
        int(np.bincount(samples[robots["team"] == team], minlength=1).max()) for team in (HOME, AWAY)
    )
    started = info.started_at
    if started is not None:
        started = started.replace(tzinfo=UTC) if started.tzinfo is None else started.astimezone(UTC)
    scores = {
        score: log.referee.sort("t_ns", maintain_order=True)[score].drop_nulls().to_list()
        for score in ("score_home", "score_away")
    }
    values = {
        "match_id": info.match_id,
        "source": info.source,
        "home": info.home,
        "away": info.away,
        "started_at": started,
        "duration_s": int(frames.t_ns.max() - frames.t_ns.min()) / 1e9 if len(frames) else 0.0,
        "hz": 1e9 / float(np.median(steps)) if len(steps) else None,
        "robots_per_team": most,
        **{score: known[-1] if known else None for score, known in scores.items()},
        "complete": info.complete,
        "incomplete_reason": info.incomplete_reason,
        "kind": info.pitch.kind.value,
        "pitch_length": info.pitch.length,
        "pitch_width": info.pitch.width,
        "goal_width": info.pitch.goal_width,
        "frames": len(frames),
        "format": info.format,
        "direction_inferred": any(period.inferred for period in info.periods),
    }
    return pl.DataFrame([values], schema=Matches.dtypes())
