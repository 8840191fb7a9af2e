"""Reading of logs, damaged ones included."""

from __future__ import annotations

import numpy as np
import polars as pl
from mcap.opcode import Opcode

from pitchlore.pipeline.base.errors import DamagedLog, NoFrames
from pitchlore.pipeline.matches.description import METADATA, is_sound, parse
from pitchlore.pipeline.matches.frame import Frames, MatchInfo, MatchLog
from pitchlore.pipeline.matches.holes import holes_in
from pitchlore.pipeline.matches.inbox import Inbox
from pitchlore.pipeline.matches.mcap_file import McapFile
from pitchlore.pipeline.matches.mcap_writer import LIBRARY
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.schemas import Quality

_REASONS = 3  # in ``incomplete_reason``; ``quality`` has all of them


def read(data: bytes | memoryview, *, where: str, default_info: MatchInfo | None = None) -> MatchLog:
    """Read a log by any writer, as far as it is whole.

    Frames of a file that our recorder wrote keep its order, those of others come in order of log time. Events
    are in order of time, decisions and commands in that of their schemas. Damaged and missing parts are left
    out; the rows of ``quality`` and ``info.incomplete_reason`` name them. ``info.complete`` is True only if
    every checksum in the file holds, and no message that others numbered is missing. Of a chunk in which the
    file ends, the whole messages are read. A chunk that declares more than ``chunks.MAX_CHUNK_BYTES`` counts
    as damaged and is never decompressed. Messages on other topics, and malformed ones, are counted as
    'skipped'.

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
    return _Reading(data, where).log(default_info)


class _Reading:
    """One log on its way from bytes to arrays."""

    def __init__(self, data: bytes | memoryview, where: str) -> None:
        self._where = where
        self._inbox = Inbox()
        self._file = McapFile(data, where, self._inbox.declare)

    def log(self, default_info: MatchInfo | None) -> MatchLog:
        """Match of the file; see :func:`read`."""
        file, reasons = self._file, self._file.reasons
        own = self._description()
        info = own[0] if own else default_info
        if info is None:
            has_content = np.isin(file.records.opcodes, (Opcode.CHUNK, Opcode.MESSAGE)).any()
            kind = DamagedLog if has_content else NoFrames
            raise kind(
                reasons[0] if reasons else "does not say which match it is", where=self._where,
                next_step="Copy the log again, or export the match as a tracking table (CSV or Parquet)",
            )
        ours = file.library() == LIBRARY
        self._inbox.reserve(file.declared, numbered=not ours)
        for content, records in file.contents():
            self._inbox.take(content, records)
        file.check(self._inbox.seen)
        return self._assemble(info, own[1] if own else Quality.empty(), foreign=own is None, ours=ours)

    def _description(self) -> tuple[MatchInfo, pl.DataFrame] | None:
        """The file's description of its match: the last copy with a valid CRC."""
        described = self._file.metadata(METADATA)
        sound = [texts for texts in described if is_sound(texts)]
        if len(sound) < len(described):
            self._file.damaged("a copy of the metadata that describe the match is damaged")
        return parse(sound[-1], where=self._where) if sound else None

    def _assemble(self, info: MatchInfo, carried: pl.DataFrame, *, foreign: bool, ours: bool) -> MatchLog:
        frames, broken = self._inbox.frames(), self._file.reasons
        if not len(frames) and (broken or foreign):
            why = broken[0] if broken else "it has no /frame of ours"
            raise NoFrames(f"none of its frames can be read ({why})", where=self._where,
                           next_step="Get another copy of the file")
        if not ours:
            frames = frames.by_time()
            self._note_holes(frames, foreign=foreign)
        referee = self._inbox.referee(info.match_id)
        decisions = self._inbox.decisions(info.match_id)
        commands = self._inbox.commands(info.match_id)
        heights, options = self._inbox.heights(), self._inbox.options()
        flaws = [*self._file.flaws, *self._inbox.skipped(self._where)]
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
            options["t_ns"] -= origin
        if broken:
            reasons = [info.incomplete_reason] if info.incomplete_reason else []
            reasons += broken[:_REASONS]
            if len(broken) > _REASONS:
                reasons.append(f"{len(broken) - _REASONS} more (see quality)")
            info = info.model_copy(update={"complete": False, "incomplete_reason": "; ".join(reasons)})
        quality = carried
        if flaws:
            found = quality_table(info.match_id, flaws).with_columns(pl.col("start_ns", "end_ns") - origin)
            quality = pl.concat([carried, found])
        return MatchLog(info, frames, referee, decisions, quality, commands, heights, options)

    def _note_holes(self, frames: Frames, *, foreign: bool) -> None:
        """Note numbers that are missing; a described log says itself if it is complete without frames."""
        found = self._inbox.holes()
        numbers = holes_in(frames.number.astype(np.int64), frames.t_ns)
        if numbers is not None:
            found.append(("frames", numbers))
        for name, (count, missing, start_ns, end_ns) in found:
            note = f"{missing} {name} are missing: their numbers have holes"
            self._file.flaws.append(Flaw("gap", f"{self._where}: {note}", count, start_ns, end_ns))
            if foreign or name != "frames":
                self._file.reasons.append(note)
