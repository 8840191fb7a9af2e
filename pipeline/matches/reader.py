"""Reading of logs, damaged ones included."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from io import BytesIO
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np
import polars as pl
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, DataEnd, Footer, Metadata, MetadataIndex, Schema, Statistics
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import MCAP0_MAGIC

from pipeline.arrays import U8
from pipeline.errors import DamagedLog, NoFrames
from pipeline.matches.chunks import MAX_CHUNK_BYTES, ChunkHead, DamagedChunk, unseal, unseal_cut
from pipeline.matches.description import METADATA, is_sound, parse
from pipeline.matches.frame import MatchInfo, MatchLog
from pipeline.matches.inbox import Inbox
from pipeline.matches.quality import Flaw, quality_table
from pipeline.matches.records import FRAMING_BYTES, Records, as_array, find_records, walk
from schemas import Quality

#: Most bytes of content of all chunks; a log that declares more is not read.
MAX_LOG_BYTES = 2 << 30

_REASONS = 3  # in ``incomplete_reason``; ``quality`` has all of them
_FOOTER_BYTES = FRAMING_BYTES + 20
_DATA_END_BYTES = FRAMING_BYTES + 4
R = TypeVar("R")


class _SummarySection(NamedTuple):
    """The summary section of a file, after its CRC was checked.

    Attributes:
        start: start of the section.
        chunks: index of the chunks.
        messages: number of messages in the file, None if the file does not state it.
        landmarks: starts of some records of the data section, ascending.
    """

    start: int
    chunks: list[ChunkIndex]
    messages: int | None
    landmarks: list[int]


def read(data: bytes | memoryview, *, where: str, default_info: MatchInfo | None = None) -> MatchLog:
    """Read a log by any writer, as far as it is whole.

    Frames keep the order of the file, events are in order of time, decisions and commands in that of
    their schemas. Damaged and missing parts are left out; the rows of ``quality`` and
    ``info.incomplete_reason`` name them. ``info.complete`` is True only if every checksum in the file
    holds. Of a chunk in which the file ends, the whole messages are read. A chunk that declares more than
    ``chunks.MAX_CHUNK_BYTES`` counts as damaged and is never decompressed. Messages on other topics, and
    malformed ones, are counted as 'skipped'.

    Args:
        data: the file's bytes; they are not changed.
        where: the file's name, for errors and notes.
        default_info: description for a foreign file, which does not name its match. Its times then count
            from its earliest message.

    Raises:
        NoFrames: if no frame can be read.
        DamagedLog: if the file is not MCAP, declares more than ``MAX_LOG_BYTES``, or has no metadata record
            of ours and ``default_info`` is None.
    """
    return _Reading(memoryview(data).cast("B"), where).log(default_info)


class _Reading:
    """One file on its way from bytes to arrays, with its content and flaws so far."""

    def __init__(self, view: memoryview, where: str) -> None:
        self._view, self._where = view, where
        self._flaws: list[Flaw] = []
        self._reasons: list[str] = []
        self._schemas: dict[int, Schema] = {}
        self._inbox = Inbox()
        self._cut: memoryview | None = None

    def log(self, default_info: MatchInfo | None) -> MatchLog:
        """Match of the file; see :func:`read`."""
        magic = len(MCAP0_MAGIC)
        if MCAP0_MAGIC not in (bytes(self._view[:magic]), bytes(self._view[-magic:])):
            raise self._error("is not an MCAP file", "Import recordings of other formats first")
        summary = self._summary()
        records = self._survey(summary)
        self._declare(self._view, records)
        own = self._description(records)
        info = own[0] if own else default_info
        if info is None:
            content = np.isin(records.opcodes, (Opcode.CHUNK, Opcode.MESSAGE)).any()
            raise self._error(
                self._reasons[0] if self._reasons else "does not say which match it is",
                "Copy the log again, or export the match as a tracking table (CSV or Parquet)",
                DamagedLog if content else NoFrames,
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

    def _error(self, what: str, next_step: str, kind: type[DamagedLog] = DamagedLog) -> DamagedLog:
        return kind(what, where=self._where, next_step=next_step)

    def _damaged(
        self, note: str, *, flaw: str = "damaged record", span: tuple[int, int] | None = None
    ) -> None:
        start, end = (span[0], span[1] + 1) if span and span[0] <= span[1] < 2**63 - 1 else (None, None)
        self._flaws.append(Flaw(flaw, f"{self._where}: {note}", start_ns=start, end_ns=end))
        self._reasons.append(note)

    def _decoded(
        self, opcode: Opcode, decode: Callable[[ReadDataStream], R], content: memoryview, records: Records
    ) -> list[R]:
        """Records of one kind, decoded; damaged ones become flaws."""
        found = []
        for i in np.flatnonzero(records.opcodes == opcode).tolist():
            body, length = int(records.bodies[i]), int(records.lengths[i])
            try:
                found.append(decode(ReadDataStream(BytesIO(content[body:body + length]))))
            except (McapError, struct.error, UnicodeDecodeError):
                self._damaged(f"the {opcode.name.lower().replace('_', ' ')} record at byte {body} is damaged")
        return found

    def _summary(self) -> _SummarySection | None:
        """The summary; None if it is missing or damaged."""
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
        return _SummarySection(
            start, chunks, statistics[0].message_count if statistics else None,
            sorted([*landmarks, start - _DATA_END_BYTES]),
        )

    def _survey(self, summary: _SummarySection | None) -> Records:
        """The records of the data section; damage and an early end become flaws."""
        content = as_array(self._view)
        stop, landmarks = (summary.start, summary.landmarks) if summary else (len(content), [])
        records, end, damaged = find_records(content, len(MCAP0_MAGIC), stop, landmarks)
        for place in damaged:
            self._damaged(f"the record at byte {place} is damaged")
        if summary is None and end + FRAMING_BYTES < len(content) and content[end] == Opcode.CHUNK:
            self._cut = self._view[end + FRAMING_BYTES:]
        if not self._reasons and (not len(records.opcodes) or records.opcodes[-1] != Opcode.DATA_END):
            self._damaged(f"its data end without notice at byte {end}", flaw="truncated")
        return records

    def _check_data_section(self, records: Records) -> None:
        """Check the CRC over all before the DataEnd, unless known damage makes it fail anyway."""
        ends = self._decoded(Opcode.DATA_END, DataEnd.read, self._view, records)
        if self._reasons or not ends or ends[-1].data_section_crc == 0:
            return
        if zlib.crc32(self._view[:int(records.bodies[-1]) - FRAMING_BYTES]) != ends[-1].data_section_crc:
            self._damaged("bytes outside the chunks' content are damaged (CRC of the data section)")

    def _declare(self, content: memoryview, records: Records) -> None:
        """Register schemas and channels; the first declaration, the summary's, counts."""
        for schema in self._decoded(Opcode.SCHEMA, Schema.read, content, records):
            self._schemas.setdefault(schema.id, schema)
        for channel in self._decoded(Opcode.CHANNEL, Channel.read, content, records):
            by = self._schemas.get(channel.schema_id)
            definition = None
            if by and (channel.message_encoding, by.encoding) == (MessageEncoding.CDR, SchemaEncoding.ROS2):
                definition = by.data.decode(errors="replace")
            self._inbox.declare(channel.id, channel.topic, definition)

    def _description(self, records: Records) -> tuple[MatchInfo, pl.DataFrame] | None:
        """The file's description of its match: the last copy with a valid CRC."""
        copies = self._decoded(Opcode.METADATA, Metadata.read, self._view, records)
        described = [copy.metadata for copy in copies if copy.name == METADATA]
        sound = [texts for texts in described if is_sound(texts)]
        if len(sound) < len(described):
            self._damaged("a copy of the metadata that describe the match is damaged")
        return parse(sound[-1], where=self._where) if sound else None

    def _read_chunks(self, records: Records, summary: _SummarySection | None) -> None:
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
        heads = {body: ChunkHead.of(chunk) for body, chunk in chunks.items()}
        cut = ChunkHead.of(self._cut if self._cut is not None else memoryview(b""))
        declared = sum(head.size for head in (*heads.values(), cut) if head.size <= MAX_CHUNK_BYTES)
        if declared > MAX_LOG_BYTES:
            raise self._error(f"declares more than {MAX_LOG_BYTES} bytes", "Split it if you trust it")
        self._inbox.reserve(declared + int(loose.lengths.sum()) + FRAMING_BYTES * len(loose.lengths))
        for number, (body, after) in enumerate(pairwise([0, *chunks, len(self._view)])):
            if number:
                try:
                    self._read_messages(*unseal(chunks[body]))
                except DamagedChunk as damage:
                    note = f"chunk {number} of {len(chunks)} {damage}"
                    span = spans.get(body, (heads[body].start_ns, heads[body].end_ns))
                    self._damaged(note, flaw="damaged chunk", span=span)
            if len(loose.bodies):
                between = (loose.bodies > body) & (loose.bodies < after)
                self._read_messages(as_array(self._view), loose.keep(between))
        if self._cut is not None:
            self._read_cut(self._cut, cut)

    def _read_cut(self, body: memoryview, head: ChunkHead) -> None:
        """Read what is there of the chunk that the file ends in."""
        content, records = unseal_cut(body)
        if not len(records.opcodes):
            return
        self._read_messages(content, records)
        share = (int(records.bodies[-1]) + int(records.lengths[-1])) / max(head.size, 1)
        self._damaged(f"the last chunk is cut off: its first {share:.0%} were kept, which no CRC vouches for",
                      flaw="damaged chunk", span=(head.start_ns, head.end_ns))

    def _read_messages(self, content: U8, records: Records) -> None:
        if (records.opcodes != Opcode.MESSAGE).any():
            self._declare(content.data, records)
        self._inbox.take(content, records)

    def _assemble(self, info: MatchInfo, carried: pl.DataFrame, *, foreign: bool) -> MatchLog:
        frames = self._inbox.frames()
        if not len(frames) and (self._reasons or foreign):
            why = self._reasons[0] if self._reasons else "it has no /frame of ours"
            raise self._error(
                f"none of its frames can be read ({why})", "Get another copy of the file", NoFrames)
        referee = self._inbox.referee(info.match_id)
        decisions = self._inbox.decisions(info.match_id)
        commands = self._inbox.commands(info.match_id)
        heights = self._inbox.heights()
        flaws = [*self._flaws, *self._inbox.skipped(self._where)]
        origin = 0
        if foreign:
            tables = (referee, decisions, commands)
            times = [frames.t_ns, *(table["t_ns"].to_numpy() for table in tables)]
            origin = min(int(t_ns.min()) for t_ns in times if len(t_ns))
            frames.t_ns[:] -= origin
            referee = referee.with_columns(pl.col("t_ns") - origin)
            decisions = decisions.with_columns(pl.col("t_ns", "end_ns") - origin)
            commands = commands.with_columns(pl.col("t_ns") - origin)
            heights = heights._replace(t_ns=heights.t_ns - origin)
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
        return MatchLog(info, frames, referee, decisions, quality, commands, heights)
