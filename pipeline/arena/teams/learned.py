"""The team that plays a policy: each robot by itself looks up what its role does in the state it sees.

A robot decides when play starts and whenever its behaviour is over. It looks for the state by the finest
key that knows it, there takes the behaviour of the greatest value (ties at random), now and then any that
the state offers. Where nothing is known it moves randomly, as the paper's learner does in new states
(section 4). A behaviour is its codes in order; each lasts until its executor says that it is over.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from pipeline.arena.teams import executors
from pipeline.arena.teams.dice import Dice, normal, uniform
from pipeline.arena.teams.geometry import speed_of
from pipeline.arena.teams.measures import Packed
from pipeline.arena.teams.playbook import LONGEST, RANDOMLY, Playbook
from pipeline.arena.teams.roles import I64, assign
from pipeline.bodies import BALL, F64, VX, VY, X, Y
from pipeline.state import DRAWING, NORMAL, Breaks, encode_one, look
from pipeline.state.table import U8

#: Columns of a robot's row of the memory after those of its executor: the row of its behaviour in the
#: playbook, -1 if it has to decide; the place in it of the code that it executes.
BEHAVIOUR, PLACE = executors.FIELDS, executors.FIELDS + 1
#: Column of the team's row, the last: direction of the ball's last motion, radians, NaN if it never moved.
DIRECTION = 0

#: Columns of a decision: the robot; its role; the state by all elements; the row of the behaviour in the
#: playbook; whether it was chosen at random; the key whose values decided, -1 if none knew the state.
ROBOT, ROLE, STATE, CHOSEN, RANDOM, KEY = range(6)
COLUMNS = 6


def new_memory(robots: int) -> F64:
    """The memory of a team before a game: float64 [N + 1, columns], a row a robot and the team's."""
    memory = np.zeros((robots + 1, PLACE + 1))
    forget(memory)
    return memory


@njit(cache=True, nogil=True, error_model="numpy")
def forget(memory: F64) -> None:
    """Make every robot decide anew: play has been restarted."""
    memory[:, :] = 0.0
    memory[:-1, BEHAVIOUR] = -1.0
    memory[-1, DIRECTION] = np.nan


@njit(cache=True, nogil=True, error_model="numpy")
def believe(values: F64, doubts: F64, doubt: float, caution: float, dice: Dice, believed: F64) -> None:
    """Draw what a team believes its actions to be worth until play stops; all arrays float64 [A]."""
    for action in range(len(values)):
        off = doubt * normal(dice) if doubt > 0.0 else 0.0
        believed[action] = values[action] + (off - caution) * doubts[action]


@njit(cache=True, nogil=True, error_model="numpy")
def watch_ball(view: F64, memory: F64, moving: float) -> None:
    """Remember where the ball moves; it keeps its direction while it is slower than ``moving``, m/s."""
    if speed_of(view, BALL) >= moving:
        memory[-1, DIRECTION] = math.atan2(view[BALL, VY], view[BALL, VX])


@njit(cache=True, nogil=True, error_model="numpy")
def decide(
    view: F64, lead: int, memory: F64, book: Playbook, all_digits: I64, all_levels: I64,
    explore: float, breaks: Breaks, packed: Packed, dice: Dice, made: I64,
) -> int:
    """Let those robots decide that have to.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        lead: own goals minus the adversary's.
        memory: as :func:`new_memory` made it and the frames before left it.
        book: what is known.
        all_digits: int64 [36], of the key that keeps all elements (``pipeline.state.radix``).
        all_levels: int64 [36], likewise.
        explore: chance that a robot takes any behaviour of the state instead of the best.
        breaks: of the pitch.
        packed: measures, ``Measures.packed()``.
        dice: rolled for ties and exploration.
        made: int64 [N, COLUMNS], written: the decisions.

    Returns:
        How many were made.
    """
    m = packed[0]
    count = memory.shape[0] - 1
    roles = np.empty(2 * count, dtype=np.int64)
    sides = np.zeros(2 * count, dtype=np.int64)
    sides[count:] = 1
    elements = np.zeros(36, dtype=np.uint8)
    assign(view, m, roles)
    ball = np.array([view[BALL, X], view[BALL, Y], view[BALL, VX], view[BALL, VY]])
    score = DRAWING + (1 if lead > 0 else (-1 if lead < 0 else 0))
    look(
        np.ascontiguousarray(view[1:, :3]), sides, roles, ball, 1.0, memory[-1, DIRECTION], score, NORMAL,
        breaks, elements,
    )
    decided = 0
    for robot in range(1, count + 1):
        own = memory[robot - 1]
        if own[BEHAVIOUR] >= 0.0:
            continue
        role = roles[robot - 1]
        chosen, random, key = _choose(elements, role, book, explore, dice)
        own[BEHAVIOUR], own[PLACE] = chosen, 0.0
        executors.start(book.codes[chosen, 0], robot, view, roles, m, dice, own[:executors.FIELDS])
        made[decided, ROBOT], made[decided, ROLE] = robot, role
        made[decided, STATE] = encode_one(elements, all_digits, all_levels)
        made[decided, CHOSEN], made[decided, RANDOM], made[decided, KEY] = chosen, random, key
        decided += 1
    return decided


@njit(cache=True, nogil=True, error_model="numpy")
def carry_on(view: F64, memory: F64, codes: I64, packed: Packed, dice: Dice, wheels: F64) -> bool:
    """Carry on all behaviours for a frame.

    Args:
        view: float64 [1 + 2 N, 6], the team's.
        memory: after :func:`decide`: every robot has a behaviour.
        codes: of the playbook.
        packed: measures, ``Measures.packed()``.
        dice: rolled by random moves.
        wheels: float64 [N, 2], written.

    Returns:
        Whether a robot has to decide before the next frame.
    """
    m = packed[0]
    count = memory.shape[0] - 1
    due = False
    for robot in range(1, count + 1):
        own = memory[robot - 1]
        if not executors.act(robot, view, m, own[:executors.FIELDS], wheels):
            continue
        place, behaviour = int(own[PLACE]) + 1, int(own[BEHAVIOUR])
        if place < LONGEST and codes[behaviour, place] > 0:
            own[PLACE] = place
            roles = np.empty(2 * count, dtype=np.int64)
            assign(view, m, roles)
            executors.start(codes[behaviour, place], robot, view, roles, m, dice, own[:executors.FIELDS])
        else:
            own[BEHAVIOUR] = -1.0
            due = True
    return due


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(
    elements: U8, role: int, book: Playbook, explore: float, dice: Dice
) -> tuple[int, int, int]:
    """Row of the behaviour, whether it was chosen at random, and by which key."""
    for key in range(len(book.digits)):
        low, high = book.starts[key, role, 0], book.starts[key, role, 1]
        state = encode_one(elements, book.digits[key, role], book.levels[key, role])
        at = low + np.searchsorted(book.states[low:high], state)
        if at == high or book.states[at] != state:
            continue
        first, last = book.first[at], book.first[at + 1]
        if uniform(dice) < explore:
            return book.actions[first + int(uniform(dice) * (last - first))], 1, key
        best, ties = first, 0
        for i in range(first, last):
            if book.values[i] > book.values[best]:
                best, ties = i, 1
            elif book.values[i] == book.values[best]:
                ties += 1
                if uniform(dice) * ties < 1.0:
                    best = i
        return book.actions[best], 0, key
    return RANDOMLY, 1, -1
