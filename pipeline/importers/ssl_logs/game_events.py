"""Game events that the controller tells: fouls, balls that left the field, goals, and what was only proposed.

Numbers and words are those of RoboCup-SSL/ssl-game-controller, ``proto/state/ssl_gc_game_event.proto`` and
``proto/state/ssl_gc_referee_message.proto`` at 78a9b3b. The controller repeats an event in each packet until
play goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.base.text import NAME_CHARACTERS, printable
from pitchlore.pipeline.importers.ssl_logs.container import ORDER, RECEIVED, Batch
from pitchlore.pipeline.importers.ssl_logs.home import HomeColour
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, YELLOW
from pitchlore.pipeline.importers.ssl_logs.wire import VARINT, Fields, fields, texts
from pitchlore.pipeline.numbers.arrays import I64, U8, Bools
from pitchlore.schemas import SIDES, Side

_EVENTS, _GROUPS = 16, 17
_GROUP_EVENTS, _GROUP_ACCEPTED = 1, 2
_ORIGIN = 41
_X, _Y = 1, 2
#: An event that is told again after so long is another one, ns; and events of a log at most.
_AGAIN_NS = 10 * 10**9
_MOST = 20_000
_TEXT = 500


class _Kind(NamedTuple):
    """A kind of event: the league's word, and the fields of what is read of it; 0 where it has none."""

    word: str
    robot: int = 0
    place: int = 0
    begin: int = 0
    victim: int = 0
    value: int = 0
    measure: str = ""
    note: int = 0
    team: int = 1
    robot_team: int = 0


def _goal(word: str) -> _Kind:
    return _Kind(word, 2, 3, 4, value=5, measure="max_ball_height", note=9, robot_team=6)


