"""A team of fixed rules, as Yamamoto's was (paper, section 6), whose text is not public.

One robot keeps the goal, one attacks, the others support. The rules are those common to the public
strategies of the league: a goalkeeper on its line who spins at the ball, an attacker led by a univector
field to behind the ball, supporters between the ball and the own goal (rSoccer's deterministic_vss,
UnBall 2012), roles that change hands with hysteresis. View, robot and wheels are those of
:mod:`pipeline.game.tactics.steering`.

The team keeps the laws of :func:`pipeline.arena.physics.referee.referee_call` where it can: a second robot in
its own goal area is a penalty. :data:`RULES` are what it does for that. docs/decisions/players.md ("Static
team under the laws") has what each is worth, and what was tried and left out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from pitchlore.pipeline.arena.teams.people import People
from pitchlore.pipeline.game.bodies import BALL, VX, VY, Record, Records, X, Y
from pitchlore.pipeline.game.tactics.ball import has_ball, push, soon, spin
from pitchlore.pipeline.game.tactics.geometry import along, clamp, distance, offset, speed_of, unit_vector
from pitchlore.pipeline.game.tactics.goalkeeping import keep_line
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.splitmix import SplitMix
from pitchlore.pipeline.game.tactics.steering import (
    EITHER,
    FRONT,
    along_walls,
    around,
    held,
    set_wheels,
    steer,
    to_pose,
)
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

#: Jobs of robots.
SUPPORTER, KEEPER, ATTACKER = range(3)
#: What a robot remembers: its job; frames for which it has not got away though it wanted to; frames for
#: which it still backs off; the wheels with which it does, m/s.
ROBOT = np.dtype([
    ("job", np.int64), ("stuck", np.int64), ("escaping", np.int64),
    ("left", np.float64), ("right", np.float64),
])  # fmt: skip
#: Rules by which the team keeps the laws, each on (True) or off:
#:
#: - ``yields``: the attacker leaves a ball to the keeper that will be in the own goal area after
#:   ``_YIELD_S``, not only one that is there.
#: - ``escapes``: field players that are held do not back off into the own area.
#: - ``clears``: while the ball is the keeper's, field players wait ``_CLEAR`` from the area, so that no pack
#:   forms around the keeper.
RULES = np.dtype([(name, np.bool_) for name in ("yields", "escapes", "clears")])
# Lengths in robot radii, for a radius of 3.75 cm: the supporters' distance to the ball, 25 cm ("offensive
# safe radius"); a ball to spin at, 8 cm; one at a wall that spinning certainly hits, 7.2 cm.
_SUPPORT, _SPIN, _ROLL = 25 / 3.75, 8 / 3.75, 7.2 / 3.75
# A role changes hands when somebody else is nearer to its work by so many radii (10 cm).
_HYSTERESIS = 10 / 3.75
# An attacker within these cosines of the shot's line and of its own heading shoots, from so many radii.
_COS_BEHIND, _COS_HEADING, _SHOT = math.cos(math.radians(20)), math.cos(math.radians(35)), 4.0
# Room that it needs behind the ball for that, in radii.
_RUN_UP = 3.5
# A robot that is held for so long backs off for so long, seconds. One that reverses from top speed looks
# held for a quarter of a second (wheels of 6 m/s²).
_STUCK_S, _ESCAPE_S = 0.4, 0.3
# A ball that rolls on as it does, and will then be in the own area, is the keeper's, seconds.
_YIELD_S = 0.5
# Field players wait so far from the own area for the keeper, in radii: with and without the rule ``clears``.
_CLEAR, _WAIT = 9.0, 3.0


def new_memory(robots: int, m: Measures, rng: Generator, people: People) -> tuple[Records, Records]:
    """The memory before a match: records of :data:`ROBOT`, [N], and of :data:`RULES`, [1], all on.

    Only ``robots``, N, counts.
    """
    return np.zeros(robots, dtype=ROBOT), np.ones(1, dtype=RULES)


@njit(cache=True, nogil=True, error_model="numpy")
def play(
    view: F64, packed: Records, splitmix: SplitMix, wheels: F64, robots: Records, rules: Records
) -> None:
    """Play one frame, see :class:`pipeline.arena.teams.table.Script`; nothing is left to chance."""
    m, rule = packed[0], rules[0]
    share_out(view, m, robots)
    place = 0
    for robot in range(1, len(robots) + 1):
        own = robots[robot - 1]
        if own["job"] == KEEPER:
            guard(view, robot, m, wheels)
        elif own["job"] == ATTACKER:
            attack(view, robot, rule, m, wheels)
        else:
            support(view, robot, place, rule, m, wheels)
            place += 1
        get_free(view, robot, rule, m, own, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def share_out(view: F64, m: Measures, robots: Records) -> None:
    """Give each robot its job: keep the goal, attack, support.

    The robot nearest to the own goal keeps it. Of the others, the first to be behind the ball attacks. A
    robot keeps its job until another is nearer to the work by ``_HYSTERESIS``. A robot alone attacks.
    """
    margin = _HYSTERESIS * m.radius
    keeper, least = 0, np.inf
    if len(robots) > 1:
        for robot in range(1, len(robots) + 1):
            cost = math.hypot(view[robot, X] + m.goal_x, view[robot, Y])
            cost -= margin if robots[robot - 1]["job"] == KEEPER else 0.0
            if cost < least:
                keeper, least = robot, cost
    attacker, least = 0, np.inf
    ux, uy = shot(view, m)
    bx, by = view[BALL, X] - m.touch * ux, view[BALL, Y] - m.touch * uy
    for robot in range(1, len(robots) + 1):
        if robot == keeper:
            continue
        dx, dy = bx - view[robot, X], by - view[robot, Y]
        cost = math.hypot(dx, dy)
        # one who is ahead of the ball has to go round it
        holds = robots[robot - 1]["job"] == ATTACKER
        cost += max(-(dx * ux + dy * uy), 0.0) - (margin if holds else 0.0)
        if cost < least:
            attacker, least = robot, cost
    for robot in range(1, len(robots) + 1):
        job = KEEPER if robot == keeper else (ATTACKER if robot == attacker else SUPPORTER)
        robots[robot - 1]["job"] = job


@njit(cache=True, nogil=True, error_model="numpy")
def guard(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """Keep the goal: on the line, where the ball will cross it; clear a ball that nobody else may play."""
    dx, dy = offset(view, robot, BALL)
    # a ball that lies beside the goal is not driven into it
    clear = not_behind(view, robot, m) or abs(view[BALL, Y]) > m.half_goal
    if at_hand(view, robot, m):
        if has_ball(view, robot, m) and view[BALL, X] > view[robot, X] + 0.5 * m.radius:
            steer(view, robot, dx, dy, m.top, FRONT, m, wheels)
        else:
            spin(view, robot, 1.0, 0.0, m, wheels)
    elif clear and speed_of(view, BALL) < m.fast and for_keeper(view, m):
        steer(view, robot, dx, dy, m.top, FRONT, m, wheels)
    else:
        keep_line(view, robot, m.half_goal, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def attack(view: F64, robot: int, rule: Record, m: Measures, wheels: F64) -> None:
    """Drive the ball into the adversary's goal, unless it is the keeper's."""
    if left_to_keeper(view, rule, m):
        off = _CLEAR if rule["clears"] else _WAIT
        wait(view, robot, -m.goal_x + m.area_depth + off * m.radius, view[BALL, Y], m, wheels)
        return
    ux, uy = shot(view, m)
    drive_ball(view, robot, ux, uy, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def drive_ball(view: F64, robot: int, ux: float, uy: float, m: Measures, wheels: F64) -> None:
    """Get behind the ball by the univector field and drive it in the direction (ux, uy) of length 1."""
    x, y = view[robot, X], view[robot, Y]
    dx, dy = offset(view, robot, BALL)
    away = math.hypot(dx, dy)
    ahead, behind = along(view, robot, dx, dy), dx * ux + dy * uy
    if away < _SHOT * m.radius and behind > _COS_BEHIND * away and ahead > _COS_HEADING * away:
        push(view, robot, view[BALL, X] + ux, view[BALL, Y] + uy, m.top, 0.5, m, wheels)
        return
    if cramped(view[BALL, X], view[BALL, Y], ux, uy, m):
        # to it as it is, and roll it off
        if away < _ROLL * m.radius:
            spin(view, robot, ux, uy, m, wheels)
        else:
            dx, dy = around(view, robot, dx, dy, away - m.contact, m)
            go(view, robot, dx, dy, m.top, m, wheels)
        return
    bx, by = soon(view, robot, m)
    dx, dy = to_pose(x, y, bx - m.touch * ux, by - m.touch * uy, ux, uy, m)
    dx, dy = around(view, robot, dx, dy, away, m)
    go(view, robot, dx, dy, m.top, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def support(view: F64, robot: int, place: int, rule: Record, m: Measures, wheels: F64) -> None:
    """Stay between the ball and the own goal; spin at a ball that is at hand.

    A supporter is the further off, the more of them, ``place``, come before it. While the ball is the
    keeper's, it waits on the other side of the pitch.
    """
    bx, by = view[BALL, X], view[BALL, Y]
    if at_hand(view, robot, m):
        spin(view, robot, 1.0, 0.0, m, wheels)
        return
    if rule["clears"] and for_keeper(view, m):
        wait(view, robot, -m.goal_x + m.area_depth + _CLEAR * m.radius, -by, m, wheels)
        return
    dx, dy = -m.goal_x - bx, -by
    length = max(math.hypot(dx, dy), m.radius)
    off = (1 + place) * _SUPPORT * m.radius
    if bx > 0.0:
        off += bx  # the rebound of a shot comes further back
    wait(view, robot, bx + off * dx / length, by + off * dy / length, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def wait(view: F64, robot: int, x: float, y: float, m: Measures, wheels: F64) -> None:
    """Drive to a place, or the nearest to it that is outside the own goal area and off the walls."""
    margin = 1.5 * m.radius
    x, y = clamp(x, m.goal_x - margin), clamp(y, m.half_width - margin)
    if in_area(x, y, margin, m):
        x = -m.goal_x + m.area_depth + margin
    dx, dy = x - view[robot, X], y - view[robot, Y]
    left = math.hypot(dx, dy)
    if left < 0.5 * m.radius:
        set_wheels(0.0, 0.0, robot, m, wheels)
        return
    dx, dy = around(view, robot, dx, dy, left, m)
    go(view, robot, dx, dy, min(m.top, 0.5 * m.arrival * left), m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def go(view: F64, robot: int, dx: float, dy: float, speed: float, m: Measures, wheels: F64) -> None:
    """Drive in a direction, not into walls and not into the own goal area."""
    sx, sy = along_walls(view, robot, dx, dy, m)
    if sx != 0.0 or sy != 0.0:
        dx, dy = sx, sy
    if in_area(view[robot, X], view[robot, Y], 1.5 * m.radius, m):
        if abs(view[robot, Y]) < m.area_half_width:
            dx = max(dx, 0.5 * abs(dy) + 1e-9)
        elif view[robot, Y] * dy < 0.0:
            dy = 0.0
    steer(view, robot, dx, dy, speed, EITHER, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def at_hand(view: F64, robot: int, m: Measures) -> bool:
    """True if the ball is near enough to spin at, and not behind."""
    return bool(distance(view, robot, BALL) < _SPIN * m.radius and not_behind(view, robot, m))


@njit(cache=True, nogil=True, error_model="numpy")
def not_behind(view: F64, robot: int, m: Measures) -> bool:
    """True if the ball is ahead of a robot or beside it."""
    return bool(view[BALL, X] > view[robot, X] - m.radius)


@njit(cache=True, nogil=True, error_model="numpy")
def for_keeper(view: F64, m: Measures) -> bool:
    """True if only the goalkeeper plays the ball: in the own goal area, or to be played from within it."""
    x, y = view[BALL, X], view[BALL, Y]
    ux, uy = shot(view, m)
    px, py = run_up(x, y, ux, uy, m)
    return in_area(x, y, m.radius, m) or in_area(px, py, 0.0, m)


@njit(cache=True, nogil=True, error_model="numpy")
def left_to_keeper(view: F64, rule: Record, m: Measures) -> bool:
    """True if field players leave the ball to the keeper."""
    return for_keeper(view, m) or (rule["yields"] and comes_in(view, m))


@njit(cache=True, nogil=True, error_model="numpy")
def comes_in(view: F64, m: Measures) -> bool:
    """True if the ball will be in the own goal area after ``_YIELD_S`` if it rolls on as it does."""
    x, y = view[BALL, X] + _YIELD_S * view[BALL, VX], view[BALL, Y] + _YIELD_S * view[BALL, VY]
    return in_area(x, y, m.radius, m)


@njit(cache=True, nogil=True, error_model="numpy")
def in_area(x: float, y: float, margin: float, m: Measures) -> bool:
    """True if a place is in the own goal area, made larger by a margin."""
    return bool(x < -m.goal_x + m.area_depth + margin and abs(y) < m.area_half_width + margin)


@njit(cache=True, nogil=True, error_model="numpy")
def run_up(x: float, y: float, ux: float, uy: float, m: Measures) -> tuple[float, float]:
    """Place at which a robot gets ready to drive a ball at (x, y) in the direction (ux, uy), metres."""
    return x - _RUN_UP * m.radius * ux, y - _RUN_UP * m.radius * uy


@njit(cache=True, nogil=True, error_model="numpy")
def cramped(x: float, y: float, ux: float, uy: float, m: Measures) -> bool:
    """True if a wall leaves no room beside a ball, or behind it to get ready for the direction (ux, uy)."""
    side = 2.0 * m.radius
    if abs(y) > m.half_width - side or (abs(x) > m.goal_x - side and abs(y) > m.half_goal):
        return True
    px, py = run_up(x, y, ux, uy, m)
    return bool(abs(px) > m.goal_x - m.radius or abs(py) > m.half_width - m.radius)


@njit(cache=True, nogil=True, error_model="numpy")
def get_free(view: F64, robot: int, rule: Record, m: Measures, own: Record, wheels: F64) -> None:
    """Back off for a while if the wheels turn but the robot has been held for long.

    The robot's wanted ``wheels`` are overwritten while it backs off. Its record ``own`` counts the frames.
    """
    left, right = wheels[robot - 1, 0], wheels[robot - 1, 1]
    if own["escaping"] > 0 and rule["escapes"] and own["job"] != KEEPER:
        toward = along(view, robot, -1.0, 0.0) * (own["left"] + own["right"]) > 0.0
        if toward and in_area(view[robot, X], view[robot, Y], 2.0 * m.radius, m):
            own["escaping"] = 0
    if own["escaping"] > 0:
        own["escaping"] -= 1
        wheels[robot - 1, 0], wheels[robot - 1, 1] = own["left"], own["right"]
        return
    own["stuck"] = own["stuck"] + 1 if held(view, robot, m, wheels) else 0
    if own["stuck"] * m.frame_s > _STUCK_S:
        own["stuck"] = 0
        own["escaping"] = math.floor(_ESCAPE_S / m.frame_s)
        sign = -1.0 if left + right > 0.0 else 1.0
        # it backs off in a bend toward the middle of the pitch, away from the wall
        inner = along(view, robot, -view[robot, Y], view[robot, X])
        slow, fast = 0.3 * sign * m.top, 0.8 * sign * m.top
        own["left"], own["right"] = (slow, fast) if inner > 0.0 else (fast, slow)


@njit(cache=True, nogil=True, error_model="numpy")
def shot(view: F64, m: Measures) -> tuple[float, float]:
    """Direction of length 1 from the ball to the part of the goal that the adversary leaves open."""
    bx, by = view[BALL, X], view[BALL, Y]
    count = (view.shape[0] - 1) // 2
    keeper, least = 0, np.inf
    for other in range(count + 1, 2 * count + 1):
        off = math.hypot(view[other, X] - m.goal_x, view[other, Y])
        if off < least:
            keeper, least = other, off
    # opposite to the keeper, at most half-way to the post
    aim = -0.5 * clamp(view[keeper, Y], m.half_goal)
    # a ball beside the goal line's end of the pitch is first brought before the goal
    dx, dy = max(m.goal_x - bx, m.radius), aim - by
    if abs(by) > m.half_width - 1.5 * m.radius and bx < m.goal_x - m.area_depth:
        dy = 0.0  # along the side wall
    return unit_vector(dx, dy)
