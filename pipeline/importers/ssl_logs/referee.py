"""Referee packets: what the game controller said, where it changed."""

from __future__ import annotations

from collections import Counter
from hashlib import blake2b
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.importers.ssl_logs import fields as f
from pitchlore.pipeline.importers.ssl_logs.container import ORDER, RECEIVED, Batch, UnusableLogError
from pitchlore.pipeline.importers.ssl_logs.game_events import EventLog
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, YELLOW
from pitchlore.pipeline.importers.ssl_logs.wire import Fields, fields, texts
from pitchlore.pipeline.numbers.arrays import I64, U8, Bools

#: Columns of a decoded packet. Those of the teams come twice, from ``_TEAMS`` on; then what is not compared.
_STAGE, _COMMAND, _COUNTER, _SIDE = range(4)
_TEAMS = 4
_SCORE, _RED, _YELLOW, _NAME = range(4)
_OF_A_TEAM = 4
_SOURCE = _TEAMS + 2 * _OF_A_TEAM
_SPANS = _SOURCE + 1
_COLUMNS = _SPANS + 4
#: Game controllers that are heard, and how often each may say something new: a match has a few hundred.
_SOURCES, _CHANGES = 64, 20_000
#: Greatest score that is one.
_MOST = 9_999


class RefereeTeam(NamedTuple):
    """A team as a packet gives it: its name ("" where nobody typed one), its score and its cards."""

    name: str
    score: int
    red_cards: int
    yellow_cards: int


class RefereeReport(NamedTuple):
    """The referee's state from a packet on.

    Attributes:
        order: number of the packet in the file.
        received: when it was received, ns.
        part: log of the file that it is in.
        stage, command: see ``commands``.
        counter: counter of commands; it rises with each.
        blue_on_positive: whether blue's goal is at +x; None where the packet does not say.
        teams: yellow and blue.
        silent: time since the controller's packet before, ns.
    """

    order: int
    received: int
    part: int
    stage: int
    command: int
    counter: int
    blue_on_positive: bool | None
    teams: tuple[RefereeTeam, RefereeTeam]
    silent: int


class RefereeLog:
    """The referee's packets of a log, as they come: only those that say something new are kept.

    Attributes:
        damaged: packets that cannot be decoded.
    """

    def __init__(self) -> None:
        self.damaged = 0
        self._packets: Counter[int] = Counter()
        self._reported: dict[int, list[RefereeReport]] = {}
        self._last: dict[int, I64] = {}
        self._spans: dict[int, tuple[int, int]] = {}
        self._received: dict[int, int] = {}
        self._events: dict[int, EventLog] = {}

    def add(self, batch: Batch) -> None:
        """Take up a batch of referee packets.

        Raises:
            UnusableLogError: if they say something new too often.
        """
        rows, damaged, fields_of = _decode(batch)
        self.damaged += int(damaged.sum())
        sound = ~damaged
        rows, packets = rows[sound], batch.packets[sound]
        for source in np.unique(rows[:, _SOURCE]).tolist():
            if source not in self._reported and len(self._reported) == _SOURCES:
                continue
            mine = rows[:, _SOURCE] == source
            self._packets[source] += int(mine.sum())
            at = packets[mine, ORDER]
            self._spans[source] = self._spans.get(source, (int(at[0]),))[0], int(at[-1])
            self._add(batch, rows[mine], packets[mine], source)
            chosen = np.zeros(len(sound), np.bool_)
            chosen[np.flatnonzero(sound)[mine]] = True
            self._events.setdefault(source, EventLog()).add(batch, fields_of, chosen)

    def reported(self) -> list[RefereeReport]:
        """Messages of one game controller at a time, in the order of the file.

        One that was started anew has another identifier, so those that follow each other are one. Of those
        that send at once the one with the most packets is heard.
        """
        return sorted((report for source in self._heard() for report in self._reported[source]),
                      key=lambda report: report.order)

    def events(self) -> list[EventLog]:
        """Game events of those game controllers."""
        return [self._events[source] for source in self._heard()]

    def packets(self) -> int:
        """Number of sound packets of those game controllers."""
        return sum(self._packets[source] for source in self._heard())

    def unheard(self) -> int:
        """Number of sound packets of the others."""
        return self._packets.total() - self.packets()

    def _heard(self) -> list[int]:
        kept: list[int] = []
        for source, _ in self._packets.most_common():
            first, last = self._spans[source]
            if all(last < self._spans[other][0] or self._spans[other][1] < first for other in kept):
                kept.append(source)
        return kept

    def _add(self, batch: Batch, rows: I64, packets: I64, source: int) -> None:
        before = self._last.get(source, np.full(_COLUMNS, -(1 << 40), np.int64))
        compared = np.vstack((before, rows))[:, :_SOURCE]
        new = np.flatnonzero((compared[1:] != compared[:-1]).any(axis=1))
        self._last[source] = rows[-1]
        received = packets[:, RECEIVED]
        silent = np.diff(received, prepend=self._received.get(source, received[0]))
        self._received[source] = int(received[-1])
        reported = self._reported.setdefault(source, [])
        if len(reported) + len(new) > _CHANGES:
            raise UnusableLogError(f"has a referee who says something else more than {_CHANGES} times")
        for row, packet, quiet in zip(
                rows[new].tolist(), packets[new].tolist(), silent[new].tolist(), strict=True):
            teams = []
            for team in (YELLOW, BLUE):
                first = _TEAMS + team * _OF_A_TEAM
                start, end = row[_SPANS + 2 * team : _SPANS + 2 * team + 2]
                name = batch.data[start:end].tobytes().decode(errors="replace").strip()
                teams.append(RefereeTeam(name, row[first + _SCORE], row[first + _RED], row[first + _YELLOW]))
            side = None if row[_SIDE] < 0 else bool(row[_SIDE])
            reported.append(RefereeReport(
                packet[ORDER], packet[RECEIVED], batch.part, row[_STAGE], row[_COMMAND], row[_COUNTER], side,
                (teams[0], teams[1]), quiet))


