"""RoboCup 2D text logs (rcssserver's ULG4, ULG5 and ULG6).

The grammar is that of rcssserver's ``serializermonitor.cpp``. The server's axes have y down and
angles in degrees clockwise, and its velocities are metres a cycle; here y is up, angles are
radians counter-clockwise and velocities metres a second. The left team attacks +x throughout:
rcssserver never changes sides, not even at half-time (``Stadium::callHalfTime``).

The server carries out a player's command and counts it at once (``player.cpp``), then moves all bodies, then
writes the show line (``Stadium::step``). So the line that first counts a kick has the ball's new velocity.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import chain
from typing import NamedTuple

import numpy as np
import polars as pl

from pipeline import __version__
from pipeline.arrays import F64, I64, Bools
from pipeline.errors import BadRecording
from pipeline.importers.rows import Event, pack, referee
from pipeline.importers.source import SourceFile
from pipeline.importers.tracking.mapping import TrackingMap
from pipeline.matches.frame import Frames, MatchInfo, MatchLog, Period, wrap
from pipeline.matches.quality import Flaw, quality_table
from pipeline.pitch import PITCHES, Kind
from schemas import SIDES, Commands, Side
from schemas.commands import COMMANDS

#: A number as a C++ stream writes it; the pitch is too small for a positive exponent.
_NUMBER = rb"(-?\d{1,6}(?:\.\d{1,9})?(?:e-\d{1,3})?)"
#: Head of a show line up to its players, the same in versions 4 to 6.
_SHOW = re.compile(
    rb"\(show (\d{1,9})(?: \((?:pm|tm) [^()]*\))* \(\(b\) " + b" ".join([_NUMBER] * 4) + rb"\)"
)
#: Head of a player's group; of the rest (point-to, view, stamina, focus, counters) only counters are read.
_PLAYER = re.compile(
    rb"\(\(([lr]) (\d{1,2})\) -?\d+ (0x[0-9a-f]{1,8}|\d{1,9}) " + b" ".join([_NUMBER] * 5) + rb" -?[\d.]"
)
#: Places of the table's commands in a player's group of counters ``(c …)``. Versions 4 to 6 begin it with
#: kick, dash, turn, catch, move, turn_neck, change_view, say, tackle, pointto, attentionto.
_PLACES = {"kick": 0, "dash": 1, "turn": 2, "catch": 3, "tackle": 8}
_COUNTED = 9
#: Begin of a player's group, found as an empty string, or its counters: the first nine.
_PLAYER_OR_COUNTERS = re.compile(rb"\((?:\([lr] |c (" + b" ".join([rb"\d{1,9}"] * _COUNTED) + rb")[ )])")
#: Stands for the counters of a player who has none.
_NO_COUNTERS = b" ".join([b"-1"] * _COUNTED)
#: Fewer counters than that: none is read.
_FEWER_COUNTERS = re.compile(rb"\(c (?:\d{1,9} ){0,7}\d{1,9}\)")
_MODE = re.compile(rb"\(playmode (\d{1,9}) ([a-z_]+)\)")
_TEAM = re.compile(rb"\(team (\d{1,9}) (\S+) (\S+) (\d{1,4}) (\d{1,4})[^()]*\)")
_OTHER_LINES = (b"(server_param", b"(player_param", b"(player_type", b"(msg", b"(team_graphic", b"(draw")

#: Playmodes in which the named team brings the ball back into play.
_RESTARTS = {
    "kick_in", "free_kick", "indirect_free_kick", "corner_kick", "goal_kick", "penalty_kick", "drop_ball",
}
#: Playmodes between halves; the first of them at or after the half's last cycle is half-time.
_BREAKS = {"before_kick_off", "first_half_over", "half_time", "kick_off"}
#: Bit of a player's state: it is on the pitch.
_STANDS = 0x1
_NO_TEAM = "null"
#: Longest gap, cycles; a larger jump is a new count of cycles.
_LONGEST_GAP = 6000
_LONGEST_STEP_MS = 1000


@dataclass(slots=True)
class _Server:
    """Parameters of the server; the defaults are rcssserver's."""

    step_ms: int = 100
    half_cycles: int = 3000
    goal_width: float = PITCHES[Kind.SIM2D].goal_width


