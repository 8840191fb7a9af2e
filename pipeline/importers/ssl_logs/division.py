"""Matches of a log: where one ends and the next begins.

A recorder that nobody stops takes in what comes after a match: the controller is reset for the next one,
names are cleared or typed anew, and perhaps it is played. Facts of a match are those up to its end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from pitchlore.pipeline.importers.ssl_logs.referee import RefereeReport
from pitchlore.pipeline.importers.ssl_logs.stages import FIRST_HALF, POST_GAME, is_running
from pitchlore.pipeline.importers.ssl_logs.survey import LogExtent

#: A further log in the file is of the same match if it begins at most this long after the one before, ns.
_GOES_ON_NS = 30 * 60 * 10**9
#: Two new names at once, or a cleared score, are another match if the controller was silent for so long, ns.
_SILENT_NS = 10 * 10**9
_ANOTHER = "the file has another log of another time"
_RESET = "the game controller was reset"


class Stretch(NamedTuple):
    """Part of a log that is of one match, or of none.

    Attributes:
        first, end: numbers of its first message and of the one after its last.
        reported: the referee's messages in it.
        why: reason why it begins; "" at the begin of the file.
    """

    first: int
    end: int
    reported: list[RefereeReport]
    why: str = ""

    @property
    def played(self) -> bool:
        """True if play was on at some time, if nobody says so, or if it is a log of its own."""
        return self.why == _ANOTHER or not self.reported or any(
            is_running(now) or FIRST_HALF <= now.stage < POST_GAME for now in self.reported)


def divide(reported: Sequence[RefereeReport], parts: Sequence[LogExtent]) -> list[Stretch]:
    """The stretches of a log, in its order.

    Args:
        reported: the referee's messages in the whole file.
        parts: the logs of the file.
    """
    cuts = {part.order: _ANOTHER for part in _others(reported, parts)}
    state, last = _Match(), -1
    for now in reported:
        if any(last < cut <= now.order for cut in cuts):
            state = _Match()
        why = state.ended_by(now)
        if why is not None:
            cuts[state.begins(now)] = why
            state = _Match()
        state.hear(now)
        last = now.order
    edges = [*sorted({0, *cuts}), sum(part.messages for part in parts)]
    return [Stretch(first, end, [now for now in reported if first <= now.order < end], cuts.get(first, ""))
            for first, end in pairwise(edges) if first < end]


def _others(reported: Sequence[RefereeReport], parts: Sequence[LogExtent]) -> list[LogExtent]:
    """The logs of the file, but the first, that do not go on with what is before them."""
    found = []
    there = [part for part in parts if part.messages]
    for before, part in pairwise(there):
        gap = part.first - before.last
        if 0 <= gap <= _GOES_ON_NS:
            continue
        old = [now for now in reported if now.order < part.order][-1:]
        new = [now for now in reported if now.order >= part.order][:1]
        if gap < 0 or not old or not new or not _goes_on(old[0], new[0]):
            found.append(part)
    return found


def _goes_on(before: RefereeReport, now: RefereeReport) -> bool:
    """True if a match goes on after a long break: the same two teams, no earlier stage and no lower score."""
    names = _named(now)
    later = before.stage <= now.stage and before.stage != POST_GAME
    return len(names) == 2 and names == _named(before) and later and _goals(before) <= _goals(now)


def _goals(reported: RefereeReport) -> int:
    return sum(team.score for team in reported.teams)


def _named(reported: RefereeReport) -> frozenset[str]:
    return frozenset(team.name for team in reported.teams if team.name)


@dataclass(slots=True)
class _Match:
    """State of a match so far.

    Attributes:
        names: names of its teams.
        furthest: its latest stage.
        before: the last that the referee said.
        cleared: number of the message that first takes goals down after the end, and the goals before it.
    """

    names: frozenset[str] = frozenset()
    furthest: int = 0
    before: RefereeReport | None = None
    cleared: tuple[int, int] | None = None

    def hear(self, now: RefereeReport) -> None:
        """Take up what the referee says."""
        named = _named(now)
        if len(named) >= len(self.names):
            self.names = named
        self.cleared = self._cleared(now)
        self.furthest = max(self.furthest, now.stage)
        self.before = now

    def _cleared(self, now: RefereeReport) -> tuple[int, int] | None:
        if self.before is None or not self.before.stage == now.stage == POST_GAME:
            return None
        goals, had = _goals(now), _goals(self.before)
        if goals < had and self.cleared is None:
            return now.order, had
        return self.cleared if goals <= had else None

    def begins(self, now: RefereeReport) -> int:
        """Number of the message with which the next match begins, if one shows that this is over."""
        cleared = self.cleared or self._cleared(now)
        return now.order if cleared is None or _goals(now) else cleared[0]

    def ended_by(self, now: RefereeReport) -> str | None:
        """Why the match is over before a message, None if it goes on.

        After POST_GAME it is over if the score is cleared or another team is named; a stage that comes back
        with names and score means that the end was taken back. Before, it is over if the controller begins
        anew: a first half without goals after a later one, after goals, or with other names or none.
        """
        if self.before is None:
            return None
        named, goals, had = _named(now), _goals(now), _goals(self.before)
        cleared = bool(self.names) and not named
        others = bool(self.names) and len(named) == 2 and not named & self.names
        anew = now.stage <= FIRST_HALF
        if self.before.stage == POST_GAME:
            if self.names and named - self.names:
                return "the game controller names another team"
            taken = self.cleared or self._cleared(now) or (0, 0)
            if not goals and (max(had, taken[1]) > 1 or cleared or (anew and now.stage != POST_GAME)):
                return _RESET
            return None
        fell = now.stage < self.before.stage
        silent = now.silent >= _SILENT_NS
        if fell and anew and ((not goals and (had or self.furthest > FIRST_HALF)) or cleared or others):
            return _RESET
        if others and (fell or silent):
            return "the game controller names two other teams"
        return "the score was cleared meanwhile" if silent and anew and had and not goals else None
