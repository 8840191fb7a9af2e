"""The lines of a log, as the server writes them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from pitchlore.pipeline.game.pitch import PITCHES, Kind

#: A number as a C++ stream writes it; the pitch is too small for a positive exponent.
_NUMBER = rb"(-?\d{1,6}(?:\.\d{1,9})?(?:e-\d{1,3})?)"
#: Head of a show line up to its players, the same in versions 4 to 6.
_SHOW = re.compile(
    rb"\(show (\d{1,9})(?: \((?:pm|tm) [^()]*\))* \(\(b\) " + b" ".join([_NUMBER] * 4) + rb"\)"
)
#: Head of a player's group; of the rest (point-to, view, stamina, focus, counters) only counters are read of
#: each line (stamina: see there).
_PLAYER = re.compile(
    rb"\(\(([lr]) (\d{1,2})\) -?\d+ (0x[0-9a-f]{1,8}|\d{1,9}) " + b" ".join([_NUMBER] * 5) + rb" -?[\d.]"
)
#: Places of the table's commands in a player's group of counters ``(c …)``. Versions 4 to 6 begin it with
#: kick, dash, turn, catch, move, turn_neck, change_view, say, tackle, pointto, attentionto.
PLACES = {"kick": 0, "dash": 1, "turn": 2, "catch": 3, "tackle": 8}
#: Counters of a player that are read.
COUNTED = 9
#: Begin of a player's group, found as an empty string, or its counters: the first nine.
_PLAYER_OR_COUNTERS = re.compile(rb"\((?:\([lr] |c (" + b" ".join([rb"\d{1,9}"] * COUNTED) + rb")[ )])")
#: Stands for the counters of a player who has none.
_NO_COUNTERS = b" ".join([b"-1"] * COUNTED)
#: Fewer counters than that: none is read.
_FEWER_COUNTERS = re.compile(rb"\(c (?:\d{1,9} ){0,7}\d{1,9}\)")
_MODE = re.compile(rb"\(playmode (\d{1,9}) ([a-z_]+)\)")
_NAME = rb'(?:"([^"]*)"|([^\s"]+))'
_TEAM = re.compile(rb"\(team (\d{1,9}) " + _NAME + b" " + _NAME + rb" (\d{1,4}) (\d{1,4})[^()]*\)")
_OTHER_LINES = (b"(server_param", b"(player_param", b"(player_type", b"(msg", b"(team_graphic", b"(draw")

_NO_TEAM = "null"
#: Milliseconds from one line that is kept to the next.
_KEPT_MS = 10_000
#: Longest gap, cycles; a larger jump is a new count of cycles.
_LONGEST_GAP = 6000
_LONGEST_STEP_MS = 1000


@dataclass(slots=True)
class Server:
    """Parameters of the server; the defaults are rcssserver's.

    Attributes:
        step_ms: length of a cycle, ms.
        half_cycles: length of a half, cycles; zero or less where there are no halves.
        goal_width: metres.
    """

    step_ms: int = 100
    half_cycles: int = 3000
    goal_width: float = PITCHES[Kind.SIM2D].goal_width


@dataclass(slots=True)
class ParsedLines:
    """Lines of a log, parsed; F complete show lines.

    Attributes:
        server: its parameters.
        numbers: cycle of each show line, [F].
        ticks: cycles since the first show line, those of missing lines included, [F].
        balls: x, y, vx and vy as the server wrote them, [F].
        players: side, number, state, x, y, vx, vy and body angle of each player, as written, [F].
        counters: counters of all players of a show line, in their order, [F].
        marks: index of the next show line, cycle, and a playmode or the goals of left and right.
        names: names of the left and the right team.
        skipped: number of lines that are not of the format.
        last_bad: whether the last line is one of them.
        lost: number of incomplete show lines since the last complete one.
        uncounted: number of groups of counters that are no numbers, in complete lines.
        kept: index and text of the first show line of each ten seconds, for what is read of it besides.
    """

    server: Server = field(default_factory=Server)
    numbers: list[int] = field(default_factory=list)
    ticks: list[int] = field(default_factory=list)
    balls: list[tuple[bytes, ...]] = field(default_factory=list)
    players: list[list[tuple[bytes, ...]]] = field(default_factory=list)
    counters: list[bytes] = field(default_factory=list)
    marks: list[tuple[int, int, str | tuple[int, int]]] = field(default_factory=list)
    names: list[str] = field(default_factory=lambda: [_NO_TEAM, _NO_TEAM])
    skipped: int = 0
    last_bad: bool = False
    lost: int = 0
    uncounted: int = 0
    kept: list[tuple[int, bytes]] = field(default_factory=list)


def scan_lines(text: bytes) -> ParsedLines:
    """Parse line by line; a line that cannot be parsed is counted and skipped."""
    record = ParsedLines()
    for raw in text.split(b"\n"):
        line = raw.strip()
        if not line:
            continue
        record.last_bad = False
        if line.startswith(b"(show "):
            record.last_bad = not _show_line(line, record)
        elif mode := _MODE.fullmatch(line):
            record.marks.append((len(record.numbers), int(mode[1]), mode[2].decode()))
        elif team := _TEAM.fullmatch(line):
            record.marks.append((len(record.numbers), int(team[1]), (int(team[6]), int(team[7]))))
            for side in (0, 1):
                if record.names[side] == _NO_TEAM:
                    name = team[2 * side + 2] or team[2 * side + 3] or _NO_TEAM.encode()
                    record.names[side] = name.decode("utf-8", "replace")
        elif not line.startswith(_OTHER_LINES) or not line.endswith(b")"):
            record.last_bad = True
        elif line.startswith(b"(server_param"):
            record.server = _server(line)
        record.skipped += record.last_bad
    return record


def _show_line(line: bytes, record: ParsedLines) -> bool:
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
    if not record.kept or (tick - record.ticks[record.kept[-1][0]]) * record.server.step_ms >= _KEPT_MS:
        record.kept.append((len(record.ticks), line))
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


def _server(line: bytes) -> Server:
    """Server's parameters that are used here; the default where one is not given."""
    given = {
        key: float(value)
        for key, value in re.findall(
            rb"\((simulator_step|half_time|goal_width) (-?\d{1,7}(?:\.\d{1,9})?)\)", line
        )
    }
    server = Server()
    if 1 <= given.get(b"simulator_step", 0) <= _LONGEST_STEP_MS:
        server.step_ms = int(given[b"simulator_step"])
    if b"half_time" in given:  # seconds; zero or less: no halves
        server.half_cycles = int(given[b"half_time"] * 1000 / server.step_ms)
    if given.get(b"goal_width", 0) > 0:
        server.goal_width = given[b"goal_width"]
    return server
