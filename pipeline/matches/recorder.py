"""Writing of logs, while a match is played or all at once."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np
import polars as pl
from mcap.well_known import Profile

from pitchlore.pipeline.base.digests import Content
from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.base.spool import Spool, spooling
from pitchlore.pipeline.matches import cdr
from pitchlore.pipeline.matches.channels import (
    ALWAYS,
    COMMAND,
    DECISION,
    FRAME,
    HEIGHT,
    OPTION,
    REFEREE,
    ROWS,
    TOPICS,
    declarations,
)
from pitchlore.pipeline.matches.description import METADATA, description_of
from pitchlore.pipeline.matches.frame import Frames, MatchInfo, MatchLog
from pitchlore.pipeline.matches.mcap_writer import CHUNK_BYTES, LIBRARY, McapWriter
from pitchlore.pipeline.matches.messages import Messages, lay_out
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.store.tables import check
from pitchlore.schemas import Quality


class Recorder:
    """Log of a match in progress: an :class:`pipeline.matches.mcap_writer.McapWriter` of matches.

    Args:
        stream: buffered, writable; nothing has been written to it yet.
        info: description of the match at its start.
        chunk_bytes: as for the writer.

    Raises:
        OSError: from any method, if the stream refuses a write.
    """

    def __init__(self, stream: BinaryIO, info: MatchInfo, *, chunk_bytes: int = CHUNK_BYTES) -> None:
        self._info = info
        self._file = McapWriter(stream, profile=Profile.ROS2, library=LIBRARY, chunk_bytes=chunk_bytes)
        self._file.describe(METADATA, description_of(info, Quality.empty()))
        self._file.declare(*declarations(ALWAYS))

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
        self._append_rows(REFEREE, events)

    def decisions(self, decisions: pl.DataFrame) -> None:
        """Append rows of schema Decisions; they take the match id of the log.

        Raises:
            SchemaMismatch: if the table is not one of schema Decisions.
            BadRecording: as for :meth:`frames`.
        """
        self._append_rows(DECISION, decisions)

    def commands(self, commands: pl.DataFrame) -> None:
        """Append rows of schema Commands; they take the match id of the log.

        Raises:
            SchemaMismatch: if the table is not one of schema Commands.
            BadRecording: as for :meth:`frames`.
        """
        self._append_rows(COMMAND, commands)

    def flush(self) -> None:
        """Write the pending messages as a chunk of their own, so that a killed process loses nothing."""
        self._file.flush()

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
        self._file.flush()
        # once more: with what is known now, and so that one bad byte cannot make the log anonymous
        self._file.describe(METADATA, description_of(info or self._info, quality))
        self._file.close()

    def _append_rows(self, channel: int, rows: pl.DataFrame) -> None:
        if len(rows):
            self._append(channel, _packed(channel, rows, self._info.match_id))

    def _append(self, channel: int, messages: Messages) -> None:
        if not len(messages):
            return
        t_ns: I64 = messages.heads["log_time"]
        if int(t_ns.min()) < 0:
            raise BadRecording(
                f"a message on {TOPICS[channel].name} has time {int(t_ns.min())} ns, before time zero",
                where=self._info.match_id, next_step="Count time from the earliest sample",
            )
        if not self._file.declared(channel):
            self._file.declare(*declarations((channel,)))
        content, starts = lay_out(messages)
        self._file.append(channel, t_ns, starts, content)


def _packed(channel: int, rows: pl.DataFrame, match_id: str) -> Messages:
    """Rows as messages, after a check of their schema."""
    check(rows, ROWS[channel].schema, where=match_id)
    return ROWS[channel].pack(rows, channel)


def write(log: MatchLog, stream: BinaryIO, *, chunk_bytes: int = CHUNK_BYTES) -> None:
    """Write a whole match; the same match gives the same bytes.

    Events, decisions, commands, heights and options are written beside the frames of their time, so that a
    part of the file is a part of the match.

    Args:
        log: the match; its rows of schema Quality are written, too.
        stream: buffered, writable; nothing has been written to it yet, and it stays open.
        chunk_bytes: see :class:`Recorder`.

    Raises:
        BadRecording: if a sample or an event is before time zero.
        SchemaMismatch: if a table does not fit its schema.
        OSError: if the stream refuses a write.
    """
    tables = {REFEREE: log.referee, DECISION: log.decisions, COMMAND: log.commands}
    left = {channel: _packed(channel, rows.sort("t_ns", maintain_order=True), log.info.match_id)
            for channel, rows in tables.items() if len(rows)}
    left |= {HEIGHT: cdr.pack_heights(log.heights, HEIGHT), OPTION: cdr.pack_options(log.options, OPTION)}
    recorder = Recorder(stream, log.info, chunk_bytes=chunk_bytes)
    for part in log.frames.parts():
        recorder.frames(part)
        for channel, messages in left.items():
            upto = int(np.searchsorted(messages.heads["log_time"], part.t_ns.max(), side="right"))
            recorder._append(channel, messages[:upto])
            left[channel] = messages[upto:]
    for channel, messages in left.items():
        recorder._append(channel, messages)
    recorder.close(quality=log.quality)


def packed(log: MatchLog) -> Content:
    """The bytes that :func:`write` writes of a whole match. They are in no memory: a long match has many.

    Raises:
        BadRecording, SchemaMismatch: as :func:`write` does.
        StorageFailed: if the temporary folder is full or cannot be written.
    """
    with Spool() as spool:
        with spooling():
            write(log, spool.stream)
        return spool.mapped()