@dataclass(slots=True)
class _Record:
    """Lines of a log, parsed."""

    server: _Server = field(default_factory=_Server)
    numbers: list[int] = field(default_factory=list)
    ticks: list[int] = field(default_factory=list)
    balls: list[tuple[bytes, ...]] = field(default_factory=list)
    players: list[list[tuple[bytes, ...]]] = field(default_factory=list)
    #: of each show line: its players' counters, in the order of its players
    counters: list[bytes] = field(default_factory=list)
    #: (index of the next frame, cycle, playmode or score)
    marks: list[tuple[int, int, str | tuple[int, int]]] = field(default_factory=list)
    names: list[str] = field(default_factory=lambda: [_NO_TEAM, _NO_TEAM])
    skipped: int = 0
    last_bad: bool = False
    #: incomplete show lines since the last complete one
    lost: int = 0
    #: groups of counters that are no numbers, in complete lines
    uncounted: int = 0


def tells(head: bytes) -> bool:
    """Whether the content begins like a game log of rcssserver, text or binary."""
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
    record = _scan(whole[version.end() :])
    if not record.numbers:
        raise BadRecording("has no whole show line", where=name, next_step="Record or copy it again")
    players = _players(record)
    frames = _frames(record, players)
    events, over = _events(record, frames.t_ns, source)
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
        software=f"pitchlore {__version__}",
        complete=reason is None,
        incomplete_reason=reason,
    )
    return MatchLog(
        info=info, frames=frames, referee=referee(source.match_id, events),
        quality=quality_table(source.match_id, flaws),
        commands=_commands(record, players, frames.t_ns, source.match_id),
    )


def _scan(text: bytes) -> _Record:
    """Parse line by line; a line that cannot be parsed is counted and skipped."""
    record = _Record()
    for raw in text.split(b"\n"):
        line = raw.strip()
        if not line:
            continue
        record.last_bad = False
        if line.startswith(b"(show "):
            record.last_bad = not _scan_show(line, record)
        elif mode := _MODE.fullmatch(line):
            record.marks.append((len(record.numbers), int(mode[1]), mode[2].decode()))
        elif team := _TEAM.fullmatch(line):
            record.marks.append((len(record.numbers), int(team[1]), (int(team[4]), int(team[5]))))
            for side in (0, 1):
                if record.names[side] == _NO_TEAM:
                    record.names[side] = team[side + 2].decode("utf-8", "replace")
        elif not line.startswith(_OTHER_LINES) or not line.endswith(b")"):
            record.last_bad = True
        elif line.startswith(b"(server_param"):
            record.server = _server(line)
        record.skipped += record.last_bad
    return record


def _scan_show(line: bytes, record: _Record) -> bool:
    """Append a show line to the record; False if the line is incomplete."""
    head = _SHOW.match(line)
    players = [] if head is None else _PLAYER.findall(line, head.end())
    found = [] if head is None else _PLAYER_OR_COUNTERS.findall(line, head.end())
    begins = [b""] * len(players)
    if head is None or line.count(b"(") != line.count(b")") or found.count(b"") != len(players):
        record.lost += 1
        return False
    counters = found[1::2]
    if found[::2] != begins or len(counters) < len(players) or b"" in counters:
        # not one group of counters for each player
        counters = _each(found)
        sound = len(found) - len(players) + len(_FEWER_COUNTERS.findall(line))
        record.uncounted += line.count(b"(c ") - sound
    cycle = int(head[1])
    tick = 0
    if record.ticks:
        gap = cycle - record.numbers[-1]
        tick = record.ticks[-1] + max(gap if gap <= _LONGEST_GAP else 1, 1 + record.lost)
    record.lost = 0
    record.numbers.append(cycle)
    record.ticks.append(tick)
    record.balls.append(head.groups()[1:])
    record.players.append(players)
    record.counters.append(b" ".join(counters))
    return True


