"""Each code as an action: its controller, its aim, its time limit; and a robot's memory of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.game.bodies import BALL, X, Y
from pitchlore.pipeline.game.tactics.geometry import offset
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.schemas.situations import MOVES_RANDOMLY

#: Controllers; ``control`` calls them.
HOLD, GUIDE, KICK, GIVE, LEAVE, RECEDE, REACH, RECEIVE = range(8)
APPROACH, BLOCK, FACE, LEVEL_X, LEVEL_Y, STAND, WANDER = range(8, 15)
#: Kinds of aims.
THE_BALL, OWN_GOAL, ADVERSARY_GOAL, OPPONENT, TEAMMATE = range(5)


class Action(NamedTuple):
    """The action of a code.

    Attributes:
        verb: the controller.
        thing: the kind of its aim.
        role: an opponent's role, or the number of roles that a teammate is ahead; -1 for any: a near
            one beyond the ball.
        limit_s: longest time that it lasts, seconds.
    """

    verb: int
    thing: int = THE_BALL
    role: int = -1
    limit_s: float = 1.0


_ACTIONS: dict[int, Action] = {
    1: Action(HOLD),
    11: Action(GUIDE),
    21: Action(KICK),
    22: Action(GIVE, OPPONENT),
    23: Action(GIVE, TEAMMATE),
    33: Action(LEAVE),
    34: Action(RECEDE),
    44: Action(REACH),
    45: Action(RECEIVE),
    46: Action(APPROACH),
    47: Action(BLOCK),
    57: Action(FACE),
    67: Action(LEVEL_X),
    68: Action(LEVEL_Y),
    78: Action(FACE, OWN_GOAL),
    88: Action(APPROACH, OWN_GOAL),
    98: Action(RECEDE, OWN_GOAL),
    108: Action(FACE, ADVERSARY_GOAL),
    118: Action(APPROACH, ADVERSARY_GOAL),
    128: Action(RECEDE, ADVERSARY_GOAL),
    **{138 + role: Action(APPROACH, OPPONENT, role) for role in range(3)},
    **{150 + role: Action(RECEDE, OPPONENT, role) for role in range(3)},
    **{161 + ahead: Action(APPROACH, TEAMMATE, ahead) for ahead in (1, 2)},
    **{172 + ahead: Action(RECEDE, TEAMMATE, ahead) for ahead in (1, 2)},
    184: Action(STAND),
    MOVES_RANDOMLY: Action(WANDER, limit_s=0.4),
}

#: The codes that robots have an action for, ascending.
CODES: tuple[int, ...] = tuple(sorted(_ACTIONS))
#: The table by code for compiled functions, int64 [195] and float64 [195]; -1 and 0 of what is no code.
VERB, THING, ROLE = np.full((3, max(_ACTIONS) + 1), -1, dtype=np.int64)
LIMIT_S = np.zeros(max(_ACTIONS) + 1)
for _code, _action in _ACTIONS.items():
    VERB[_code], THING[_code], ROLE[_code], LIMIT_S[_code] = _action

#: What a robot remembers of its action: its code, 0 if none; frames since it began; the row of the other
#: robot it is done to, -1 if none; the distance at which it is over, metres, NaN if none is; frames for
#: which a condition has lasted; whether the robot has had the ball; the wheels of a random move, m/s.
ACTION = np.dtype([
    ("code", np.int64), ("frames", np.int64), ("other", np.int64), ("level", np.float64),
    ("lasted", np.int64), ("had_ball", np.bool_), ("left", np.float64), ("right", np.float64),
])  # fmt: skip
#: Value of ``lasted`` once a ball was let go.
GONE = -1


@njit(cache=True, nogil=True, error_model="numpy")
def to_aim(view: F64, robot: int, thing: int, other: int, m: Measures) -> tuple[float, float]:
    """The vector from a robot to its aim; an opponent or teammate is the robot of row ``other``."""
    if thing < OWN_GOAL or thing > ADVERSARY_GOAL:
        return offset(view, robot, max(other, BALL))
    goal_x = -m.goal_x if thing == OWN_GOAL else m.goal_x
    return goal_x - view[robot, X], 0.0 - view[robot, Y]
