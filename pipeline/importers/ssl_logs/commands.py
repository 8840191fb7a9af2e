"""The referee's stages and commands, and the events that become of them.

Names and numbers of stages and commands are the league's; for their source see ``fields``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from pitchlore.pipeline.importers.rows import Event
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.ssl_logs.referee import RefereeReport
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, YELLOW
from pitchlore.schemas import SIDES, Side

STAGES = (
    "NORMAL_FIRST_HALF_PRE", "NORMAL_FIRST_HALF", "NORMAL_HALF_TIME", "NORMAL_SECOND_HALF_PRE",
    "NORMAL_SECOND_HALF", "EXTRA_TIME_BREAK", "EXTRA_FIRST_HALF_PRE", "EXTRA_FIRST_HALF", "EXTRA_HALF_TIME",
    "EXTRA_SECOND_HALF_PRE", "EXTRA_SECOND_HALF", "PENALTY_SHOOTOUT_BREAK", "PENALTY_SHOOTOUT", "POST_GAME",
)
#: Half of each stage; a break belongs to the half after it.
_HALVES = (0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4)
_POST_GAME = STAGES.index("POST_GAME")

COMMANDS = (
    "HALT", "STOP", "NORMAL_START", "FORCE_START", "PREPARE_KICKOFF_YELLOW", "PREPARE_KICKOFF_BLUE",
    "PREPARE_PENALTY_YELLOW", "PREPARE_PENALTY_BLUE", "DIRECT_FREE_YELLOW", "DIRECT_FREE_BLUE",
    "INDIRECT_FREE_YELLOW", "INDIRECT_FREE_BLUE", "TIMEOUT_YELLOW", "TIMEOUT_BLUE", "GOAL_YELLOW",
    "GOAL_BLUE", "BALL_PLACEMENT_YELLOW", "BALL_PLACEMENT_BLUE",
)
#: What each kind of command is to us; a word that is not here stops play.
_EVENTS = {"FORCE_START": "play", "NORMAL_START": "play", "DIRECT_FREE": "fault", "INDIRECT_FREE": "fault"}
#: What NORMAL_START begins after a command that prepares it.
_PREPARED = {"PREPARE_KICKOFF": "kick-off", "PREPARE_PENALTY": "fault"}
_STOPPING = {"goal", "half", "end", "stop"}
#: Most cards of a team that are reported at once; a greater rise is damage.
_MOST_CARDS = 11


def command_events(
    reported: Sequence[RefereeReport], home: int, t_ns: Callable[[RefereeReport], int], source: SourceFile
) -> list[Event]:
    """Referee events, in order of time.

    - HALT, STOP, BALL_PLACEMENT, TIMEOUT and GOAL stop play. PREPARE_KICKOFF and PREPARE_PENALTY do, too.
    - NORMAL_START is a kick-off or, for a penalty, a fault, of the team for which it was prepared, else play.
    - DIRECT_FREE and INDIRECT_FREE are faults of the team that takes the kick. FORCE_START is play.
    - A stage of a later half is half; POST_GAME is the end.
    - A rise of a score is a goal, at the time at which play was stopped for it: the game controller stops
      play when the ball is in the goal, and counts when people have agreed. A fall takes the last goal back.
    - A card changes nothing: it repeats play or stop.

    Each note is the league's word.

    Args:
        reported: the referee's states, where they change.
        home: the colour that is home, YELLOW or BLUE.
        t_ns: time of what is reported, ns.
        source: the recording.

    Raises:
        BadRecording: if the score changes by more goals than the limit.
    """
    course = _Course(home)
    goals = 0
    before: RefereeReport | None = None
    for now in reported:
        at = t_ns(now)
        if before is None:
            course.goals = {_side(team, home): now.teams[team].score for team in (YELLOW, BLUE)}
        else:
            goals += sum(abs(new.score - old.score) for new, old in zip(now.teams, before.teams, strict=True))
            if goals > source.limits.goals:
                raise source.too_much(f"a score that changes by {goals} goals", "goals")
        course.hear(at, before, now)
        before = now
    return course.events


@dataclass(slots=True)
class _Course:
    """Events so far.

    Attributes:
        home: the colour that is home.
        goals: score of each side.
        playing: whether play is on.
        prepared: event, side and word of the command that prepares a start.
        stopped: index of the event that stopped play, None if none did.
    """

    home: int
    events: list[Event] = field(default_factory=list)
    goals: dict[Side, int] = field(default_factory=dict)
    playing: bool = False
    prepared: tuple[str, Side | None, str] | None = None
    stopped: int | None = None

    def hear(self, at: int, before: RefereeReport | None, now: RefereeReport) -> None:
        """Append what the referee says anew."""
        ends = now.stage == _POST_GAME and (before is None or before.stage != _POST_GAME)
        halves = before is not None and _half(now) > _half(before)
        if ends or halves:
            self._emit(at, "end" if ends else "half", None, _word(STAGES, now.stage))
        if before is None or (before.command, before.counter) != (now.command, now.counter):
            self._command(at, _word(COMMANDS, now.command), silent=ends or halves)
        if before is None:
            return
        for team, colour in ((YELLOW, "yellow"), (BLUE, "blue")):
            old, new, side = before.teams[team], now.teams[team], _side(team, self.home)
            for _ in range(new.score - old.score):
                self._goal(at, side, f"score of {colour}")
            for _ in range(old.score - new.score):
                self._take_back(at, side)
            cards = ["yellow card"] * (new.yellow_cards - old.yellow_cards) + ["red card"] * (
                new.red_cards - old.red_cards)
            for card in cards[:_MOST_CARDS]:
                self._emit(at, "play" if self.playing else "stop", None, f"{card} for {colour}")

    def _command(self, at: int, word: str, *, silent: bool) -> None:
        base, side = word, None
        for team, suffix in ((YELLOW, "_YELLOW"), (BLUE, "_BLUE")):
            if word.endswith(suffix):
                base, side = word.removesuffix(suffix), _side(team, self.home)
        prepared, self.prepared = self.prepared, None
        event = _EVENTS.get(base, "stop")
        if base in _PREPARED:
            self.prepared = (_PREPARED[base], side, word)
            silent = silent or not self.playing
        elif base == "NORMAL_START" and prepared is not None:
            event, side, word = prepared
        if event == "stop" and silent:
            return
        self._emit(at, event, side if event in ("kick-off", "fault") else None, word)

    def _emit(self, at: int, event: str, team: Side | None, note: str) -> None:
        if event in _STOPPING and self.playing:
            self.stopped = len(self.events)
        if event not in _STOPPING:
            self.stopped = None
        self.playing = event not in _STOPPING
        self.events.append(Event(at, event, team, self.goals["home"], self.goals["away"], note))

    def _goal(self, at: int, side: Side, note: str) -> None:
        if self.stopped is None or self.events[self.stopped].event != "stop":
            self._emit(at, "stop", None, note)
            first = len(self.events) - 1
        else:
            first = self.stopped
        self.events[first] = replace(self.events[first], event="goal", team=side, note=note)
        self._count(first, side, 1)

    def _take_back(self, at: int, side: Side) -> None:
        goals = [i for i, event in enumerate(self.events) if event.event == "goal" and event.team == side]
        if goals:
            first = goals[-1]
            self.events[first] = replace(self.events[first], event="stop", team=None, note="goal taken back")
        else:
            self._emit(at, "play" if self.playing else "stop", None, "score taken back")
            first = len(self.events) - 1
        self._count(first, side, -1)

    def _count(self, first: int, side: Side, step: int) -> None:
        """Change a side's score, from an event on."""
        self.goals[side] += step
        column = f"score_{side}"
        for i in range(first, len(self.events)):
            score = getattr(self.events[i], column)
            self.events[i] = replace(self.events[i], **{column: max(score + step, 0)})


def _side(team: int, home: int) -> Side:
    return SIDES[int(team != home)]


def _half(reported: RefereeReport) -> int:
    return _HALVES[min(reported.stage, len(_HALVES) - 1)]


def _word(words: tuple[str, ...], number: int) -> str:
    return words[number] if number < len(words) else f"number {number}"