def _each(found: list[bytes]) -> list[bytes]:
    """Counters of each player; the last ones of a player with several."""
    counters: list[bytes] = []
    for text in found:
        if not text:
            counters.append(_NO_COUNTERS)
        elif counters:
            counters[-1] = text
    return counters


def _server(line: bytes) -> _Server:
    """Server's parameters that are used here; the default where one is not given."""
    given = {
        key: float(value)
        for key, value in re.findall(
            rb"\((simulator_step|half_time|goal_width) (-?\d{1,7}(?:\.\d{1,9})?)\)", line
        )
    }
    server = _Server()
    if 1 <= given.get(b"simulator_step", 0) <= _LONGEST_STEP_MS:
        server.step_ms = int(given[b"simulator_step"])
    if b"half_time" in given:  # seconds; zero or less: no halves
        server.half_cycles = int(given[b"half_time"] * 1000 / server.step_ms)
    if given.get(b"goal_width", 0) > 0:
        server.goal_width = given[b"goal_width"]
    return server


class _Players(NamedTuple):
    """The players of all show lines, one after another.

    Attributes:
        line: int64 [R], index of the show line.
        right: whether the player is of the right team, bool [R].
        number: int64 [R].
        there: whether the player is on the pitch, bool [R].
        body: x, y, vx, vy and body angle as the server wrote them, [5][R].
    """

    line: I64
    right: Bools
    number: I64
    there: Bools
    body: list[tuple[bytes, ...]]


def _players(record: _Record) -> _Players:
    counts = np.array([len(players) for players in record.players], dtype=np.int64)
    fields = list(zip(*chain.from_iterable(record.players), strict=True)) or [()] * 8
    state = np.array([int(text, 16 if b"x" in text else 10) for text in fields[2]], dtype=np.int64)
    return _Players(
        line=np.repeat(np.arange(len(counts), dtype=np.int64), counts),
        right=np.array(fields[0], dtype="S1") == b"r",
        number=np.array(fields[1], dtype="S2").astype(np.int64),
        there=(state & _STANDS) != 0,
        body=fields[3:8],
    )


def _frames(record: _Record, players: _Players) -> Frames:
    """Samples in our axes and units."""
    per_second = 1000 / record.server.step_ms
    t_ns = np.array(record.ticks, dtype=np.int64) * (record.server.step_ms * 1_000_000)
    ball = np.array(record.balls, dtype="S").astype(np.float64)
    there = players.there
    x, y, vx, vy, body = (_floats(column)[there] for column in players.body)
    return pack(
        np.array(record.numbers, dtype=np.uint32),
        t_ns,
        {
            "x": ball[:, 0], "y": 0 - ball[:, 1],
            "vx": ball[:, 2] * per_second, "vy": 0 - ball[:, 3] * per_second,
        },
        players.line[there],
        {
            "team": players.right.astype(np.uint8)[there],
            "id": players.number.astype(np.uint16)[there],
            "x": x, "y": 0 - y, "vx": vx * per_second, "vy": 0 - vy * per_second,
            "theta": wrap(-np.radians(body)),
        },
    )


def _floats(column: tuple[bytes, ...]) -> F64:
    return np.array(column, dtype="S").astype(np.float64)


