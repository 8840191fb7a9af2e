"""What a tracking table does not say and can be told from it: the pitch, and which team is home."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from pipeline.importers.tracking_events import Course, changes, rises, tokens
from pipeline.importers.tracking_map import PitchMap, TrackingMap
from pipeline.pitch import PITCHES, Kind, Pitch

F64 = npt.NDArray[np.float64]
Evidence = Literal["goals in the states", "kick-offs", "the ball at the goals", "alphabet"]

#: Half-lengths up to which positions are taken for those of each kind, metres: between the pitches
#: of 2.2 m (VSSS with five a side) and 6 m (the first SSL), and between 12 m (SSL) and 105 m (2D).
_LONGEST = ((Kind.VSSS, 1.6), (Kind.SSL, 15.0))
#: Smaller or larger pitches of a kind: up to or from this half-length. Goals as in the leagues' rules.
_FIVE_A_SIDE = Pitch(kind=Kind.VSSS, length=2.2, width=1.8, goal_width=0.4, goal_depth=0.15)
_DIVISION_B = Pitch(kind=Kind.SSL, length=9.0, width=6.0, goal_width=1.0, goal_depth=0.18)
_FIVE_FROM = 0.95
_B_UP_TO = 5.0
#: Goals are seen coming for so long before the score changes.
_BEFORE_NS = 1_000_000_000
#: ... and which team stands at which end is looked at for so long.
_AROUND_NS = 10_000_000_000
#: The ball is at a goal beyond this share of the half-length.
_AT_GOAL = 0.9


def guess_pitch(x: F64, given: PitchMap, *, corner: bool) -> tuple[Pitch, bool]:
    """The pitch: as it is given, or by how far along it positions reach.

    Args:
        x: positions along the pitch, metres, NaN where unknown.
        given: what the map says.
        corner: whether they are counted from the corner.

    Returns:
        The pitch, and whether its kind was guessed.
    """
    known = x[np.isfinite(x)]
    # outliers of a camera are rarer than a thousandth
    half = float(np.quantile(known if corner else np.abs(known), 0.999)) if len(known) else 0.0
    if corner:
        half /= 2
    kind = given.kind or next((kind for kind, longest in _LONGEST if half <= longest), Kind.SIM2D)
    pitch = PITCHES[kind]
    if given.kind is None and kind is Kind.VSSS and half > _FIVE_FROM:
        pitch = _FIVE_A_SIDE
    if given.kind is None and kind is Kind.SSL and half <= _B_UP_TO:
        pitch = _DIVISION_B
    told = given.model_dump(exclude_none=True)
    return Pitch.model_validate({**pitch.model_dump(), **told}), given.kind is None


def guess_home(
    course: Course, names: tuple[str, str], mapping: TrackingMap, votes: F64, goal_x: float
) -> tuple[int, Evidence]:
    """Which of two teams is the one that ``score_home`` counts for.

    Where a score rises the state says whose goal it is; or the next kick-off is that of the other
    team; or the ball is at the goal of the team that stands at that end. The first kind of
    evidence that is there and does not contradict itself on balance is taken, else the alphabet.

    Args:
        course: in order of time.
        names: of the two teams, sorted.
        mapping: for the words of states.
        votes: [F] positive where the bodies say that the first team attacks +x.
        goal_x: half the pitch's length, metres.

    Returns:
        0 or 1, and from what it was told.
    """
    goals = [(index, side) for index, side, step in rises(course.score) if step > 0] if (
        course.score is not None
    ) else []
    said = {index: tokens(state, names, mapping) for index, state in changes(course.states or ())}
    by_goal = by_kick_off = by_ball = 0
    for at, (index, side) in enumerate(goals):
        # +1: the first team is home
        if_first = 1 if side == 0 else -1
        until = goals[at + 1][0] if at + 1 < len(goals) else len(course.t_ns)
        for token in said.get(index, []):
            if token.event == "goal" and token.team is not None:
                by_goal += if_first if token.team == "home" else -if_first
        after = (token for i in sorted(said) if index <= i < until for token in said[i])
        kick_off = next((token for token in after if token.event in ("kick-off", "half")), None)
        if kick_off is not None and kick_off.event == "kick-off" and kick_off.team is not None:
            by_kick_off += -if_first if kick_off.team == "home" else if_first
        by_ball += if_first * _scorer(course, index, votes, goal_x)
    evidence: tuple[tuple[int, Evidence], ...] = (
        (by_goal, "goals in the states"), (by_kick_off, "kick-offs"), (by_ball, "the ball at the goals"),
    )
    for balance, kind in evidence:
        if balance:
            return (0 if balance > 0 else 1), kind
    return 0, "alphabet"


def _scorer(course: Course, index: int, votes: F64, goal_x: float) -> int:
    """+1 if the ball was just before frame ``index`` in the goal that the first team attacks."""
    t_ns = course.t_ns
    low, wide = np.searchsorted(t_ns, [t_ns[index] - _BEFORE_NS, t_ns[index] - _AROUND_NS])
    x = course.ball_x[low : index + 1]
    if not np.isfinite(x).any():
        return 0
    furthest = x[np.nanargmax(np.abs(x))]
    if abs(furthest) < _AT_GOAL * goal_x:
        return 0
    return int(np.sign(furthest) * np.sign(votes[wide : index + 1].sum()))
