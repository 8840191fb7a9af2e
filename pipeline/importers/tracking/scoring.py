"""Goals of a tracking table, from its score, its states, its kick-offs, or the ball; and its restarts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.importers.tracking.ball_goals import BallGoal, Crossing, Sequel, ball_goals
from pitchlore.pipeline.importers.tracking.ball_restarts import Ball, BallRestart, ball_restarts
from pitchlore.pipeline.importers.tracking.mapping import GoalFinding
from pitchlore.pipeline.importers.tracking.states import STOPS, Course, Found, FoundRestart, StateWords
from pitchlore.pipeline.matches.frame import Period, home_attacks
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import Bools
from pitchlore.schemas import Side

#: As column origin of schema Goals.
Origin = Literal["score", "state", "kick-off", "ball"]

_CROSSED: dict[Crossing, str] = {
    "over": "over the line", "line": "on the line", "unseen": "lost before the line"}
_AFTER: dict[Sequel, str] = {
    "centre": "then at the centre", "elsewhere": "then put elsewhere",
    "stopped": "then play stopped", "played on": "then played on"}


#: Note of a restart that was found from the ball, by whether the robots were put elsewhere, too.
_NOTES = ("{}: found from the ball", "{}: found from the ball and the robots")


class Lack(NamedTuple):
    """Lack of anything that tells goals in a recording, and its cure."""

    what: str
    cure: str


OF_A_TABLE = Lack(
    "no score, no game_state that tells goals",
    "add columns score_home and score_away, or say in a map which states are goals, [states]",
)
#: The same of tables that others make, by the format of their source: their users can add no columns.
LACKS = {
    "kloppy": Lack("the provider tells no goals", "import one whose ball is seen at its goals"),
    "packets": Lack("nobody told a score", "record the referee's, too: watch --at referee=ADDRESS:PORT"),
}


class Scoring(NamedTuple):
    """Origin of the goals of a table.

    Attributes:
        origin: None if nothing does.
        found: goals that were found from the ball; empty if something else tells goals, and their teams.
        restarts: found from the ball, but for kick-offs; empty if states tell when play is on.
        confidence: confidence in each of them by its time, ns, if the ball alone tells goals.
        flaws: notes that the user has to know.
    """

    origin: Origin | None
    found: tuple[Found, ...] = ()
    restarts: tuple[FoundRestart, ...] = ()
    confidence: tuple[tuple[int, float], ...] = ()
    flaws: tuple[Flaw, ...] = ()

    def settings(self) -> dict[str, object]:
        """Part of it that the match's log keeps, as JSON values."""
        sure = {str(t_ns): confidence for t_ns, confidence in self.confidence}
        return {"from": self.origin} | ({"confidence": sure} if sure else {})


def scoring(
    course: Course, said: StateWords, periods: Sequence[Period], unknown: Sequence[tuple[int, int]],
    pitch: Pitch, finding: GoalFinding, lack: Lack = OF_A_TABLE,
) -> Scoring:
    """Origin of the goals of a table, and the goals and restarts found from the ball.

    A score goes before states that say goal, these before kick-offs. Where there is none of these, goals are
    found from the ball. Where no kick-off names a team, the ball tells the team that scored before it.
    Restarts are looked for where no state stops play.

    Args:
        course: the course of the match, in order of time.
        said: its states.
        periods: in which direction home attacks, and when.
        unknown: stretches [start, end) in which that is not known, ns.
        pitch: pitch of the match.
        finding: whether to look at the ball, and how sure a goal has to be.
        lack: the recording's lack if it has neither score nor states.
    """
    tokens = [token for known in said.values() for token in known]
    kicking_off = {token.team for token in tokens if token.event == "kick-off"}
    seen = np.isfinite(course.ball_x) & np.isfinite(course.ball_y)
    ball = _ball(course, said, seen)
    unsaid = finding.from_ball and all(token.event == "play" for token in tokens)
    put = ball_restarts(ball, pitch) if unsaid else []
    restarts, assumed = _restarts(put, course, periods, unknown)
    if course.score is not None:
        return Scoring("score", restarts=restarts, flaws=assumed)
    if any(token.event == "goal" for token in tokens):
        return Scoring("state")
    if kicking_off - {None}:
        return Scoring("kick-off")
    candidates = ball_goals(ball, pitch, put) if finding.from_ball else []
    goals = [goal for goal in candidates if goal.confidence >= finding.confidence]
    found = _with_teams(goals, course, periods, unknown)
    if kicking_off:
        return Scoring("kick-off", found)
    if not finding.from_ball or not seen.any():
        why = "the ball was never seen" if finding.from_ball else "the map says from_ball = false"
        return Scoring(None, flaws=(_no_goals(f"{why}, so that none is found", course, lack),))
    left = len(candidates) - len(goals)
    less = f"; {left} less sure than {finding.confidence:g} left out" if left else ""
    if not goals:
        why = f"the ball was not seen to go into a goal{less}"
        return Scoring("ball", restarts=restarts, flaws=(*assumed, _no_goals(why, course, lack)))
    listed = ", ".join(f"{kind} {count}" for kind, count in Counter(map(_words, goals)).most_common())
    note = f"nothing tells goals, so they were found from the ball: {listed}{less}. No score is made of them"
    flaw = Flaw("goals inferred", note, len(goals), goals[0].t_ns, goals[-1].t_ns + 1)
    sure = tuple((goal.t_ns, goal.confidence) for goal in goals)
    return Scoring("ball", found, restarts, sure, (*assumed, flaw))