#: Kinds by the field that holds them.
_KINDS = {
    1: _Kind("PREPARED", value=1, measure="time_taken", team=0),
    2: _Kind("NO_PROGRESS_IN_GAME", place=1, value=2, measure="time", team=0),
    3: _Kind("PLACEMENT_FAILED", value=2, measure="remaining_distance"),
    5: _Kind("PLACEMENT_SUCCEEDED", value=2, measure="time_taken"),
    6: _Kind("BALL_LEFT_FIELD_TOUCH_LINE", 2, 3),
    7: _Kind("BALL_LEFT_FIELD_GOAL_LINE", 2, 3),
    8: _goal("GOAL"),
    9: _Kind("INDIRECT_GOAL", 2, 3, 4),
    10: _Kind("CHIPPED_GOAL", 2, 3, 4, value=5, measure="max_ball_height"),
    11: _Kind("AIMLESS_KICK", 2, 3, 4),
    12: _Kind("KICK_TIMEOUT", place=2, value=3, measure="time"),
    13: _Kind("KEEPER_HELD_BALL", place=2, value=3, measure="duration"),
    14: _Kind("ATTACKER_DOUBLE_TOUCHED_BALL", 2, 3),
    15: _Kind("ATTACKER_TOUCHED_BALL_IN_DEFENSE_AREA", 2, 3, value=4, measure="distance"),
    16: _Kind("ATTACKER_TOUCHED_OPPONENT_IN_DEFENSE_AREA", 2, 3, victim=4),
    17: _Kind("BOT_DRIBBLED_BALL_TOO_FAR", 2, 4, 3),
    18: _Kind("BOT_KICKED_BALL_TOO_FAST", 2, 3, value=4, measure="initial_ball_speed"),
    19: _Kind("ATTACKER_TOO_CLOSE_TO_DEFENSE_AREA", 2, 3, value=4, measure="distance"),
    20: _Kind("BOT_INTERFERED_PLACEMENT", 2, 3),
    21: _Kind("BOT_CRASH_DRAWN", place=3, value=4, measure="crash_speed", team=0),
    22: _Kind("BOT_CRASH_UNIQUE", 2, 4, victim=3, value=5, measure="crash_speed"),
    23: _Kind("BOT_CRASH_UNIQUE_SKIPPED", 2, 4, victim=3, value=5, measure="crash_speed"),
    24: _Kind("BOT_PUSHED_BOT", 2, 4, victim=3, value=5, measure="pushed_distance"),
    25: _Kind("BOT_PUSHED_BOT_SKIPPED", 2, 4, victim=3, value=5, measure="pushed_distance"),
    26: _Kind("BOT_HELD_BALL_DELIBERATELY", 2, 3, value=4, measure="duration"),
    27: _Kind("BOT_TIPPED_OVER", 2, 3),
    28: _Kind("BOT_TOO_FAST_IN_STOP", 2, 3, value=4, measure="speed"),
    29: _Kind("DEFENDER_TOO_CLOSE_TO_KICK_POINT", 2, 3, value=4, measure="distance"),
    30: _Kind("DEFENDER_IN_DEFENSE_AREA_PARTIALLY", 2, 3, value=4, measure="distance"),
    31: _Kind("DEFENDER_IN_DEFENSE_AREA", 2, 3, value=4, measure="distance"),
    32: _Kind("MULTIPLE_CARDS"),
    33: _Kind("MULTIPLE_PLACEMENT_FAILURES"),
    34: _Kind("MULTIPLE_FOULS"),
    35: _Kind("UNSPORTING_BEHAVIOR_MINOR", note=2),
    36: _Kind("UNSPORTING_BEHAVIOR_MAJOR", note=2),
    37: _Kind("BOT_SUBSTITUTION"),
    38: _Kind("TOO_MANY_ROBOTS"),
    39: _goal("POSSIBLE_GOAL"),
    42: _Kind("ATTACKER_TOUCHED_OPPONENT_IN_DEFENSE_AREA_SKIPPED", 2, 3, victim=4),
    43: _Kind("BOUNDARY_CROSSING", place=2),
    44: _goal("INVALID_GOAL"),
    45: _Kind("PENALTY_KICK_FAILED", place=2, note=3),
    46: _Kind("CHALLENGE_FLAG"),
    47: _Kind("EMERGENCY_STOP"),
    48: _Kind("CHALLENGE_FLAG_HANDLED"),
    51: _Kind("BOT_DROPPED_PARTS", 2, 3),
    52: _Kind("EXCESSIVE_BOT_SUBSTITUTION"),
}


class _Told(NamedTuple):
    """An event as it was first told: in which packet, its bytes and its state."""

    order: int
    content: bytes
    state: str


