"""A team that counter-attacks: a deep block until the ball is won, then passes forward.

- While the adversary has the ball, one robot goes for it. The others stand before their own area, in the
  ball's way to the goal, wherever the ball is.
- Once a field player is clearly nearer to the ball than every adversary, another runs ahead of it. The first
  passes to it if no adversary stands in the pass's way, and shoots if it is far enough forward.
- The ball is lost when an adversary is clearly nearer to it. Then the others run back.

Source: RoboTeam Twente's counter play, ``src/tactics/CounterPlay.cpp``
(RoboTeamTwente/roboteam_tactics@2dcf448): the keeper finds a robot in the own half, which passes to one far
ahead beside the goal's middle, which passes to the one that shoots. With three a side one pass is left of
that. The block is ours: without a line of defence a pass forward leaves the goal open, so the block is where
the adversary has to come. The one robot that goes for the ball is ours, too. If it waits in the block until
the ball is near, the team loses to the static one by 6 to 9 goals a match (12 matches each): robots of this
league have no kicker, and a carrier that gets going pushes the ball through. Goalkeeper, shots and the
rules for the laws are those of :mod:`pipeline.arena.teams.static`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from pitchlore.pipeline.arena.teams import static
from pitchlore.pipeline.arena.teams.people import People
from pitchlore.pipeline.arena.teams.pressing import carrier
from pitchlore.pipeline.arena.teams.static import ATTACKER, KEEPER
from pitchlore.pipeline.game.bodies import BALL, VX, VY, Record, Records, X, Y
from pitchlore.pipeline.game.tactics.ball import coming
from pitchlore.pipeline.game.tactics.geometry import clamp, distance, unit_vector
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.splitmix import SplitMix
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

#: What the team remembers: whether it has won the ball.
TEAM = np.dtype([("won", np.int64)])

# The ball is won by a field player that is nearer to it than every adversary by so many radii, and lost to an
# adversary that is nearer by as many.
_CLEARLY = 1.5
# The block is so many radii before the own area, its robots so many apart.
_BLOCK, _APART = 3.0, 2.6
# A receiver runs so many radii ahead of the ball and so many off the pitch's middle; a pass goes to one that
# is ahead by at least so many.
_RUN, _WIDE, _FORWARD = 12.0, 7.0, 5.0
# A pass leads its receiver by so many seconds; an adversary within so many radii of its way stops it.
_LEAD_S, _LANE = 0.15, 2.0
# A pass that comes within so many radii of its receiver is met.
_NEAR = 3.0
# Beyond this share of the adversary's half the robot with the ball shoots.
_SHOOT = 0.45


def new_memory(
    robots: int, m: Measures, rng: Generator, people: People
) -> tuple[Records, Records, Records]:
    """The memory before a match: that of the static team, and a record of :data:`TEAM`, [1]."""
    return (*static.new_memory(robots, m, rng, people), np.zeros(1, dtype=TEAM))


@njit(cache=True, nogil=True, error_model="numpy")
def play(
    view: F64, packed: Records, splitmix: SplitMix, wheels: F64, robots: Records, rules: Records,
    teams: Records,
) -> None:
    """Play one frame, see :class:`pipeline.arena.teams.table.Script`; nothing is left to chance."""
    m, rule, team = packed[0], rules[0], teams[0]
    static.share_out(view, m, robots)
    first = second = 0
    for robot in range(1, len(robots) + 1):
        job = robots[robot - 1]["job"]
        if job == ATTACKER:
            first = robot
        elif job != KEEPER and (second == 0 or view[robot, X] > view[second, X]):
            second = robot
    _decide(view, robots, m, team)
    attacks = team["won"] == 1 and not static.left_to_keeper(view, rule, m)
    place = 0
    for robot in range(1, len(robots) + 1):
        own = robots[robot - 1]
        if own["job"] == KEEPER:
            static.guard(view, robot, m, wheels)
        elif robot == first and attacks and second > 0 and _open(view, second, m):
            ux, uy = unit_vector(*_pass(view, second))
            static.drive_ball(view, robot, ux, uy, m, wheels)
        elif robot == first or (robot == second and attacks and _gets(view, robot, m)):
            static.attack(view, robot, rule, m, wheels)
        elif robot == second and attacks:
            _run(view, robot, m, wheels)
        else:
            _block(view, robot, place, rule, m, wheels)
            place += 1
        static.get_free(view, robot, rule, m, own, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _decide(view: F64, robots: Records, m: Measures, team: Record) -> None:
    """Note whether the team has won the ball or lost it; in between it is as it was."""
    least = math.inf
    for robot in range(1, len(robots) + 1):
        if robots[robot - 1]["job"] != KEEPER:
            least = min(least, distance(view, robot, BALL))
    theirs = distance(view, carrier(view), BALL)
    if least < theirs - _CLEARLY * m.radius:
        team["won"] = 1
    elif theirs < least - _CLEARLY * m.radius:
        team["won"] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def _block(view: F64, robot: int, place: int, rule: Record, m: Measures, wheels: F64) -> None:
    """Stand before the own area in the ball's way to the goal; those of ``place`` 1, 2, … beside place 0."""
    if static.left_to_keeper(view, rule, m) or static.at_hand(view, robot, m):
        static.support(view, robot, place, rule, m, wheels)
        return
    x = -m.goal_x + m.area_depth + _BLOCK * m.radius
    ahead = max(view[BALL, X] + m.goal_x, m.radius)
    y = view[BALL, Y] * min((x + m.goal_x) / ahead, 1.0)
    # those beside it stand on the side of the pitch's middle, then on the other
    side = -1.0 if (y >= 0.0) == (place % 2 == 1) else 1.0
    y += side * ((place + 1) // 2) * _APART * m.radius
    static.wait(view, robot, x, clamp(y, m.area_half_width), m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _run(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """Run ahead of the ball to one side of the pitch, not into the adversary's area."""
    x = min(view[BALL, X] + _RUN * m.radius, m.goal_x - m.area_depth - 2.0 * m.radius)
    # it stays on its side, where a pass finds it; from the middle it goes to the side without the ball
    y = view[robot, Y] if abs(view[robot, Y]) > 2.0 * m.radius else -view[BALL, Y]
    side = 1.0 if y >= 0.0 else -1.0
    static.wait(view, robot, x, side * _WIDE * m.radius, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _gets(view: F64, robot: int, m: Measures) -> bool:
    """True if a pass comes to a robot: a ball that rolls fast and passes it closely."""
    speed, _, _, aside = coming(view, robot, m)
    return speed > m.fast and abs(aside) < _NEAR * m.radius


@njit(cache=True, nogil=True, error_model="numpy")
def _pass(view: F64, mate: int) -> tuple[float, float]:
    """The vector from the ball to where a teammate will be, metres."""
    x = view[mate, X] + _LEAD_S * view[mate, VX] - view[BALL, X]
    y = view[mate, Y] + _LEAD_S * view[mate, VY] - view[BALL, Y]
    return x, y


@njit(cache=True, nogil=True, error_model="numpy")
def _open(view: F64, mate: int, m: Measures) -> bool:
    """True if a pass to a teammate goes forward and no adversary stands in its way."""
    dx, dy = _pass(view, mate)
    if view[BALL, X] > _SHOOT * m.goal_x or dx < _FORWARD * m.radius:
        return False
    length = math.hypot(dx, dy)
    count = (view.shape[0] - 1) // 2
    for other in range(count + 1, 2 * count + 1):
        ox, oy = view[other, X] - view[BALL, X], view[other, Y] - view[BALL, Y]
        on = (ox * dx + oy * dy) / length
        if 0.0 < on < length and abs(ox * dy - oy * dx) < _LANE * m.radius * length:
            return False
    return True
