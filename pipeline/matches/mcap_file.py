"""Reading of MCAP files, damaged ones included: their whole parts, and what is wrong with the rest."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
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
)
from mcap.writer import MCAP0_MAGIC

from pitchlore.pipeline.base.errors import DamagedLog
from pitchlore.pipeline.matches.chunks import MAX_CHUNK_BYTES, ChunkHead, DamagedChunk, unseal, unseal_cut
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.matches.records import FRAMING_BYTES, McapRecords, as_array, find_records, walk
from pitchlore.pipeline.matches.zstd import Decompressor
from pitchlore.pipeline.numbers.arrays import U8

#: Most bytes of content of all chunks; a file that declares more is not read.
MAX_LOG_BYTES = 2 << 30

_FOOTER_BYTES = FRAMING_BYTES + 20
_DATA_END_BYTES = FRAMING_BYTES + 4
R = TypeVar("R")

#: Takes up a channel and the schema of its messages, None if the file does not have that.
Declare = Callable[[Channel, Schema | None], None]


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


class McapFile:
    """One file on its way from bytes to records, with its flaws so far.

    Call :meth:`contents` once, to the end, and then :meth:`check`. A chunk that declares more than
    ``chunks.MAX_CHUNK_BYTES`` counts as damaged and is never decompressed. Of a chunk in which the file ends,
    the whole records are given.

    Args:
        data: the file's bytes; they are not changed.
        where: the file's name, for errors and notes.
        declare: gets the channels, in the summary and where they are declared; of several declarations of one
            the first counts.

    Attributes:
        flaws: damage, a line each.
        reasons: why the file is not whole; empty if it is.
        records: records of the data section.

    Raises:
        DamagedLog: if the file is not MCAP, or declares more than ``MAX_LOG_BYTES``.
    """

    def __init__(self, data: bytes | memoryview, where: str, declare: Declare) -> None:
        self._view, self._where, self._tell = memoryview(data).cast("B"), where, declare
        self.flaws: list[Flaw] = []
        self.reasons: list[str] = []
        self._schemas: dict[int, Schema] = {}
        self._cut: memoryview | None = None
        magic = len(MCAP0_MAGIC)
        if MCAP0_MAGIC not in (bytes(self._view[:magic]), bytes(self._view[-magic:])):
            raise DamagedLog("is not an MCAP file", where=where,
                             next_step="Import recordings of other formats first")
        self._summary = self._read_summary()
        self.records = self._survey()
        self._declare(self._view, self.records)
        self._loose = self.records.keep(self.records.opcodes == Opcode.MESSAGE)
        self._chunks, self._spans = self._find_chunks()
        #: Bytes of all message records, at most.
        self.declared = self._declared()

    def damaged(
        self, note: str, *, flaw: str = "damaged record", span: tuple[int, int] | None = None
    ) -> None:
        """Note something that is wrong, with the log times that it concerns, both included."""
        start, end = (span[0], span[1] + 1) if span and span[0] <= span[1] < 2**63 - 1 else (None, None)
        self.flaws.append(Flaw(flaw, f"{self._where}: {note}", start_ns=start, end_ns=end))
        self.reasons.append(note)

    def metadata(self, name: str) -> list[dict[str, str]]:
        """The metadata records of a name, in the order of the file."""
        copies = self._decoded(Opcode.METADATA, Metadata.read, self._view, self.records)
        return [copy.metadata for copy in copies if copy.name == name]

    def library(self) -> str:
        """The program that wrote the file, as it says; empty if it does not."""
        heads = self._decoded(Opcode.HEADER, Header.read, self._view, self.records)
        return heads[0].library if heads else ""

    def contents(self) -> Iterator[tuple[U8, McapRecords]]:
        """Bytes that hold message records, and the records, in the order of the file; damage is noted."""
        heads, frames = {body: ChunkHead.of(chunk) for body, chunk in self._chunks.items()}, Decompressor()
        for number, (body, after) in enumerate(pairwise([0, *self._chunks, len(self._view)])):
            if number:
                try:
                    yield self._declared_in(*unseal(self._chunks[body], frames))
                except DamagedChunk as damage:
                    span = self._spans.get(body, (heads[body].start_ns, heads[body].end_ns))
                    note = f"chunk {number} of {len(self._chunks)} {damage}"
                    self.damaged(note, flaw="damaged chunk", span=span)
            if len(self._loose.bodies):
                between = (self._loose.bodies > body) & (self._loose.bodies < after)
                yield as_array(self._view), self._loose.keep(between)
        if self._cut is not None:
            yield from self._cut_content(self._cut)

    def check(self, seen: int) -> None:
        """Note messages that are missing, and bytes that differ from what the file's CRC vouches for.

        Args:
            seen: number of messages that were given.
        """
        missing = (self._summary.messages or 0) - seen if self._summary else 0
        if missing > 0:
            note = f"{missing} of {seen + missing} messages are missing"
            if self.reasons:  # the rows of quality say already why
                self.reasons.append(note)
            else:
                self.damaged(note)
        ends = self._decoded(Opcode.DATA_END, DataEnd.read, self._view, self.records)
        # known damage makes it fail anyway
        if self.reasons or not ends or ends[-1].data_section_crc == 0:
            return
        if zlib.crc32(self._view[:int(self.records.bodies[-1]) - FRAMING_BYTES]) != ends[-1].data_section_crc:
            self.damaged("bytes outside the chunks' content are damaged (CRC of the data section)")

    def _decoded(
        self, opcode: Opcode, decode: Callable[[ReadDataStream], R], content: memoryview, records: McapRecords
    ) -> list[R]:
        """Records of one kind, decoded; damaged ones become flaws."""
        found = []
        for i in np.flatnonzero(records.opcodes == opcode).tolist():
            body, length = int(records.bodies[i]), int(records.lengths[i])
            try:
                found.append(decode(ReadDataStream(BytesIO(content[body:body + length]))))
            except (McapError, struct.error, UnicodeDecodeError):
                self.damaged(f"the {opcode.name.lower().replace('_', ' ')} record at byte {body} is damaged")
        return found

    def _read_summary(self) -> _SummarySection | None:
        """The summary; None if it is missing or damaged."""
        view, end = self._view, len(self._view) - len(MCAP0_MAGIC)
        footer_start = end - _FOOTER_BYTES
        if footer_start < 0 or bytes(view[end:]) != MCAP0_MAGIC or view[footer_start] != Opcode.FOOTER:
            self.damaged("the file is cut off, or its end is damaged", flaw="truncated")
            return None
        footer = Footer.read(ReadDataStream(BytesIO(view[footer_start + FRAMING_BYTES:end])))
        if footer.summary_crc == 0:
            return None
        start = footer.summary_start or footer_start
        if start > footer_start or zlib.crc32(view[start:end - 4]) != footer.summary_crc:
            self.damaged("the summary at its end is damaged (CRC)")
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

    def _survey(self) -> McapRecords:
        """The records of the data section; damage and an early end become flaws."""
        content, summary = as_array(self._view), self._summary
        stop, landmarks = (summary.start, summary.landmarks) if summary else (len(content), [])
        records, end, damaged = find_records(content, len(MCAP0_MAGIC), stop, landmarks)
        for place in damaged:
            self.damaged(f"the record at byte {place} is damaged")
        if summary is None and end + FRAMING_BYTES < len(content) and content[end] == Opcode.CHUNK:
            self._cut = self._view[end + FRAMING_BYTES:]
        if not self.reasons and (not len(records.opcodes) or records.opcodes[-1] != Opcode.DATA_END):
            self.damaged(f"its data end without notice at byte {end}", flaw="truncated")
        return records

    def _declare(self, content: memoryview, records: McapRecords) -> None:
        """Register schemas, and give the channels away."""
        for schema in self._decoded(Opcode.SCHEMA, Schema.read, content, records):
            self._schemas.setdefault(schema.id, schema)
        for channel in self._decoded(Opcode.CHANNEL, Channel.read, content, records):
            self._tell(channel, self._schemas.get(channel.schema_id))

    def _find_chunks(self) -> tuple[dict[int, memoryview], dict[int, tuple[int, int]]]:
        """The chunks by where they begin, in order, and the log times of those that the summary has."""
        found = self.records.keep(self.records.opcodes == Opcode.CHUNK)
        bounds = dict(zip(found.bodies.tolist(), (found.bodies + found.lengths).tolist(), strict=True))
        spans = {}
        for index in self._summary.chunks if self._summary else ():
            body = index.chunk_start_offset + FRAMING_BYTES
            bounds[body] = index.chunk_start_offset + index.chunk_length
            spans[body] = (index.message_start_time, index.message_end_time)
        return {body: self._view[body:bounds[body]] for body in sorted(bounds)}, spans

    def _declared(self) -> int:
        sizes = [ChunkHead.of(chunk).size for chunk in (*self._chunks.values(), self._cut or memoryview(b""))]
        declared = sum(size for size in sizes if size <= MAX_CHUNK_BYTES)
        if declared > MAX_LOG_BYTES:
            raise DamagedLog(f"declares more than {MAX_LOG_BYTES} bytes", where=self._where,
                             next_step="Split it if you trust it")
        return declared + int(self._loose.lengths.sum()) + FRAMING_BYTES * len(self._loose.lengths)

    def _cut_content(self, body: memoryview) -> Iterator[tuple[U8, McapRecords]]:
        """Readable part of the chunk that the file ends in."""
        content, records = unseal_cut(body)
        if not len(records.opcodes):
            return
        yield self._declared_in(content, records)
        head = ChunkHead.of(body)
        share = (int(records.bodies[-1]) + int(records.lengths[-1])) / max(head.size, 1)
        self.damaged(f"the last chunk is cut off: its first {share:.0%} were kept, which no CRC vouches for",
                     flaw="damaged chunk", span=(head.start_ns, head.end_ns))

    def _declared_in(self, content: U8, records: McapRecords) -> tuple[U8, McapRecords]:
        """The same, after its schemas and channels were taken up."""
        if (records.opcodes != Opcode.MESSAGE).any():
            self._declare(content.data, records)
        return content, records