class EventLog:
    """Game events of a log, as they come; each once.

    Attributes:
        more: events beyond ``_MOST``, which are not kept.
    """

    def __init__(self) -> None:
        self.more = 0
        self._told: list[_Told] = []
        self._seen: dict[tuple[bytes, str], int] = {}

    def add(self, batch: Batch, reported: Fields, chosen: Bools) -> None:
        """Take up events of the referee packets that are chosen, bool [M], with the fields of all."""
        reported = reported.at(np.flatnonzero(chosen[reported.of] & (reported.number >= _EVENTS)))
        spans = reported.spans(_EVENTS)
        self._take(batch, spans, ["event"] * len(spans.of))
        groups = reported.spans(_GROUPS)
        if not len(groups.of):
            return
        inside, _ = fields(batch.data, groups.value, groups.end)
        accepted = np.zeros(len(groups.of), np.bool_)
        of, value = inside.varints(_GROUP_ACCEPTED)
        accepted[of] = value != 0
        spans = inside.spans(_GROUP_EVENTS)
        states = ["accepted proposal" if accepted[of] else "proposal" for of in spans.of.tolist()]
        self._take(batch, spans._replace(of=groups.of[spans.of]), states)

    def _take(self, batch: Batch, spans: Fields, states: list[str]) -> None:
        contents = texts(batch.data, spans.value, spans.end)
        for packet, content, state in zip(batch.packets[spans.of].tolist(), contents, states, strict=True):
            before = self._seen.get((content, state))
            if before is not None:
                self._seen[content, state] = packet[RECEIVED]
                if packet[RECEIVED] - before < _AGAIN_NS:
                    continue
            if len(self._told) == _MOST:
                self.more += 1
                continue
            self._seen[content, state] = packet[RECEIVED]
            self._told.append(_Told(packet[ORDER], content, state))

    def rows(self, home: HomeColour, t_ns: Callable[[int], int]) -> list[dict[str, object]]:
        """Rows of schema GameEvents without ``match_id``, in order of time; unknown kinds are left out.

        Args:
            home: the colour of home in the course of the match.
            t_ns: time of a message by its number.
        """
        data = np.frombuffer(b"".join(told.content for told in self._told), np.uint8)
        end = np.cumsum([len(told.content) for told in self._told], dtype=np.int64)
        start = end - np.array([len(told.content) for told in self._told], np.int64)
        found, _ = fields(data, start, end)
        origins: list[list[str]] = [[] for _ in self._told]
        spans = found.spans(_ORIGIN)
        for event, text in zip(spans.of.tolist(), texts(data, spans.value, spans.end), strict=True):
            origins[event].append(_text(text))
        rows: list[dict[str, object]] = []
        held = found.spans(*_KINDS)
        inside, _ = fields(data, held.value, held.end)
        parts = np.searchsorted(inside.of, np.arange(len(held.of) + 1))
        for i, (event, number) in enumerate(zip(held.of.tolist(), held.number.tolist(), strict=True)):
            told, kind = self._told[event], _KINDS[number]
            own = inside.at(np.arange(parts[i], parts[i + 1]))
            team = _side(_whole(own, kind.team), home.now(told.order))
            by = _side(_whole(own, kind.robot_team), home.now(told.order)) or team
            robot = _whole(own, kind.robot)
            value = _real(data, own, kind.value)
            place, begin = _place(data, own, kind.place), _place(data, own, kind.begin)
            rows.append({
                "t_ns": t_ns(told.order), "event": kind.word, "state": told.state,
                "source": ", ".join(sorted(origins[event])) or "game controller", "team": team,
                "robot": robot, "robot_team": None if robot is None else by,
                "victim": _whole(own, kind.victim), "x": place[0], "y": place[1],
                "from_x": begin[0], "from_y": begin[1], "measure": None if value is None else kind.measure,
                "value": value, "note": _note(data, own, kind.note),
            })
        return sorted(rows, key=lambda row: (row["t_ns"], row["event"], row["state"]))


def _side(team: int | None, home: int) -> Side | None:
    """Side of a team, which is 1 for yellow and 2 for blue."""
    colour = {1: YELLOW, 2: BLUE}.get(team or 0)
    return None if colour is None else SIDES[int(colour != home)]


def _whole(own: Fields, number: int) -> int | None:
    """A small whole number of an event; None where it is not told."""
    rows = np.flatnonzero((own.number == number) & (own.kind == VARINT)) if number else np.empty(0, np.int64)
    return int(own.value[rows[-1]]) if len(rows) and 0 <= own.value[rows[-1]] < 1 << 15 else None


def _real(data: U8, own: Fields, number: int) -> float | None:
    """A number of an event; None where it is not told."""
    _, values = own.reals(data, number)
    return float(values[-1]) if number and len(values) and np.isfinite(values[-1]) else None


def _place(data: U8, own: Fields, number: int) -> tuple[float | None, float | None]:
    """A place of an event, metres."""
    spans = own.spans(number)
    if not number or not len(spans.of):
        return None, None
    last: I64 = np.array([len(spans.of) - 1])
    inner, _ = fields(data, spans.value[last], spans.end[last])
    return _real(data, inner, _X), _real(data, inner, _Y)


def _note(data: U8, own: Fields, number: int) -> str | None:
    spans = own.spans(number)
    found = texts(data, spans.value, spans.end) if number else []
    return _text(found[-1]) if found else None


def _text(data: bytes) -> str:
    return printable(data[:_TEXT].decode(errors="replace"), NAME_CHARACTERS)