def _commands(record: _Record, players: _Players, t_ns: I64, match_id: str) -> pl.DataFrame:
    """Rows of schema Commands: where a player's counters are greater than in the player's line before.

    A player's first line gives no row, because the log did not see what it counts. A line in which one of
    the player's counters is less than before gives none either: the server counts anew. A player who is not
    on the pitch gives none.
    """
    if not len(players.line):
        return Commands.empty()
    counts = np.fromstring(b" ".join(record.counters), dtype=np.int64, sep=" ").reshape(-1, _COUNTED)
    robot = players.number + 100 * players.right
    order = np.argsort(robot * len(t_ns) + players.line, kind="stable")
    order = order[counts[order, 0] >= 0]
    if not len(order):
        return Commands.empty()
    line, robot = players.line[order], robot[order]
    rises = np.diff(np.ascontiguousarray(counts[order].T))  # [_COUNTED, R - 1]
    known = (np.diff(robot) == 0) & (rises.min(axis=0) >= 0) & players.there[order][1:]
    rises = np.ascontiguousarray((rises[[_PLACES[name] for name in COMMANDS]] * known).T)
    row, place = np.nonzero(rises)
    dtypes = Commands.dtypes()
    table = pl.DataFrame({
        "team": pl.Series(robot[row + 1] // 100, dtype=pl.UInt8).cat.to(dtypes["team"]),
        "robot": robot[row + 1] % 100,
        "t_ns": t_ns[line[row + 1]],
        "command": pl.Series(place, dtype=pl.UInt8).cat.to(dtypes["command"]),
        "count": rises[row, place],
    })
    return Commands.validate(table.select(pl.lit(match_id).alias("match_id"), pl.all()), cast=True)


def _events(record: _Record, t_ns: I64, source: SourceFile) -> tuple[list[Event], bool]:
    """Referee events, and whether the log reaches time over.

    Raises:
        BadRecording: if it has more goals than the limit.
    """
    events: list[Event] = []
    told_goals = 0
    score = _score_at_start(record)
    half_cycles = record.server.half_cycles
    half = record.numbers[0] // half_cycles + 1 if half_cycles > 0 else 1
    told: set[tuple[int, Side]] = set()
    over = False

    def emit(index: int, event: str, note: str, team: Side | None = None) -> None:
        at = int(t_ns[min(index, len(t_ns) - 1)])
        events.append(Event(at, event, team, score["home"], score["away"], note))

    def count(goals: int) -> None:
        nonlocal told_goals
        told_goals += abs(goals)
        if told_goals > source.limits.goals:
            raise source.too_much(f"{told_goals} goals", "goals")

    for index, cycle, mark in record.marks:
        if isinstance(mark, tuple):
            for team, goals in zip(SIDES, mark, strict=True):
                before = score[team] or 0
                count(goals - before)
                for made in range(before + 1, goals + 1):  # a rise without a playmode
                    score[team] = made
                    told.add((index, team))
                    emit(index, "goal", "team", team)
                score[team] = goals
            continue
        mode, side = _split(mark)
        if mode in _BREAKS and 0 < half * half_cycles <= cycle:
            half += 1
            emit(index, "half", mark)
            if mode != "kick_off":
                continue
        if mode == "goal" and side is not None:
            if (index, side) not in told:
                count(1)
                known = score[side]
                score[side] = None if known is None else known + 1
                emit(index, "goal", mark, side)
        elif mode == "kick_off":
            emit(index, "kick-off", mark, side)
        elif mode == "play_on":
            emit(index, "play", mark)
        elif mode in _RESTARTS:
            emit(index, "fault", mark, side)
        elif mode == "time_over":
            over = True
            emit(index, "end", mark)
        else:
            # pauses, offences (a restart of the other team follows) and the penalty shoot-out
            emit(index, "stop", mark)
    return events, over


def _score_at_start(record: _Record) -> dict[Side, int | None]:
    """The score at which the log begins: the first that it tells, without the goals that it has until then.

    A log that tells none has 0 : 0 if it begins with the match; else nobody knows.
    """
    first = next(((index, mark) for index, _, mark in record.marks if isinstance(mark, tuple)), None)
    if first is None:
        usual = 0 if record.numbers[0] <= 1 else None
        return {"home": usual, "away": usual}
    at, goals = first
    made = [_split(mark) for index, _, mark in record.marks if isinstance(mark, str) and index <= at]
    return {team: max(told - made.count(("goal", team)), 0) for team, told in zip(SIDES, goals, strict=True)}


def _split(mode: str) -> tuple[str, Side | None]:
    """Playmode without its side, and the side."""
    if mode.endswith("_l"):
        return mode[:-2], "home"
    if mode.endswith("_r"):
        return mode[:-2], "away"
    return mode, None


def _damage(
    record: _Record, t_ns: I64, gzip_damage: str | None, *, cut: bool
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
