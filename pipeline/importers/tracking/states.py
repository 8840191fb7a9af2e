"""Referee events of a tracking table, from its states of the game and its score."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.importers.rows import Event, other
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.schemas import SIDES, Side

#: Events after which play is stopped.
STOPS = {"goal", "half", "end", "stop"}
#: Longest time between two frames without a gap, ns.
_GAP_NS = 500_000_000
#: A state may come so much later than what it tells, ns.
_STATE_LATE_NS = 1_000_000_000
#: Note of the events between two periods.
_ANEW = "a new period"
#: Events that name a team: it scores, or brings the ball back into play.
_OF_A_TEAM = {"goal", "kick-off", "fault"}

#: Words for states of the game, without their team: those of the plain form, of common simulators, and
#: of the SSL's referee as the teams' software names them (in CamelCase).
_WORDS_OF = {
    "play": "play playon gamerunning running normal gameon",
    "kick-off": "kickoff attackkickoff defendkickoff",
    "goal": "goal",
    "fault": (
        "freeball penalty penaltykick goalkick freekick kickin throwin corner cornerkick dropball direct "
        "indirect directally directenemy indirectally indirectenemy attackfreekick defendfreekick "
        "attackpenalty defendpenalty"
    ),
    "half": "half halftime",
    "end": "end timeover fulltime gameover",
    "stop": "stop halt pause timeout ballplacement ballplacementally ballplacementenemy beforekickoff",
}
#: The fault's own name is a word, too: what is known of it is that a team brings the ball into play.
WORDS = {word: event for event, words in _WORDS_OF.items() for word in words.split()} | {"fault": "fault"}


class Token(NamedTuple):
    """One word of a state: its event (None if the word is not known), its team, the word itself."""

    event: str | None
    team: Side | None
    word: str


#: The words of the states, by the index of the frame at which each begins.
StateWords = dict[int, list[Token]]


class Found(NamedTuple):
    """A goal that no state or score tells.

    Attributes:
        frame: index of its frame.
        team: team that scored; None where unknown.
        note: how it was found.
        restart: index of the frame at which play may go on; None if never.
        kick_off: whether that is a kick-off.
    """

    frame: int
    team: Side | None
    note: str
    restart: int | None
    kick_off: bool


class FoundRestart(NamedTuple):
    """A restart that no state tells, but for kick-offs.

    Attributes:
        frame: index of its frame.
        team: team that takes it; None where unknown, or if none does.
        note: its kind, and how it was found.
    """

    frame: int
    team: Side | None
    note: str


@dataclass(frozen=True, slots=True)
class Course:
    """Course of a match, one entry per frame, in order of time.

    Attributes:
        t_ns: int64 [F].
        states: state of the game, None where absent; None if the table has no states.
        score: int64 [F, 2] goals of home and away, -1 where absent; None if the table has no score.
        segments: the recorder's segments; None if the table has none.
        ball_x, ball_y: float64 [F], metres.
        unscored: whether it has a column for the score, but no score.
        breaks: indices of the frames with which later periods begin.
        line_ups: int64 [F], how often the robots were put elsewhere up to a frame; None if nobody looked.
    """

    t_ns: I64
    states: Sequence[str | None] | None
    score: I64 | None
    segments: Sequence[str | None] | None
    ball_x: F64
    ball_y: F64
    unscored: bool = False
    breaks: tuple[int, ...] = ()
    line_ups: I64 | None = None


def tokens(state: str, names: tuple[str, str], mapping: TrackingMap) -> list[Token]:
    """Words of a state, with their meaning; a state joins words by '+'.

    A word may end in ``_`` and a prefix of a team's name, or home or away.

    Args:
        state: as in the file; the map is asked for the whole of it before its parts.
        names: names of home and away.
        mapping: its ``states`` take precedence over ``WORDS``.
    """
    found = []
    words = [state] if mapping.meaning(state) is not None else state.split("+")
    for word in (part.strip() for part in words):
        if (known := mapping.meaning(word)) is not None:
            found.append(Token(*known, word))
            continue
        whole = WORDS.get(_bare(word))
        head, _, tail = word.rpartition("_")
        if whole is None and head:
            found.append(Token(WORDS.get(_bare(head)), _team(tail, names), word))
        else:
            found.append(Token(whole, None, word))
    return found


def _bare(word: str) -> str:
    return word.lower().replace("_", "").replace("-", "").replace(" ", "")


def _team(prefix: str, names: tuple[str, str]) -> Side | None:
    """Team with this prefix; None if both teams or neither have it."""
    start = prefix.lower()
    begins = [side for side, name in zip(SIDES, names, strict=True) if name.lower().startswith(start)]
    if len(begins) == 1:
        return begins[0]
    return next((side for side in SIDES if side == start), None)


def changes(states: Sequence[str | None] | None) -> Iterator[tuple[int, str]]:
    """Index and state of each change of the state; absent states are skipped."""
    last: str | None = None
    for index, state in enumerate(states or ()):
        if state is not None and state != last:
            last = state
            yield index, state


def words_of(course: Course, names: tuple[str, str], mapping: TrackingMap) -> StateWords:
    """The words of the states of a match."""
    return {index: tokens(state, names, mapping) for index, state in changes(course.states)}


def half_times(course: Course, said: StateWords) -> list[int]:
    """Times of the half-times, ns."""
    return [int(course.t_ns[index]) for index, known in said.items() if any(t.event == "half" for t in known)]


def rises(score: I64 | None) -> Iterator[tuple[int, int, int]]:
    """Index, side (0 home, 1 away) and step of each change of a score; none without a score."""
    if score is None:
        return
    for side in (0, 1):
        known = np.flatnonzero(score[:, side] >= 0)
        steps = np.diff(score[known, side])
        for at in np.flatnonzero(steps):
            yield int(known[at + 1]), side, int(steps[at])


@dataclass(slots=True)
class _Referee:
    """Event log that keeps the score and whether play is on."""

    course: Course
    score: list[int | None]
    events: list[Event] = field(default_factory=list)
    playing: bool = False

    def emit(self, index: int, event: str, note: str | None, team: Side | None = None) -> None:
        """Append an event at a frame, with the score after it."""
        home, away = self.score
        self.events.append(Event(int(self.course.t_ns[index]), event, team, home, away, note))
        self.playing = event not in STOPS

    def goal(self, index: int, team: Side | None, note: str) -> None:
        """Append a goal. If its team is unknown (None), so is the score from then on."""
        if team is None:
            self.score[:] = [None, None]
        else:
            self._count(team, 1)
        self.emit(index, "goal", note, team)

    def _count(self, team: Side, goals: int) -> None:
        """Add goals to a team's score; an unknown score stays unknown."""
        side = SIDES.index(team)
        before = self.score[side]
        self.score[side] = None if before is None else before + goals

    def take_back(self, index: int, team: Side) -> None:
        """Turn the team's last goal, which did not count, into a stop."""
        self._count(team, -1)
        for at in range(len(self.events) - 1, -1, -1):
            if self.events[at].event == "goal" and self.events[at].team == team:
                self.events[at] = replace(self.events[at], event="stop", team=None, note="goal taken back")
                return