def _restarts(
    put: Sequence[BallRestart], course: Course, periods: Sequence[Period], unknown: Sequence[tuple[int, int]]
) -> tuple[tuple[FoundRestart, ...], tuple[Flaw, ...]]:
    """The restarts, each of the team that takes it, and the flaw that says how they were found.

    A penalty is of the team that attacks the nearer goal, a goal kick of the one that defends it. None is
    where a period begins.
    """
    put = [restart for restart in put if restart.t_ns not in course.t_ns[list(course.breaks)]]
    towards = {"penalty": 1, "goal kick": -1}
    ends = [(restart.t_ns, restart.end * towards.get(restart.kind or "", 0)) for restart in put]
    found = tuple(
        FoundRestart(
            int(np.searchsorted(course.t_ns, restart.t_ns)), team,
            _NOTES[restart.lined_up].format(restart.kind or "ball put elsewhere"))
        for restart, team in zip(put, _attackers(ends, periods, unknown), strict=True))
    if not put:
        return found, ()
    kinds = Counter(restart.kind or "elsewhere" for restart in put)
    listed = ", ".join(f"{kind} {count}" for kind, count in kinds.most_common())
    note = f"nothing tells restarts, so they were found where the ball was put: {listed}"
    return found, (Flaw("assumed", note, len(put), put[0].t_ns, put[-1].t_ns + 1),)


def _with_teams(
    goals: Sequence[BallGoal], course: Course, periods: Sequence[Period], unknown: Sequence[tuple[int, int]]
) -> tuple[Found, ...]:
    """The goals, each of the team that attacks that goal."""
    teams = _attackers([(goal.t_ns, goal.end) for goal in goals], periods, unknown)
    found = []
    for goal, team in zip(goals, teams, strict=True):
        index = int(np.searchsorted(course.t_ns, goal.t_ns))
        back = None if goal.restart_ns is None else int(np.searchsorted(course.t_ns, goal.restart_ns))
        found.append(Found(index, team, _words(goal), back, kick_off=goal.sequel == "centre"))
    return tuple(found)


def _attackers(
    ends: Sequence[tuple[int, int]], periods: Sequence[Period], unknown: Sequence[tuple[int, int]]
) -> list[Side | None]:
    """Team that attacks an end, by pairs of time and end; None for end 0, or if the direction is unknown."""
    signs = home_attacks(tuple(periods), np.array([t_ns for t_ns, _ in ends], dtype=np.int64)).tolist()
    return [
        None if end == 0 or any(start <= t_ns < stop for start, stop in unknown)
        else "home" if end == sign else "away"
        for (t_ns, end), sign in zip(ends, signs, strict=True)]


def _no_goals(why: str, course: Course, lack: Lack) -> Flaw:
    return Flaw("goals unknown", (
        f"{lack.what}, and {why}. Nothing is learned from this match: {lack.cure}"
    ), len(course.t_ns), 0, int(course.t_ns[-1]) + 1)


def _words(goal: BallGoal) -> str:
    """How a goal was found, for the referee's notes and the flaws."""
    return f"{_CROSSED[goal.crossing]}, {_AFTER[goal.sequel]}"


def _ball(course: Course, said: StateWords, seen: Bools) -> Ball:
    """The ball where it was seen, once at each time."""
    kept = np.flatnonzero(seen)
    kept = kept[np.diff(course.t_ns[kept], prepend=-1) > 0]
    stopped = np.zeros(len(course.t_ns), dtype=np.bool_)
    at = [*sorted(said), len(stopped)]
    for index, until in pairwise(at):
        stopped[index:until] = (said[index][-1].event or "stop") in STOPS
    ups = np.zeros(len(stopped), dtype=np.int64) if course.line_ups is None else course.line_ups
    return Ball(course.t_ns[kept], course.ball_x[kept], course.ball_y[kept], stopped[kept], ups[kept])
