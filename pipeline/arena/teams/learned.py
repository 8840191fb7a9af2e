"""The team that plays a policy: each robot looks up the behaviour for its role in the state that it sees.

A robot decides when play starts and whenever its behaviour is over. It looks up the state by the finest
key that knows it, and takes the behaviour of the greatest value, with ties broken at random. With
probability ``explore`` it takes any behaviour of the state. If no key knows the state, it moves randomly,
as the paper's learner does in new states (section 4). A behaviour is its codes in order; each lasts until
its executor says that it is over.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from pipeline.arena.teams import executors
from pipeline.arena.teams.executors.actions import ACTION
from pipeline.arena.teams.geometry import speed_of
from pipeline.arena.teams.policy_table import LONGEST, RANDOMLY, PolicyTable
from pipeline.arena.teams.roles import assign
from pipeline.arena.teams.splitmix import SplitMix, normal, uniform
from pipeline.arrays import F64, I64, U8
from pipeline.bodies import BALL, VX, VY, Records, X, Y
from pipeline.state import DRAWING, NORMAL, BinEdges, Observation, Radix, abstract_state, encode_one
from pipeline.state.table import ELEMENTS

#: What a robot remembers: its action; the row of its behaviour in the policy table, -1 if it has to decide;
#: the place in the behaviour of the code that it executes.
ROBOT = np.dtype([("action", ACTION), ("behaviour", np.int64), ("place", np.int64)])
#: A decision: the robot's number; index of its role; the state by all elements; the row of the behaviour in
#: the policy table; 1 if it was chosen at random.
DECISION = np.dtype([(name, np.int64) for name in ("robot", "role", "state", "behaviour", "random")])


class Policy(NamedTuple):
    """The knowledge and settings that a learned team decides by.

    Attributes:
        table: the values of behaviours in states.
        whole: digits of the key that keeps all elements; decisions are logged with it.
        edges: of the pitch.
        explore: chance that a robot takes any behaviour of the state instead of the best, in [0, 1].
    """

    table: PolicyTable
    whole: Radix
    edges: BinEdges
    explore: float


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
def observe(view: F64, direction: float, lead: int, roles: I64, edges: BinEdges, elements: U8) -> None:
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
def decide(
    view: F64, direction: float, lead: int, robots: Records, policy: Policy, packed: Records,
    splitmix: SplitMix, decisions: Records,
) -> int:  # fmt: skip
    """Decide for each robot whose behaviour is over.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        direction: of the ball's last motion, radians; NaN if it never moved.
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
    observe(view, direction, lead, roles, policy.edges, elements)
    made = 0
    for robot in range(1, count + 1):
        own = robots[robot - 1]
        if own["behaviour"] >= 0:
            continue
        role = roles[robot - 1]
        behaviour, random = _choose(elements, role, policy, splitmix)
        own["behaviour"], own["place"] = behaviour, 0
        code = policy.table.codes[behaviour, 0]
        executors.start(code, robot, view, roles, m, splitmix, own["action"])
        decision = decisions[made]
        decision["robot"], decision["role"] = robot, role
        decision["state"] = encode_one(elements, policy.whole)
        decision["behaviour"], decision["random"] = behaviour, random
        made += 1
    return made


@njit(cache=True, nogil=True, error_model="numpy")
def carry_on(
    view: F64, robots: Records, codes: I64, packed: Records, splitmix: SplitMix, wheels: F64
) -> bool:
    """Carry on all behaviours for a frame.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        robots: after :func:`decide`: every robot has a behaviour.
        codes: of the policy table.
        packed: measures, ``Measures.packed()``.
        splitmix: draws the wheels of random moves.
        wheels: float64 [N, 2], written.

    Returns:
        Whether a robot has to decide before the next frame.
    """
    m = packed[0]
    count = len(robots)
    due = False
    for robot in range(1, count + 1):
        own = robots[robot - 1]
        if not executors.act(robot, view, m, own["action"], wheels):
            continue
        place, behaviour = own["place"] + 1, own["behaviour"]
        if place < LONGEST and codes[behaviour, place] > 0:
            own["place"] = place
            roles = np.empty(2 * count, dtype=np.int64)
            assign(view, m, roles)
            executors.start(codes[behaviour, place], robot, view, roles, m, splitmix, own["action"])
        else:
            own["behaviour"] = -1
            due = True
    return due


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(elements: U8, role: int, policy: Policy, splitmix: SplitMix) -> tuple[int, int]:
    """Row of the behaviour, and whether it was chosen at random."""
    table = policy.table
    for key in range(len(table.digits)):
        low, high = table.starts[key, role, 0], table.starts[key, role, 1]
        state = encode_one(elements, Radix(table.digits[key, role], table.levels[key, role]))
        at = low + np.searchsorted(table.states[low:high], state)
        if at == high or table.states[at] != state:
            continue
        first, last = table.first[at], table.first[at + 1]
        if uniform(splitmix) < policy.explore:
            return table.actions[first + int(uniform(splitmix) * (last - first))], 1
        best, ties = first, 0
        for i in range(first, last):
            if table.values[i] > table.values[best]:
                best, ties = i, 1
            elif table.values[i] == table.values[best]:
                ties += 1
                if uniform(splitmix) * ties < 1.0:
                    best = i
        return table.actions[best], 0
    return RANDOMLY, 1
