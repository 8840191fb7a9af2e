"""The team that plays a policy: each robot looks up the behaviour for its role in the state that it sees.

A robot decides when play starts and whenever its behaviour is over. A clock may let behaviours last longer
and interrupt them (:mod:`pipeline.arena.teams.clock`). The robot looks up the state by the finest
key that knows it, and takes the behaviour of the greatest value, with ties broken at random. With
probability ``explore`` it takes any behaviour of the state. If no key knows the state, it moves randomly,
as the paper's learner does in new states (section 4). A behaviour is its codes in order; each lasts until
its executor says that it is over.

Where codes whose end holds already are not begun, a robot chooses among the behaviours of the state that
have a code to begin. If none has, it chooses among all, and begins the first code all the same.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.arena.teams.clock import Clock
from pitchlore.pipeline.arena.teams.policy_table import LONGEST, RANDOMLY, PolicyTable
from pitchlore.pipeline.game.bodies import BALL, VX, VY, Records, X, Y
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.ball import OWN, holder
from pitchlore.pipeline.game.tactics.executors.actions import ACTION
from pitchlore.pipeline.game.tactics.geometry import speed_of
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.game.tactics.splitmix import SplitMix, normal, uniform
from pitchlore.pipeline.numbers.arrays import F64, I64, U8
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.state import DRAWING, NORMAL, BinEdges, Observation, Radix, abstract_state, encode_one
from pitchlore.pipeline.state.table import ELEMENTS

#: What a robot remembers: its action, whose code is 0 if it is over; the row of its behaviour in the policy
#: table, -1 if it has none; the place in the behaviour of the code that it executes; the role that it decided
#: in; frames since then; whether the behaviour was over since then; whether it has to decide.
ROBOT = np.dtype([
    ("action", ACTION), ("behaviour", np.int64), ("place", np.int64), ("role", np.int64),
    ("frames", np.int64), ("over", np.bool_), ("decides", np.bool_),
])
#: A decision: the robot's number; index of its role; the state by all elements; the row of the behaviour in
#: the policy table; 1 if it was chosen at random.
DECISION = np.dtype([(name, np.int64) for name in ("robot", "role", "state", "behaviour", "random")])


class BehaviourPolicy(NamedTuple):
    """The knowledge and settings that a learned team decides by.

    Attributes:
        table: the values of behaviours in states.
        whole: digits of the key that keeps all elements; decisions are logged with it.
        edges: edges of the pitch.
        explore: chance that a robot takes any behaviour of the state instead of the best, in [0, 1].
        clock: when robots decide.
    """

    table: PolicyTable
    whole: Radix
    edges: BinEdges
    explore: float
    clock: Clock


@njit(cache=True, nogil=True, error_model="numpy")
def sample_values(
    table: PolicyTable, posterior_std: float, lcb_weight: float, splitmix: SplitMix, out: F64
) -> None:
    """Draw the values by which a team plays until play stops into ``out``, float64 [A].

    Each is normally distributed around the policy's value less ``lcb_weight`` standard errors, with a
    deviation of ``posterior_std`` standard errors.
    """
    for action in range(len(out)):
        off = posterior_std * normal(splitmix) if posterior_std > 0.0 else 0.0
        out[action] = table.values[action] + (off - lcb_weight) * table.standard_errors[action]


@njit(cache=True, nogil=True, error_model="numpy")
def ball_direction(view: F64, before: float, moving: float) -> float:
    """Direction of the ball's last motion, radians: ``before`` while it is slower than ``moving``, m/s."""
    return math.atan2(view[BALL, VY], view[BALL, VX]) if speed_of(view, BALL) >= moving else before


