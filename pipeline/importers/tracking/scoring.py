"""Goals of a tracking table, from its score, its states, its kick-offs, or the ball."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.importers.tracking.ball_goals import Ball, BallGoal, Crossing, Sequel, ball_goals
from pitchlore.pipeline.importers.tracking.mapping import GoalFinding
from pitchlore.pipeline.importers.tracking.states import STOPS, Course, Found, StateWords
from pitchlore.pipeline.matches.frame import Period, home_attacks
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import Bools
from pitchlore.schemas import Side

#: As column origin of schema Goals.
Origin = Literal["score", "state", "kick-off", "ball"]

_CROSSED: dict[Crossing, str] = {
    "over": "over the line", "line": "on the line", "unseen": "lost before the line"}
_AFTER: dict[Sequel, str] = {
    "centre": "then at the centre", "stopped": "then play stopped", "played on": "then played on"}


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
        confidence: confidence in each of them by its time, ns, if the ball alone tells goals.
        flaws: notes that the user has to know.
    """

    origin: Origin | None
    found: tuple[Found, ...] = ()
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
    """Origin of the goals of a table, and the goals found from the ball.

    A score goes before states that say goal, these before kick-offs. Where there is none of these, goals are
    found from the ball. Where no kick-off names a team, the ball tells the team that scored before it.

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
    if course.score is not None:
        return Scoring("score")
    if any(token.event == "goal" for token in tokens):
        return Scoring("state")
    if kicking_off - {None}:
        return Scoring("kick-off")
    seen = np.isfinite(course.ball_x) & np.isfinite(course.ball_y)
    candidates = ball_goals(_ball(course, said, seen), pitch) if finding.from_ball else []
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
        return Scoring("ball", flaws=(_no_goals(why, course, lack),))
    listed = ", ".join(f"{kind} {count}" for kind, count in Counter(map(_words, goals)).most_common())
    note = f"nothing tells goals, so they were found from the ball: {listed}{less}. No score is made of them"
    flaw = Flaw("goals inferred", note, len(goals), goals[0].t_ns, goals[-1].t_ns + 1)
    return Scoring("ball", found, tuple((goal.t_ns, goal.confidence) for goal in goals), (flaw,))


def _with_teams(
    goals: Sequence[BallGoal], course: Course, periods: Sequence[Period], unknown: Sequence[tuple[int, int]]
) -> tuple[Found, ...]:
    """The goals, each of the team that attacks that goal; of nobody where the direction is not known."""
    attacks = home_attacks(tuple(periods), np.array([goal.t_ns for goal in goals], dtype=np.int64))
    found = []
    for goal, sign in zip(goals, attacks.tolist(), strict=True):
        reported = not any(start <= goal.t_ns < end for start, end in unknown)
        index = int(np.searchsorted(course.t_ns, goal.t_ns))
        back = None if goal.restart_ns is None else int(np.searchsorted(course.t_ns, goal.restart_ns))
        team: Side | None = ("home" if goal.end == sign else "away") if reported else None
        found.append(Found(index, team, _words(goal), back, kick_off=goal.sequel == "centre"))
    return tuple(found)


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
    return Ball(course.t_ns[kept], course.ball_x[kept], course.ball_y[kept], stopped[kept])
