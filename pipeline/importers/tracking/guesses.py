"""Inference of the pitch and the home team, where a tracking table names neither."""

from __future__ import annotations

from itertools import product
from typing import Literal

import numpy as np

from pitchlore.pipeline.game.pitch import PITCHES, Kind, Pitch
from pitchlore.pipeline.importers.forms.words import AWAYS, HOMES, parts_of
from pitchlore.pipeline.importers.tracking.mapping import PitchMap, TrackingMap
from pitchlore.pipeline.importers.tracking.states import Course, changes, rises, tokens
from pitchlore.pipeline.numbers.arrays import F64

GuessBasis = Literal["names", "goals in the states", "kick-offs", "the ball at the goals", "alphabet"]

#: Longest half-length of each kind, metres. The limits lie between the pitches of 2.2 m (VSSS with five
#: a side) and 6 m (the first SSL), and between those of 12 m (SSL) and 105 m (2D).
_LONGEST = ((Kind.VSSS, 1.6), (Kind.SSL, 15.0))
#: Smaller or larger pitches of a kind, with goals as in the leagues' rules, and the half-lengths from
#: which or up to which they are taken, metres.
_FIVE_A_SIDE = Pitch(kind=Kind.VSSS, length=2.2, width=1.8, goal_width=0.4, goal_depth=0.15)
_DIVISION_B = Pitch(kind=Kind.SSL, length=9.0, width=6.0, goal_width=1.0, goal_depth=0.18)
_FIVE_FROM = 0.95
_B_UP_TO = 5.0
#: Time before a change of the score in which the ball is looked for at a goal, ns.
_BEFORE_NS = 1_000_000_000
#: Time before it in which the teams' ends are looked at, ns.
_AROUND_NS = 10_000_000_000
#: Share of the half-length from which on the ball is at a goal.
_AT_GOAL = 0.9


def guess_pitch(x: F64, given: PitchMap, *, corner: bool) -> tuple[Pitch, bool]:
    """Pitch of a tracking table: as the map gives it, else by how far along it positions reach.

    Args:
        x: positions along the pitch, metres, NaN where unknown.
        given: the map's pitch.
        corner: whether the origin of ``x`` is a corner.

    Returns:
        The pitch, and whether its kind was inferred.
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
    reported = given.model_dump(exclude_none=True)
    return Pitch.model_validate({**pitch.model_dump(), **reported}), given.kind is None


def guess_home(
    course: Course, names: tuple[str, str], mapping: TrackingMap, votes: F64, goal_x: float
) -> tuple[int, GuessBasis]:
    """Home team: the one that is called so, or else the one of two teams whose goals ``score_home`` counts.

    Each rise of a score is evidence of three kinds: the state names the team that scored, the other
    team kicks off next, or the ball was at the goal of the team that stands at that end. Each goal is a
    vote. The first kind whose votes do not cancel out decides; without any, the alphabet does.

    Args:
        course: the course of the match, in order of time.
        names: the two teams, sorted.
        mapping: for the words of states.
        votes: [F] positive where the bodies say that the first team attacks +x.
        goal_x: half the pitch's length, metres.

    Returns:
        Index of home in ``names``, and the kind of evidence that decided.
    """
    called = [parts_of(name) & words for name, words in product(names, (HOMES, AWAYS))]
    if (called[0] and called[3]) or (called[1] and called[2]):
        return (0 if called[0] and called[3] else 1), "names"
    goals = [(index, side) for index, side, step in rises(course.score) if step > 0]
    said = {index: tokens(state, names, mapping) for index, state in changes(course.states)}
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
    evidence: tuple[tuple[int, GuessBasis], ...] = (
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
