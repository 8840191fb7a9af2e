"""Matches of RoboCup 2D logs."""

from __future__ import annotations

import re
from datetime import datetime

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.game.pitch import PITCHES, Kind
from pitchlore.pipeline.importers.rcg.events import events_of
from pitchlore.pipeline.importers.rcg.json_lines import text_lines, timestamp_of
from pitchlore.pipeline.importers.rcg.lines import ParsedLines, scan_lines
from pitchlore.pipeline.importers.rcg.players import commands_of, players_of, shown_frames
from pitchlore.pipeline.importers.rcg.stamina import stamina_of
from pitchlore.pipeline.importers.rows import referee
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchInfo, MatchLog, Period
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.schemas import Stamina

#: The begin of a log, its version or the array of one in JSON; and after a line's end, which is found fast.
_BEGIN = rb"(?:ULG([4-9])\b[^\n]*|JSON\b[^\n]*|\[)"
_FIRST, _NEXT = re.compile(_BEGIN), re.compile(rb"\n" + _BEGIN)
_JSON = re.compile(
    rb'(?:(?:ULG6|JSON)\s+)?\[\s*\{\s*"(?:version|type)"\s*:\s*"(?:header"|[\w.-]{1,40}"\s*\})')


def detects(head: bytes) -> bool:
    """True if the content begins like a game log of rcssserver, text, JSON or binary."""
    return re.match(rb"ULG[\x01-\x0f0-9]", head) is not None or _JSON.match(head) is not None


def read(source: SourceFile, mapping: TrackingMap) -> MatchLog:
    """Match of a RoboCup 2D log, text or JSON; the left team is home.

    The log has one sample per cycle. While play is stopped the cycle number repeats, and time goes on
    by one cycle per line. Where lines are missing time goes on by the cycles that are missing. Several logs
    in one file are several matches.

    Raises:
        BadRecording: if it is not a log of version 4 or later, has no whole show line, or fewer matches.
    """
    name = source.name
    # a recorder that was killed may leave a file that was filled up with zeros beforehand
    whole = source.content.rstrip(b"\0")
    logs = _logs(whole)
    if not logs:
        binary = source.content.startswith(b"ULG")
        raise BadRecording(
            "is a binary log of version 1 to 3" if binary else "does not begin with ULG4, ULG5 or ULG6",
            where=name,
            next_step="Convert it to version 4 or later with rcgconvert" if binary else "Give an .rcg log",
        )
    if source.number > len(logs):
        raise BadRecording(f"has no match number {source.number}: it has {len(logs)}", where=name,
                           next_step="Ask for one that it has")
    version, text = logs[source.number - 1]
    last, in_json = source.number == len(logs), re.match(rb"\s*[\[{]", text) is not None
    record = scan_lines(text_lines(text, name).encode() if in_json else text)
    if not record.numbers:
        raise BadRecording("has no whole show line", where=name, next_step="Record or copy it again")
    players = players_of(record)
    frames = shown_frames(record, players)
    events, over = events_of(record, frames.t_ns, source)
    ends = text.rstrip().endswith(b"]") if in_json else not record.last_bad or text.endswith(b"\n")
    cut = not ends or (last and len(whole) < len(source.content))
    flaws, reason = _damage(record, frames.t_ns, source.damage if last else None, cut=cut)
    more: dict[str, object] = {}
    if len(logs) > 1:
        more = {"match": {"number": source.number, "of": len(logs)}}
        flaws.append(Flaw("several matches", (
            f"the recording has {len(logs)} matches one after the other, this is number {source.number}: an "
            "import makes each a match of its own"), len(logs)))
    if stamina := stamina_of(record, frames.t_ns):
        more["told"] = {Stamina.NAME: stamina}
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
        started_at=_started(text) if in_json else None,
        settings={"version": "json" if in_json else version, "step_ms": record.server.step_ms, **more},
        software=RELEASE,
        complete=reason is None,
        incomplete_reason=reason,
    )
    return MatchLog(
        info=info, frames=frames, referee=referee(source.match_id, events),
        quality=quality_table(source.match_id, flaws),
        commands=commands_of(record, players, frames.t_ns, source.match_id),
    )


def _logs(content: bytes) -> list[tuple[int, bytes]]:
    """Version and lines of each log with a show line; all if none has one."""
    first = _FIRST.match(content)
    if first is None:
        return []
    begins = [(0, first), *((begin.start() + 1, begin) for begin in _NEXT.finditer(content))]
    logs: list[tuple[int, bytes]] = []
    for i, (at, begin) in enumerate(begins):
        end = begins[i + 1][0] if i + 1 < len(begins) else len(content)
        text = content[at if content[at:at + 1] == b"[" else begin.end():end]
        if not text.strip() and i + 1 < len(begins):
            continue  # the head of a log in JSON, whose array follows
        logs.append((int(begin[1] or 0), text))
    return [log for log in logs if b"show" in log[1]] or logs[:1]


def _started(log: bytes) -> datetime | None:
    """When the server was started, which writes a log from then on; None if a log in JSON does not say it."""
    try:
        return datetime.fromisoformat(timestamp_of(log) or "")
    except ValueError:
        return None


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