def referee_events(
    course: Course, said: StateWords, centre: float, source: SourceFile, found: Sequence[Found] = (),
    put: Sequence[FoundRestart] = (), *, by_ball: bool = False,
) -> tuple[list[Event], list[Flaw]]:
    """Referee events in order of time, and flaws of words that are not known.

    A state is an event on its first frame. ``play`` is an event only if play was stopped; after kick-offs
    and faults it is on already. A goal is a rise of the score. Without a score it is a state that says
    goal; without such states it is each kick-off except the first and those after half-time. The scoring
    team is the one whose score rises or which the state names, else the one that does not kick off next.
    If no source names the scoring team, the goal's team is null and so is the score from then on.
    Without a score, it is known only if states tell goals and the match begins in the recording: its first
    event is a kick-off. A table that has columns for the score and nothing in them says that nobody knows it.
    A word that is not known stops play and is a flaw.
    If no state ever stops play, play is on from the start, and after a goal as soon as the ball is within
    ``centre``; restarts that were found from the ball are faults then. A recorder's segment that changes in
    play without a gap is a fault.

    Args:
        course: the course of the match, in order of time.
        said: its states.
        centre: distance from the pitch's centre within which a ball was put back, metres.
        source: the recording.
        found: goals that were found from the ball.
        put: restarts that were found from the ball.
        by_ball: whether these are the goals; the score is unknown then. Otherwise they say who has scored
            before a kick-off that names no team.

    Raises:
        BadRecording: if the score changes by more goals than the limit.
    """
    words = Counter(token.event for known in said.values() for token in known)
    flaws = [
        Flaw("skipped", f"game_state {word!r} is not known and taken for a stop; name it in [states]", count)
        for word, count in Counter(
            token.word for known in said.values() for token in known if token.event is None
        ).items()
    ]
    goals: dict[int, list[tuple[Side, int]]] = {}
    reported = 0
    for index, side, step in rises(course.score):
        reported += abs(step)
        if reported > source.limits.goals:
            raise source.too_much(f"a score that changes by {reported} goals", "goals")
        goals.setdefault(index, []).append((SIDES[side], step))
    from_start = not by_ball and not course.unscored and _begins(said)
    referee = _Referee(course, _first_score(course.score) or ([0, 0] if from_start else [None, None]))
    if not words.keys() - {"play"}:
        if by_ball:
            _of_the_ball(referee, found)
        else:
            _without_states(referee, goals, centre)
        return _with_halves(_with_faults(referee.events, course, put), course), flaws
    cuts = {
        index for index, _ in changes(course.segments)
        if index and course.t_ns[index] - course.t_ns[index - 1] <= _GAP_NS
    }
    infer = course.score is None and not words["goal"]
    kicked_off = -1
    seen = {goal.frame: goal for goal in found if by_ball}
    back = {goal.restart: goal for goal in seen.values() if goal.restart and not _is_said(course, said, goal)}
    breaks = {*course.breaks}
    told = breaks | goals.keys() | back.keys()
    for index in sorted(said.keys() | goals.keys() | cuts | seen.keys() | back.keys() | breaks):
        if index in breaks and referee.events and referee.events[-1].event not in ("half", "end"):
            on = referee.playing
            referee.emit(index - 1, "half", _ANEW)
            if on and index not in said:
                referee.emit(index, "play", _ANEW)
        if index in back:
            _restart(referee, index, back[index])
        if index in seen:
            referee.goal(index, seen[index].team, seen[index].note)
        known = said.get(index, [])
        halves = index in breaks or any(token.event == "half" for token in known)
        scorer = _restart_tells(said, index) if course.score is None else None
        _goals_at(referee, index, goals.get(index, []), known, scorer, scores=course.score is not None)
        if not known and index in cuts and referee.playing and index not in told:
            referee.emit(index, "fault", "segment")
        for token in known:
            if token.event == "kick-off":
                last = referee.events[-1].event if referee.events else None
                if infer and kicked_off >= 0 and not halves and last != "half":
                    before = [goal.team for goal in found if kicked_off < goal.frame <= index]
                    scorer = other(token.team) if token.team is not None else before[-1] if before else None
                    referee.goal(index, scorer, token.word)
                kicked_off = index
            if token.event == "goal" or (token.event == "play" and referee.playing):
                continue
            event = token.event or "stop"
            referee.emit(index, event, token.word, token.team if event in _OF_A_TEAM else None)
    return referee.events, flaws


