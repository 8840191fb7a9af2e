"""A team that presses high: the ball's carrier gets no time anywhere on the pitch.

- The robot nearest to the ball goes for it at full speed. From between the ball and its own goal it runs the
  ball down. From elsewhere it cuts the carrier's way to the goal.
- A second one closes in behind it, between the ball and the own goal. If an adversary waits there for a pass,
  it stands in the pass's way.
- One robot keeps the goal. With more robots, each further one covers from further back.

Source: CYRUS 2014 of RoboCup's 2D league, ``src/bhv_pressing.cpp`` (naderzare/CYRUS2014@cee0fd1). There one
robot presses if an adversary will be first at the ball and no teammate is nearer. It aims at the place where
it can meet the carrier on its way to the own goal, else at a place some metres before it. The second robot is
ours: with three a side there is no line of defence behind the one that presses, so the second is that line,
close enough to win what the first knocks loose. Goalkeeper, shots and the rules for the laws are those of
:mod:`pipeline.arena.teams.static`.
"""

from __future__ import annotations

import math

from pitchlore.pipeline.arena.teams import static
from pitchlore.pipeline.arena.teams.static import ATTACKER, KEEPER, SUPPORTER
from pitchlore.pipeline.game.bodies import BALL, Record, Records, X, Y
from pitchlore.pipeline.game.tactics.ball import push, soon
from pitchlore.pipeline.game.tactics.geometry import clamp, distance
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.splitmix import SplitMix
from pitchlore.pipeline.game.tactics.steering import around
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

# The nearest robot presses until another is nearer by so many radii (7.5 cm).
_HYSTERESIS = 2.0
# The second robot is so many radii behind the ball (15 cm), the next ones as much again.
_COVER = 4.0
# A receiver counts if it is so many radii nearer to the own goal than the ball (7.5 cm). The second robot
# stands before it by so many radii.
_AHEAD, _MARK = 2.0, 3.0
# The carrier is met on its way after this share of the distance to the ball.
_CUT = 0.5

#: The memory before a match: that of the static team.
new_memory = static.new_memory


@njit(cache=True, nogil=True, error_model="numpy")
def play(
    view: F64, packed: Records, splitmix: SplitMix, wheels: F64, robots: Records, rules: Records
) -> None:
    """Play one frame, see :class:`pipeline.arena.teams.table.Script`; nothing is left to chance."""
    m, rule = packed[0], rules[0]
    _share_out(view, m, robots)
    place = 0
    for robot in range(1, len(robots) + 1):
        own = robots[robot - 1]
        if own["job"] == KEEPER:
            static.guard(view, robot, m, wheels)
        elif own["job"] == ATTACKER:
            _press(view, robot, rule, m, wheels)
        else:
            _cover(view, robot, place, rule, m, wheels)
            place += 1
        static.get_free(view, robot, rule, m, own, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _share_out(view: F64, m: Measures, robots: Records) -> None:
    """Give each robot its job: the keeper is the static team's, the nearest other one to the ball presses."""
    before = 0
    for robot in range(1, len(robots) + 1):
        if robots[robot - 1]["job"] == ATTACKER:
            before = robot
    static.share_out(view, m, robots)
    presser, least = 0, math.inf
    for robot in range(1, len(robots) + 1):
        if robots[robot - 1]["job"] == KEEPER:
            continue
        robots[robot - 1]["job"] = SUPPORTER
        bx, by = soon(view, robot, m)
        away = math.hypot(bx - view[robot, X], by - view[robot, Y])
        away -= _HYSTERESIS * m.radius if robot == before else 0.0
        if away < least:
            presser, least = robot, away
    robots[presser - 1]["job"] = ATTACKER


@njit(cache=True, nogil=True, error_model="numpy")
def _press(view: F64, robot: int, rule: Record, m: Measures, wheels: F64) -> None:
    """Take the ball from its carrier; a ball that no adversary is as near to is attacked as usual."""
    own = distance(view, robot, BALL)
    if static.left_to_keeper(view, rule, m) or distance(view, carrier(view), BALL) > own + m.radius:
        static.attack(view, robot, rule, m, wheels)
        return
    bx, by = soon(view, robot, m)
    if view[robot, X] < view[BALL, X] - 0.5 * m.radius:
        push(view, robot, m.goal_x, 0.0, m.top, 0.5, m, wheels)
        return
    # to where the carrier's way to the goal is cut
    gx, gy = -m.goal_x - bx, -by
    length = max(math.hypot(gx, gy), m.radius)
    cut = min(_CUT * own + m.touch, length)
    dx, dy = bx + cut * gx / length - view[robot, X], by + cut * gy / length - view[robot, Y]
    dx, dy = around(view, robot, dx, dy, math.hypot(dx, dy), m)
    static.go(view, robot, dx, dy, m.top, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _cover(view: F64, robot: int, place: int, rule: Record, m: Measures, wheels: F64) -> None:
    """Stand close behind the ball, or in the way of a pass to an adversary nearer to the own goal."""
    if static.left_to_keeper(view, rule, m) or static.at_hand(view, robot, m):
        static.support(view, robot, place, rule, m, wheels)
        return
    bx, by = view[BALL, X], view[BALL, Y]
    other = _receiver(view, m) if place == 0 else 0
    if other > 0:
        dx, dy = bx - view[other, X], by - view[other, Y]
        length, off = max(math.hypot(dx, dy), m.radius), _MARK * m.radius
        x, y = view[other, X] + off * dx / length, view[other, Y] + off * dy / length
    else:
        dx, dy = -m.goal_x - bx, -by
        length, off = max(math.hypot(dx, dy), m.radius), (1 + place) * _COVER * m.radius
        x, y = bx + off * dx / length, by + off * dy / length
    # one attacker at most in the adversary's area
    x = min(x, m.goal_x - m.area_depth - 2.0 * m.radius)
    static.wait(view, robot, x, clamp(y, m.half_width), m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def carrier(view: F64) -> int:
    """Row of the adversary's robot that is nearest to the ball."""
    count = (view.shape[0] - 1) // 2
    nearest: int = count + 1
    least = math.inf
    for other in range(count + 1, 2 * count + 1):
        away = distance(view, other, BALL)
        if away < least:
            nearest, least = other, away
    return nearest


@njit(cache=True, nogil=True, error_model="numpy")
def _receiver(view: F64, m: Measures) -> int:
    """Row of the adversary nearest to the ball of those that wait nearer to the own goal; 0 if none does."""
    count, holder = (view.shape[0] - 1) // 2, carrier(view)
    nearest, least = 0, math.inf
    for other in range(count + 1, 2 * count + 1):
        waits = view[other, X] < view[BALL, X] - _AHEAD * m.radius
        away = distance(view, other, BALL)
        if other != holder and waits and away < least:
            nearest, least = other, away
    return nearest
