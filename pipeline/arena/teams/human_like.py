"""A second script: a family of teams with delays, noise and changing tactics; it is no model of anyone.

The person drives one robot at a time, imperfectly, and sees the ball and the other team late by a reaction
time. The rest of the team follows the static rules at a slower pace. Reaction, steadiness, skill, patience
and tactics differ from person to person, and are drawn anew for each game.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from pitchlore.pipeline.arena.teams import static
from pitchlore.pipeline.arena.teams.people import TACTICS, People
from pitchlore.pipeline.arena.teams.static import ATTACKER, KEEPER
from pitchlore.pipeline.game.bodies import BALL, COLUMNS, THETA, VX, VY, Records, X
from pitchlore.pipeline.game.tactics.geometry import distance, offset
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.splitmix import SplitMix, normal
from pitchlore.pipeline.game.tactics.steering import EITHER, FRONT, around, steer
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

_AGGRESSIVE, _DEFENSIVE, _CHASER = range(len(TACTICS))

#: What somebody is like, and does now: index of the tactic; standard deviation of the wobble, radians; its
#: correlation from frame to frame; shares of the top speed of the driven robot and of the others; frames
#: between switches; frames played; the row of the robot that is driven; its error of direction, radians.
PERSON = np.dtype([
    ("tactic", np.int64), ("wobble", np.float64), ("keeps", np.float64), ("skill", np.float64),
    ("pace", np.float64), ("switch", np.int64), ("frames", np.int64), ("driven", np.int64),
    ("off", np.float64),
])  # fmt: skip


def new_memory(
    robots: int, m: Measures, rng: Generator, people: People
) -> tuple[Records, Records, Records, F64]:
    """The memory of a team before a match, for somebody who is drawn from ``people``.

    Returns:
        Records of ``static.ROBOT``, [N], and ``static.RULES``, [1]; the person, a record of :data:`PERSON`,
        [1]; the last views, a ring, float64 [delay + 1, 1 + 2 N, 6].
    """
    delay, wobble, lasting, skill, pace, switch = (
        float(rng.uniform(*span))
        for span in (
            people.delay_s, people.wobble_rad, people.wobble_s, people.skill, people.pace, people.switch_s
        )
    )  # fmt: skip
    person = np.zeros(1, dtype=PERSON)
    person["tactic"] = TACTICS.index(people.tactics[int(rng.integers(len(people.tactics)))])
    person["wobble"] = wobble
    person["keeps"] = math.exp(-m.frame_s / lasting) if lasting > 0 else 0.0
    person["skill"], person["pace"] = skill, pace
    person["switch"] = max(round(switch / m.frame_s), 1)
    ring = np.zeros((round(delay / m.frame_s) + 1, 1 + 2 * robots, COLUMNS))
    return (*static.new_memory(robots, m, rng, people), person, ring)


@njit(cache=True, nogil=True, error_model="numpy")
def play(
    view: F64, packed: Records, splitmix: SplitMix, wheels: F64, robots: Records, rules: Records,
    persons: Records, ring: F64,
) -> None:
    """Play one frame, see :class:`pipeline.arena.teams.table.Script`."""
    m, rule, person = packed[0], rules[0], persons[0]
    seen = _seen(view, len(robots), person["frames"], ring)
    static.share_out(seen, m, robots)
    if person["frames"] % person["switch"] == 0:
        person["driven"] = _choose(seen, person["tactic"], robots)
    person["frames"] += 1
    keeps = person["keeps"]
    noise = math.sqrt(1.0 - keeps * keeps) * person["wobble"] * normal(splitmix)
    person["off"] = keeps * person["off"] + noise
    driven, tactic = person["driven"], person["tactic"]
    place = 0
    for robot in range(1, len(robots) + 1):
        own = robots[robot - 1]
        job, share = own["job"], person["pace"]
        if robot == driven:
            share = person["skill"]
            seen[robot, THETA] += person["off"]
        if robot == driven and tactic == _CHASER:
            _chase(seen, robot, m, wheels)
        elif job == ATTACKER or (robot == driven and job != KEEPER and tactic == _AGGRESSIVE):
            static.attack(seen, robot, rule, m, wheels)
        elif job == KEEPER:
            static.guard(seen, robot, m, wheels)
        else:
            static.support(seen, robot, place, rule, m, wheels)
            place += 1
        if robot == driven:
            seen[robot, THETA] = view[robot, THETA]
        wheels[robot - 1, 0] *= share
        wheels[robot - 1, 1] *= share
        static.get_free(seen, robot, rule, m, own, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _seen(view: F64, count: int, frame: int, ring: F64) -> F64:
    """The view of the person: the own N robots as they are (people feel what they do), the rest late.

    The view is put into ``ring``, the last ones; ``frame`` counts those that have been played.
    """
    now, then = ring[frame % len(ring)], ring[(frame + 1) % len(ring) if frame + 1 >= len(ring) else 0]
    seen = np.empty(view.shape)
    for row in range(len(view)):  # to copy whole rows numba compiles the text of their errors, for seconds
        late = row == BALL or row > count
        for column in range(COLUMNS):
            now[row, column] = view[row, column]
            seen[row, column] = then[row, column] if late else view[row, column]
    return seen


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(seen: F64, tactic: int, robots: Records) -> int:
    """The robot to drive: the attacker, the nearest to the ball, or in defence the nearest behind it."""
    best, least = 1, np.inf
    for robot in range(1, len(robots) + 1):
        if tactic == _AGGRESSIVE and robots[robot - 1]["job"] == ATTACKER:
            return robot
        cost = distance(seen, robot, BALL)
        if tactic == _DEFENSIVE and seen[robot, X] > seen[BALL, X]:
            cost += 2.0 * (seen[robot, X] - seen[BALL, X])
        if cost < least:
            best, least = robot, cost
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _chase(seen: F64, robot: int, m: Measures, wheels: F64) -> None:
    """Drive straight at the ball, except from ahead of it toward the own goal's mouth: round it."""
    dx, dy = offset(seen, robot, BALL)
    away = math.hypot(dx, dy)
    ahead = dx < 0.0 and away < m.close
    if ahead:
        side = 1.0 if dy <= 0.0 else -1.0
        dx, dy = around(seen, robot, dx, dy + side * 3.0 * m.radius, away, m)
    later = min(away / m.top, 0.3)
    dx, dy = dx + later * seen[BALL, VX], dy + later * seen[BALL, VY]
    steer(seen, robot, dx, dy, m.top, EITHER if ahead else FRONT, m, wheels)