def _with_faults(events: list[Event], course: Course, put: Sequence[FoundRestart]) -> list[Event]:
    """Events of a table without states, with the restarts found; none between a goal and its kick-off."""
    found = []
    for restart in put:
        t_ns = int(course.t_ns[restart.frame])
        at = bisect_right(events, t_ns, key=lambda event: event.t_ns)
        before = events[at - 1]
        if before.event != "goal" or at == len(events) or events[at].event != "kick-off":
            found.append(replace(before, t_ns=t_ns, event="fault", team=restart.team, note=restart.note))
    return sorted([*events, *found], key=lambda event: event.t_ns)


def _with_halves(events: list[Event], course: Course) -> list[Event]:
    """Events of a table without states, with an end and a beginning at each new period."""
    for index in course.breaks:
        start = int(course.t_ns[index])
        before = [event for event in events if event.t_ns < start]
        # a kick-off that was looked for after the last goal of a period belongs to the next one's beginning
        after = [event for event in events if event.t_ns >= start]
        if before[-1].event in STOPS and after and after[0].event in ("kick-off", "play"):
            after = after[1:]
        half = replace(before[-1], t_ns=int(course.t_ns[index - 1]), event="half", team=None, note=_ANEW)
        events = [*before, half, replace(half, t_ns=start, event="play"), *after]
    return events


