"""The team whose robots only move randomly: 194, again and again."""

from __future__ import annotations

import numpy as np
from numba import njit

from pipeline.arena.teams import executors
from pipeline.arena.teams.dice import Dice
from pipeline.arena.teams.measures import Measures
from pipeline.arena.teams.roles import I64
from pipeline.bodies import F64
from schemas.situations import MOVES_RANDOMLY

# Nobody's role matters to 194.
_NO_ROLES: I64 = np.zeros(0, dtype=np.int64)


def new_memory(robots: int) -> F64:
    """The memory of a team before a game: float64 [N, executors.FIELDS], a row a robot."""
    return np.zeros((robots, executors.FIELDS))


@njit(cache=True, nogil=True, error_model="numpy")
def play(view: F64, memory: F64, m: Measures, dice: Dice, wheels: F64) -> None:
    """One frame of the team; see :func:`pipeline.arena.teams.teams.play`."""
    for robot in range(1, wheels.shape[0] + 1):
        own = memory[robot - 1]
        if own[executors.CODE] == 0.0:
            executors.start(MOVES_RANDOMLY, robot, view, _NO_ROLES, m, dice, own)
        if executors.act(robot, view, m, own, wheels):
            own[executors.CODE] = 0.0
