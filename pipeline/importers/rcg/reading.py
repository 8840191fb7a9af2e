"""Matches of RoboCup 2D text logs."""

from __future__ import annotations

import re

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.rcg.events import events_of
from pitchlore.pipeline.importers.rcg.lines import ParsedLines, scan_lines
from pitchlore.pipeline.importers.rcg.players import commands_of, players_of, shown_frames
from pitchlore.pipeline.importers.rows import referee
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchInfo, MatchLog, Period
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.numbers.arrays import I64


def detects(head: bytes) -> bool:
    """True if the content begins like a game log of rcssserver, text or binary."""
    return re.match(rb"ULG[\x01-\x0f0-9]", head) is not None


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a RoboCup 2D text log; the left team is home.

    The log has one sample per cycle. While play is stopped the cycle number repeats, and time goes on
    by one cycle per line. Where lines are missing time goes on by the cycles that are missing.

    Raises:
        BadRecording: if it is not a text log of version 4 or later, or has no whole show line.
    """
    name = source.name
    version = re.match(rb"ULG([4-9])\r?\n", source.content)
    if version is None:
        binary = source.content.startswith(b"ULG")
        raise BadRecording(
            "is a binary log of version 1 to 3" if binary else "does not begin with ULG4, ULG5 or ULG6",
            where=name,
            next_step="Convert it to version 4 or later with rcgconvert" if binary else "Give an .rcg log",
        )
    # a recorder that was killed may leave a file that was filled up with zeros beforehand
    whole = source.content.rstrip(b"\0")
    record = scan_lines(whole[version.end() :])
    if not record.numbers:
        raise BadRecording("has no whole show line", where=name, next_step="Record or copy it again")
    players = players_of(record)
    frames = shown_frames(record, players)
    events, over = events_of(record, frames.t_ns, source)
    cut = len(whole) < len(source.content) or (record.last_bad and not whole.endswith(b"\n"))
    flaws, reason = _damage(record, frames.t_ns, source.damage, cut=cut)
    if reason is None and not over:
        reason = "the log ends before time over"
    end_ns = int(frames.t_ns[-1]) + 1
    pitch = PITCHES[Kind.SIM2D].model_copy(update={"goal_width": record.server.goal_width})
    info = MatchInfo(
        match_id=source.match_id,
        source=name,
        format="rcg",
        home=record.names[0],
        away=record.names[1],
        pitch=pitch,
        periods=(Period(start_ns=0, end_ns=end_ns, home_attacks=1, inferred=False),),
        settings={"version": int(version[1]), "step_ms": record.server.step_ms},
        software=RELEASE,
        complete=reason is None,
        incomplete_reason=reason,
    )
    return MatchLog(
        info=info, frames=frames, referee=referee(source.match_id, events),
        quality=quality_table(source.match_id, flaws),
        commands=commands_of(record, players, frames.t_ns, source.match_id),
    )


def _damage(
    record: ParsedLines, t_ns: I64, gzip_damage: str | None, *, cut: bool
) -> tuple[list[Flaw], str | None]:
    """Flaws, and the reason why the log is not complete (None if it is)."""
    flaws = []
    cut_line = cut and record.last_bad
    if record.skipped - cut_line > 0:
        flaws.append(Flaw("skipped", "lines that are not of the format", record.skipped - cut_line))
    if record.uncounted:
        note = "counters of a player's commands that are no numbers; the samples were kept"
        flaws.append(Flaw("skipped", note, record.uncounted))
    reason = gzip_damage or ("the log is cut off" if cut else None)
    if reason is not None:
        note = f"{reason}; the incomplete last line was left out" if cut_line else reason
        flaws.append(Flaw("truncated", note, start_ns=int(t_ns[-1])))
    return flaws, reason