@njit(cache=True, nogil=True, error_model="numpy")
def observe_levels(view: F64, direction: float, lead: int, roles: I64, edges: BinEdges, elements: U8) -> None:
    """Write the levels of the 36 elements as the team sees them into ``elements``, uint8 [36].

    ``roles`` are those of the robots of rows 1 to 2 N of the view, int64 [2 N]; see :func:`decide` for the
    others.
    """
    sides = np.zeros(len(roles), dtype=np.int64)
    sides[len(roles) // 2:] = 1
    ball = np.array([view[BALL, X], view[BALL, Y], view[BALL, VX], view[BALL, VY]])
    score = DRAWING + (1 if lead > 0 else (-1 if lead < 0 else 0))
    bodies = np.ascontiguousarray(view[1:, :3])
    seen = Observation(bodies, sides, roles, ball, 1.0, direction, score, NORMAL)
    abstract_state(seen, edges, elements)


@njit(cache=True, nogil=True, error_model="numpy")
def forget_choices(robots: Records) -> None:
    """Play is on anew: all robots have to decide, and go on with nothing."""
    for robot in range(len(robots)):
        own = robots[robot]
        own["action"]["code"], own["behaviour"], own["decides"] = 0, -1, True


@njit(cache=True, nogil=True, error_model="numpy")
def interrupt(view: F64, robots: Records, before: int, packed: Records) -> tuple[int, bool]:
    """Interrupt behaviours by the events of a frame: the team wins or loses the ball, a robot's role changes.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        robots: records of :data:`ROBOT`, [N]; those that have to decide are marked.
        before: the team that had the ball at the frame before, see :func:`pipeline.game.tactics.ball.holder`.
        packed: measures, ``Measures.packed()``.

    Returns:
        The team that has the ball, and whether a robot has to decide.
    """
    m = packed[0]
    has = holder(view, before, m)
    changed = has != before and OWN in (has, before)
    roles = np.empty(2 * len(robots), dtype=np.int64)
    assign(view, m, roles)
    due = False
    for robot in range(len(robots)):
        own = robots[robot]
        if changed or own["role"] != roles[robot]:
            own["decides"] = due = True
    return has, due


@njit(cache=True, nogil=True, error_model="numpy")
def decide(
    view: F64, direction: float, lead: int, robots: Records, policy: BehaviourPolicy, packed: Records,
    splitmix: SplitMix, decisions: Records,
) -> int:  # fmt: skip
    """Decide for each robot that has to. Who chooses the behaviour or code that it is doing goes on with it.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        direction: direction of the ball's last motion, radians; NaN if it never moved.
        lead: own goals minus the adversary's.
        robots: records of :data:`ROBOT`, [N], as the frames before left them.
        policy: the values, and how they are explored.
        packed: measures, ``Measures.packed()``.
        splitmix: draws ties and exploration.
        decisions: records of :data:`DECISION`, [N], written from the first on.

    Returns:
        Number of decisions, 0 to N.
    """
    m = packed[0]
    count = len(robots)
    roles = np.empty(2 * count, dtype=np.int64)
    elements = np.zeros(ELEMENTS, dtype=np.uint8)
    assign(view, m, roles)
    observe_levels(view, direction, lead, roles, policy.edges, elements)
    made = 0
    for robot in range(1, count + 1):
        own = robots[robot - 1]
        if not own["decides"]:
            continue
        role = roles[robot - 1]
        behaviour, place, random = _choose(robot, view, roles, elements, m, policy, splitmix)
        if behaviour != own["behaviour"] or own["over"]:
            code = policy.table.codes[behaviour, place]
            if code != own["action"]["code"]:
                executors.start(code, robot, view, roles, m, splitmix, own["action"])
            own["behaviour"], own["place"] = behaviour, place
        own["role"], own["frames"], own["over"], own["decides"] = role, 0, False, False
        decision = decisions[made]
        decision["robot"], decision["role"] = robot, role
        decision["state"] = encode_one(elements, policy.whole)
        decision["behaviour"], decision["random"] = behaviour, random
        made += 1
    return made


@njit(cache=True, nogil=True, error_model="numpy")
def carry_on(
    view: F64, robots: Records, codes: I64, clock: Clock, packed: Records, splitmix: SplitMix, wheels: F64
) -> bool:
    """Carry on all behaviours for a frame.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        robots: after :func:`decide`: every robot has a behaviour.
        codes: codes of the policy table.
        clock: when robots decide.
        packed: measures, ``Measures.packed()``.
        splitmix: draws the wheels of random moves.
        wheels: float64 [N, 2], written.

    Returns:
        Whether a robot has to decide before the next frame.
    """
    m = packed[0]
    count = len(robots)
    roles = np.empty(2 * count, dtype=np.int64)
    due = False
    for robot in range(1, count + 1):
        own = robots[robot - 1]
        action, behaviour = own["action"], own["behaviour"]
        if action["code"] == 0:
            assign(view, m, roles)
            executors.start(codes[behaviour, own["place"]], robot, view, roles, m, splitmix, action)
        ends = executors.act(robot, view, m, action, wheels)
        own["frames"] += 1
        if ends and not own["over"]:
            assign(view, m, roles)
            place = _next(codes[behaviour], own["place"] + 1, robot, view, roles, m, clock)
            if place < LONGEST:
                own["place"] = place
                executors.start(codes[behaviour, place], robot, view, roles, m, splitmix, action)
                continue
            own["over"] = True
        if ends:
            action["code"] = 0
        if own["over"] and own["frames"] >= clock.least:
            own["decides"] = due = True
    return due


@njit(cache=True, nogil=True, error_model="numpy")
def _next(
    codes: I64, place: int, robot: int, view: F64, roles: I64, m: Measures, clock: Clock
) -> int:
    """The first place from ``place`` on with a code to begin, in a behaviour's codes, int64 [4].

    It is :data:`LONGEST` if there is none.
    """
    scratch = np.zeros(1, dtype=ACTION)[0]
    while place < LONGEST and codes[place] > 0:
        if clock.begin_ended or not executors.has_ended(codes[place], robot, view, roles, m, scratch):
            return place
        place += 1
    return LONGEST


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(
    robot: int, view: F64, roles: I64, elements: U8, m: Measures, policy: BehaviourPolicy, splitmix: SplitMix
) -> tuple[int, int, int]:
    """Row of the behaviour, place of the code that it begins with, and whether it was chosen at random."""
    table, role = policy.table, roles[robot - 1]
    for key in range(len(table.digits)):
        low, high = table.starts[key, role, 0], table.starts[key, role, 1]
        state = encode_one(elements, Radix(table.digits[key, role], table.levels[key, role]))
        at = low + np.searchsorted(table.states[low:high], state)
        if at == high or table.states[at] != state:
            continue
        offered = table.actions[table.first[at] : table.first[at + 1]]
        values = table.values[table.first[at] : table.first[at + 1]]
        places = np.zeros(len(offered), dtype=np.int64)
        if not policy.clock.begin_ended:
            for i in range(len(offered)):
                places[i] = _next(table.codes[offered[i]], 0, robot, view, roles, m, policy.clock)
            if places.min() == LONGEST:
                places[:] = 0
        if uniform(splitmix) < policy.explore:
            left = int(uniform(splitmix) * np.sum(places < LONGEST))
            for i in range(len(offered)):
                if places[i] == LONGEST:
                    continue
                if left == 0:
                    return offered[i], places[i], 1
                left -= 1
        best, ties = int(np.argmin(places)), 0
        for i in range(best, len(offered)):
            if places[i] == LONGEST:
                continue
            if values[i] > values[best]:
                best, ties = i, 1
            elif values[i] == values[best]:
                ties += 1
                if uniform(splitmix) * ties < 1.0:
                    best = i
        return offered[best], places[best], 0
    return RANDOMLY, 0, 1
