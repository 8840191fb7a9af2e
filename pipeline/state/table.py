"""The 36 elements of Table 2 and their levels.

Every element of a robot is relative to that robot's *own* team's goals. Levels count from 0; those
that the paper does not state are ours (docs/decisions/paper.md).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.schemas import ROLES

SLOTS = tuple(f"{side} {role}" for side in ("own", "adversary's") for role in ROLES)
DRAWING = 1
NORMAL, FAULT, GOAL = 0, 1, 2

# First element of each row of Table 2, in its order.
BALL_DISTANCE, GOAL_DISTANCE, BALL_ORIENTATION, GOAL_ORIENTATION = 0, 6, 8, 14
AFTER_BALL, DIRECTION, SPEED, SCORE, SITUATION = 26, 32, 33, 34, 35
ELEMENTS = 36


class Element(NamedTuple):
    """One element of the state.

    Attributes:
        name: the quantity and whose it is.
        levels: their names, level 0 first.
    """

    name: str
    levels: tuple[str, ...]


#: The 36 elements in the order of Table 2.
TABLE = (
    *(Element(f"distance of {slot} to ball", ("too close", "near", "far")) for slot in SLOTS),
    *(Element(f"distance of ball to {goal} goal", ("very close", "close", "far"))
      for goal in ("own", "adversary's")),
    *(Element(f"orientation of {slot} to ball", ("front", "side", "back")) for slot in SLOTS),
    *(Element(f"orientation of {slot} to {goal} goal", ("away", "pointing"))
      for slot in SLOTS for goal in ("its own", "its adversary's")),
    *(Element(f"{slot} in relation to ball and its own goal", ("before", "after")) for slot in SLOTS),
    Element("ball direction", tuple(f"{45 * sector} degrees" for sector in range(8))),
    Element("ball velocity", ("slow", "medium", "fast")),
    Element("score", ("losing", "drawing", "winning")),
    Element("game situation", ("normal", "fault", "goal")),
)
LEVELS: I64 = np.array([len(element.levels) for element in TABLE], dtype=np.int64)