def _begins(said: StateWords) -> bool:
    """True if the match begins in the recording: a kick-off is the first event that does not stop play."""
    events = (token.event or "stop" for index in sorted(said) for token in said[index])
    return next((event for event in events if event not in STOPS - {"goal"}), None) == "kick-off"


def _is_said(course: Course, said: StateWords, goal: Found) -> bool:
    """True if the states themselves say when play goes on after a goal that was found."""
    assert goal.restart is not None
    until = course.t_ns[goal.restart] + _STATE_LATE_NS
    return any(goal.frame < index and course.t_ns[index] <= until for index in said)


def _restart(referee: _Referee, index: int, goal: Found) -> None:
    """Append the event with which play goes on after a goal that was found."""
    if goal.kick_off:
        team = None if goal.team is None else other(goal.team)
        referee.emit(index, "kick-off", "the ball is back at the centre", team)
    else:
        referee.emit(index, "play", "the ball is seen again")


def _of_the_ball(referee: _Referee, found: Sequence[Found]) -> None:
    """Append the events of a table without states, whose goals were found from the ball."""
    referee.emit(0, "play", None)
    for goal in found:
        referee.goal(goal.frame, goal.team, goal.note)
        if goal.restart is not None:
            _restart(referee, goal.restart, goal)


def _first_score(score: I64 | None) -> list[int | None] | None:
    """Score at the first frame that has it, for each team; None if the table has no score."""
    if score is None:
        return None
    known = [goals[goals >= 0] for goals in score.T]
    return [int(goals[0]) if len(goals) else None for goals in known]


def _restart_tells(said: dict[int, list[Token]], index: int) -> Side | None:
    """Team that scored the goal at a frame, from the kick-off after it.

    None if another goal, the half or the end comes first, or if the kick-off names no team.
    """
    for at in (at for at in sorted(said) if at >= index):
        events = {token.event for token in said[at]}
        if events & {"half", "end"} or (at > index and "goal" in events):
            return None
        kick_off = next((token for token in said[at] if token.event == "kick-off"), None)
        if kick_off is not None:
            return None if kick_off.team is None else other(kick_off.team)
    return None


def _goals_at(
    referee: _Referee, index: int, steps: list[tuple[Side, int]], known: list[Token],
    scorer: Side | None = None, *, scores: bool,
) -> None:
    """Append the goals of a frame, by the score or the states; a goal that does not count is a stop.

    ``steps`` are teams and changes of their scores, ``known`` is the frame's state. ``scorer`` is the team of
    a goal whose word names none. ``scores`` says whether the table has a score.
    """
    for token in known:
        if token.event != "goal" or any(step > 0 for _, step in steps):
            continue
        if scores:
            referee.emit(index, "stop", token.word)
        else:
            referee.goal(index, token.team or scorer, token.word)
    for team, step in steps:
        word = next((token.word for token in known if token.event == "goal"), "score")
        for _ in range(step):
            referee.goal(index, team, word)
        for _ in range(-step):
            referee.take_back(index, team)


def _without_states(referee: _Referee, goals: dict[int, list[tuple[Side, int]]], centre: float) -> None:
    """Append the events of a table whose states never stop play."""
    course = referee.course
    referee.emit(0, "play", None)
    near = np.hypot(course.ball_x, course.ball_y) <= centre
    for index, until in pairwise([*sorted(goals), len(course.t_ns)]):
        _goals_at(referee, index, goals[index], [], scores=True)
        if referee.playing:  # the score was only taken back
            continue
        back = np.flatnonzero(near[index:until])
        restart = index + int(back[0]) if len(back) else min(index + 1, until)
        if restart < len(course.t_ns):
            scorer = goals[index][-1][0]
            referee.emit(restart, "kick-off", "the ball is back at the centre" if len(back) else None,
                         other(scorer))
