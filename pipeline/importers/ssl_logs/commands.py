"""Events of a match by the referee's stages, commands and scores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from pitchlore.pipeline.importers.rows import Event
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.ssl_logs.home import HomeColour
from pitchlore.pipeline.importers.ssl_logs.referee import RefereeReport, RefereeTeam
from pitchlore.pipeline.importers.ssl_logs.stages import (
    COMMANDS,
    POST_GAME,
    SHOOT_OUT,
    STAGES,
    half_of,
    league_word,
)
from pitchlore.pipeline.importers.ssl_logs.vision import BLUE, YELLOW
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.schemas import SIDES, Side

#: What each kind of command is to us; a word that is not here stops play.
_EVENTS = {"FORCE_START": "play", "NORMAL_START": "play", "DIRECT_FREE": "fault", "INDIRECT_FREE": "fault"}
#: What NORMAL_START begins after a command that prepares it.
_PREPARED = {"PREPARE_KICKOFF": "kick-off", "PREPARE_PENALTY": "fault"}
_STOPPING = {"goal", "half", "end", "stop"}
_COLOURS = ("yellow", "blue")
#: Goals that are counted at once at most; if a packet was lost there are two.
_MOST_GOALS = 2
#: Most cards of a team that are reported at once; a greater rise is damage.
_MOST_CARDS = 11


class RefereedCourse(NamedTuple):
    """Course of a match by the referee.

    Attributes:
        events: in order of time.
        flaws: corrections of the score by people.
        shoot_out: goals of home and away in a shoot-out; None without one.
    """

    events: list[Event]
    flaws: list[Flaw]
    shoot_out: tuple[int, int] | None


def command_events(
    reported: Sequence[RefereeReport], home: HomeColour, t_ns: Callable[[RefereeReport], int],
    source: SourceFile,
) -> RefereedCourse:
    """Referee events of a match.

    - HALT, STOP, BALL_PLACEMENT, TIMEOUT and GOAL stop play. PREPARE_KICKOFF and PREPARE_PENALTY do, too.
    - NORMAL_START is a kick-off or, for a penalty, a fault, of the team for which it was prepared, else play.
    - DIRECT_FREE and INDIRECT_FREE are faults of the team that takes the kick. FORCE_START is play.
    - A stage of a later half is half; POST_GAME is the end, unless it is taken back: then it is a stop.
    - A rise of a score is a goal, at the time at which play was stopped for it: the game controller stops
      play when the ball is in the goal, and counts when people have agreed. A fall takes the last goal back.
      A rise by more than two at once was set by people, for a forfeit for example, and is no goal.
    - In the shoot-out play is stopped, as in 2D; its goals are stops and count by themselves.
    - A card changes nothing: it repeats play or stop.

    Each note is the league's word.

    Args:
        reported: the referee's states, where they change.
        home: the colour of home in the course of the match.
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
            course.goals = {side: course.team(now, side).score for side in SIDES}
        else:
            scores = ((course.team(now, side).score, course.team(before, side).score) for side in SIDES)
            goals += sum(abs(new - old) for new, old in scores)
            if goals > source.limits.goals:
                raise source.too_much(f"a score that changes by {goals} goals", "goals")
        course.hear(at, before, now)
        before = now
    shot = (course.shots["home"], course.shots["away"])
    return RefereedCourse(course.events, course.flaws, shot if any(shot) else None)


