"""The laws of a stretch of play, read off all its frames at once: slow, without memory, and without numba.

The referee of the product carries counts from frame to frame; this one looks back over the stretch. It is
the oracle of ``tests/test_referee.py``.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from pitchlore.pipeline.arena.physics.laws import FREE_BALL, GOAL, GOAL_KICK, KICK_OFF, PENALTY
from pitchlore.pipeline.arena.physics.referee import ATTACKERS, DEFENDERS, STUCK, Laws
from pitchlore.pipeline.game.bodies import BALL, VX, VY, X, Y
from pitchlore.pipeline.numbers.arrays import F64


class Verdict(NamedTuple):
    """End of a stretch of play.

    Attributes:
        due: the restart that is to come.
        end: the end at which it happened, -1 or 1; 0 for a free ball.
        reason: GOAL, or STUCK, ATTACKERS or DEFENDERS.
        annulled: whether a goal was annulled.
    """

    due: int
    end: int
    reason: int
    annulled: bool = False


def in_goal(bodies: F64, laws: Laws) -> int:
    """The end in whose goal the ball is, or 0."""
    x, y = bodies[BALL, X], bodies[BALL, Y]
    return int(math.copysign(1, x)) if abs(x) > laws.marks.goal_line and abs(y) < laws.marks.post else 0


def _in(x: float, y: float, end: int, laws: Laws) -> bool:
    return bool(end * x > laws.marks.area_x and abs(y) < laws.marks.area_y)


def zone(bodies: F64, laws: Laws) -> int:
    """The end in whose goal area or goal the ball is, or 0."""
    for end in (-1, 1):
        if _in(bodies[BALL, X], bodies[BALL, Y], end, laws) or in_goal(bodies, laws) == end:
            return end
    return 0


def crowds(bodies: F64, end: int, attacks: int, laws: Laws) -> dict[int, bool]:
    """True for each side that has too many robots in the area at an end; ``attacks``: where home attacks."""
    robots = (len(bodies) - 1) // 2
    inside = [_in(row[X], row[Y], end, laws) for row in bodies[1:]]
    home, away = sum(inside[:robots]), sum(inside[robots:])
    attackers, defenders = (home, away) if attacks == end else (away, home)
    rules = laws.settings
    return {ATTACKERS: attackers >= rules.crowd and rules.goal_kick, DEFENDERS: defenders >= rules.crowd and rules.penalty}


def _run(frames: Sequence[bool]) -> int:
    """How many of the last frames in a row."""
    return next((n for n, held in enumerate(reversed(frames)) if not held), len(frames))


def verdict(stretch: Sequence[F64], attacks: int, laws: Laws) -> Verdict | None:
    """The call at the last frame of a stretch of play: a goal or a foul, or None.

    Args:
        stretch: the frames since the restart, in order; no frame but the last ends play.
        attacks: the direction in which home attacks.
        laws: laws of the match.
    """
    rules, limits = laws.settings, laws.limits
    zones = [zone(bodies, laws) for bodies in stretch]
    here, before = zones[-1], zones[-2] if len(zones) > 1 else 0
    scored = in_goal(stretch[-1], laws)

    # the stay of the ball in an area: the one that it is leaving now, or the one that it is in
    for end in (before, here):
        left = end != here
        stay = 0 if end == 0 else _run([z == end for z in (zones[:-1] if left else zones)])
        if stay == 0 or (left and end == 0):
            continue
        frames = stretch[-stay - left:]
        held = {side: [crowds(bodies, end, attacks, laws)[side] for bodies in frames] for side in (ATTACKERS, DEFENDERS)}
        ended = left or bool(scored)
        seen = [side for side in held if rules.remember_crowds and any(held[side][:-1])]
        if ended and seen and (left or ATTACKERS in seen):
            oldest = max(seen, key=lambda side: (_run(held[side]), side == DEFENDERS))
            return Verdict(GOAL_KICK if oldest == ATTACKERS else PENALTY, end, oldest, annulled=not left)
        if left:
            continue
        if scored:
            return Verdict(KICK_OFF, end, GOAL)
        for side, due in ((ATTACKERS, GOAL_KICK), (DEFENDERS, PENALTY)):
            if _run(held[side]) > limits["crowded"]:
                return Verdict(due, end, side)

    slow = [math.hypot(bodies[BALL, VX], bodies[BALL, VY]) <= limits["slow_speed"] for bodies in stretch]
    if min(_run(slow), _run([z == here for z in zones])) > limits["stuck"]:
        if here == 0:
            return Verdict(FREE_BALL, 0, STUCK)
        ball, robots = stretch[-1][BALL], (len(stretch[-1]) - 1) // 2
        near = [math.hypot(row[X] - ball[X], row[Y] - ball[Y]) <= laws.marks.near for row in stretch[-1][1:]]
        contested = any(near[:robots]) and any(near[robots:])
        allowed = rules.goal_kick if contested else rules.penalty
        due = FREE_BALL if not allowed else GOAL_KICK if contested else PENALTY
        return Verdict(due, 0 if due == FREE_BALL else here, STUCK)
    return None