def _decode(batch: Batch) -> tuple[I64, Bools, Fields]:
    """The packets, int64 [M, _COLUMNS], which are damaged, bool [M], and all their fields.

    A packet without stage, command or a team is damaged: these are required.
    """
    reported, damaged = fields(batch.data, batch.start, batch.end)
    rows = np.full((len(batch.start), _COLUMNS), -1, np.int64)
    rows[:, _SPANS:] = 0
    rows[:, _SOURCE] = 0
    for column, number in ((_STAGE, f.REFEREE_STAGE), (_COMMAND, f.REFEREE_COMMAND),
                           (_COUNTER, f.REFEREE_COUNTER)):
        of, value = reported.varints(number)
        rows[of, column] = value
    of, value = reported.varints(f.REFEREE_BLUE_ON_POSITIVE)
    rows[of, _SIDE] = np.clip(value, 0, 1)
    source = reported.spans(f.REFEREE_SOURCE)
    rows[source.of, _SOURCE] = _hashed(batch.data, source)
    for team, number in ((YELLOW, f.REFEREE_YELLOW), (BLUE, f.REFEREE_BLUE)):
        _team(batch.data, reported.spans(number), rows, _TEAMS + team * _OF_A_TEAM, _SPANS + 2 * team)
    needed = rows[:, [_STAGE, _COMMAND, _TEAMS + _SCORE, _TEAMS + _OF_A_TEAM + _SCORE]]
    return rows, damaged | ~((needed >= 0) & (needed <= _MOST)).all(axis=1), reported


def _team(data: U8, spans: Fields, rows: I64, first: int, span: int) -> None:
    """Decode a team into the columns of ``rows`` from ``first`` on; from ``span`` on where its name is."""
    reported, damaged = fields(data, spans.value, spans.end)
    reported = reported._replace(of=spans.of[reported.of])
    for column, number in ((_RED, f.TEAM_RED_CARDS), (_YELLOW, f.TEAM_YELLOW_CARDS)):
        rows[spans.of, first + column] = 0
        of, value = reported.varints(number)
        rows[of, first + column] = np.clip(value, 0, _MOST)
    of, value = reported.varints(f.TEAM_SCORE)
    rows[of, first + _SCORE] = value
    rows[spans.of[damaged], first + _SCORE] = -1
    rows[spans.of, first + _NAME] = 0
    name = reported.spans(f.TEAM_NAME)
    rows[name.of, first + _NAME] = _hashed(data, name)
    rows[name.of, span], rows[name.of, span + 1] = name.value, name.end


def _hashed(data: U8, spans: Fields) -> list[int]:
    """A number for each text, equal where texts are."""
    found = texts(data, spans.value, spans.end)
    numbers = {text: int.from_bytes(blake2b(text, digest_size=7).digest()) for text in set(found)}
    return [numbers[text] for text in found]