@dataclass(slots=True)
class _Course:
    """Events so far.

    Attributes:
        home: the colour of home in the course of the match.
        goals: score of each side.
        shots: goals of each side in the shoot-out.
        set_by_people: goals of each side that were set at once, which are taken back first.
        shooting: whether the shoot-out has begun.
        half: the latest half.
        playing: whether play is on.
        prepared: event, side and word of the command that prepares a start.
        stopped: index of the event that stopped play, None if none did.
    """

    home: HomeColour
    events: list[Event] = field(default_factory=list)
    flaws: list[Flaw] = field(default_factory=list)
    goals: dict[Side, int] = field(default_factory=dict)
    shots: dict[Side, int] = field(default_factory=lambda: dict.fromkeys(SIDES, 0))
    set_by_people: dict[Side, int] = field(default_factory=lambda: dict.fromkeys(SIDES, 0))
    shooting: bool = False
    half: int = 0
    playing: bool = False
    prepared: tuple[str, Side | None, str] | None = None
    stopped: int | None = None

    def team(self, reported: RefereeReport, side: Side) -> RefereeTeam:
        """The team of a side in a message."""
        return reported.teams[self._colour(reported, side)]

    def _colour(self, reported: RefereeReport, side: Side) -> int:
        home = self.home.now(reported.order)
        return home if side == "home" else 1 - home

    def hear(self, at: int, before: RefereeReport | None, now: RefereeReport) -> None:
        """Append what the referee says anew."""
        ends = now.stage == POST_GAME and (before is None or before.stage != POST_GAME)
        if before is not None and before.stage == POST_GAME != now.stage:
            self._take_end_back()
        halves = before is not None and half_of(now) > self.half and now.stage != POST_GAME
        if now.stage != POST_GAME:
            self.half = max(self.half, half_of(now))
        if ends or halves:
            self._emit(at, "end" if ends else "half", None, league_word(STAGES, now.stage))
        if before is None or (before.command, before.counter) != (now.command, now.counter):
            self._command(at, now, silent=ends or halves)
        if before is not None:
            self._compare(at, before, now)
        self.shooting = self.shooting or now.stage == SHOOT_OUT

    def _compare(self, at: int, before: RefereeReport, now: RefereeReport) -> None:
        """Append what has changed of the teams."""
        for side in sorted(SIDES, key=lambda side: self._colour(now, side)):
            old, new = self.team(before, side), self.team(now, side)
            colour = _COLOURS[self._colour(now, side)]
            if self.shooting:
                self._shoot(at, side, new.score - old.score, colour)
            elif new.score - old.score > _MOST_GOALS:
                self._set(at, side, old.score, new.score, colour)
            else:
                for _ in range(new.score - old.score):
                    self._goal(at, side, f"score of {colour}")
                for _ in range(old.score - new.score):
                    self._take_back(at, side, colour)
            cards = ["yellow card"] * (new.yellow_cards - old.yellow_cards) + ["red card"] * (
                new.red_cards - old.red_cards)
            for card in cards[:_MOST_CARDS]:
                self._emit(at, self._goes_on(), None, f"{card} for {colour}")

    def _goes_on(self) -> str:
        return "play" if self.playing else "stop"

    def _command(self, at: int, now: RefereeReport, *, silent: bool) -> None:
        word = league_word(COMMANDS, now.command)
        base, side = word, None
        for team, suffix in ((YELLOW, "_YELLOW"), (BLUE, "_BLUE")):
            if word.endswith(suffix):
                base, side = word.removesuffix(suffix), SIDES[int(team != self.home.now(now.order))]
        prepared, self.prepared = self.prepared, None
        if now.stage == SHOOT_OUT:
            self._emit(at, "stop", None, f"shoot-out: {word}")
            return
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

    def _take_back(self, at: int, side: Side, colour: str) -> None:
        goals = [i for i, event in enumerate(self.events) if event.event == "goal" and event.team == side]
        unset = self.set_by_people[side] > 0
        if unset:
            self.set_by_people[side] -= 1
            self._emit(at, self._goes_on(), None, "score taken back")
            first = len(self.events) - 1
        elif goals:
            first = goals[-1]
            self.events[first] = replace(self.events[first], event="stop", team=None, note="goal taken back")
        else:
            self._emit(at, self._goes_on(), None, "score taken back")
            first = len(self.events) - 1
        self._count(first, side, -1)
        of = f"the goal at {self.events[first].t_ns / 1e9:.1f} s" if goals else "a goal of before the log"
        of = "a goal that they had set" if unset else of
        note = f"people took back {of}, of {colour}"
        self.flaws.append(Flaw("score corrected", note, start_ns=at, team=side))

    def _set(self, at: int, side: Side, old: int, new: int, colour: str) -> None:
        """Count what people set at once."""
        note = f"score of {colour} set from {old} to {new}"
        self._emit(at, self._goes_on(), None, note)
        self._count(len(self.events) - 1, side, new - old)
        self.set_by_people[side] += new - old
        self.flaws.append(Flaw("score corrected", f"{note}: taken for no goals", start_ns=at, team=side))

    def _shoot(self, at: int, side: Side, goals: int, colour: str) -> None:
        """Count goals of a shoot-out, or take them back."""
        self.shots[side] = max(self.shots[side] + goals, 0)
        if goals:
            what = "goal" if goals > 0 else "goal taken back"
            self._emit(at, "stop", None, f"shoot-out: {what} of {colour}")

    def _take_end_back(self) -> None:
        """The match goes on after it had ended."""
        ends = [i for i, event in enumerate(self.events) if event.event == "end"]
        if ends:
            self.events[ends[-1]] = replace(self.events[ends[-1]], event="stop", note="end taken back")

    def _count(self, first: int, side: Side, step: int) -> None:
        """Change a side's score, from an event on."""
        self.goals[side] += step
        column = f"score_{side}"
        for i in range(first, len(self.events)):
            score = getattr(self.events[i], column)
            self.events[i] = replace(self.events[i], **{column: max(score + step, 0)})
