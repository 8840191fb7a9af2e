"""The team whose robots only move randomly: 194, again and again."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from pitchlore.pipeline.arena.teams.people import People
from pitchlore.pipeline.game.bodies import Records
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.executors.actions import ACTION
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.splitmix import SplitMix
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.schemas.situations import MOVES_RANDOMLY

# Nobody's role matters to 194.
_NO_ROLES: I64 = np.zeros(0, dtype=np.int64)


def new_memory(robots: int, m: Measures, rng: Generator, people: People) -> tuple[Records]:
    """Records of ``ACTION``, [N]: the memory before a match; only ``robots``, N, counts."""
    return (np.zeros(robots, dtype=ACTION),)


@njit(cache=True, nogil=True, error_model="numpy")
def play(view: F64, packed: Records, splitmix: SplitMix, wheels: F64, actions: Records) -> None:
    """Play one frame, see :class:`pipeline.arena.teams.table.Script`."""
    m = packed[0]
    for robot in range(1, len(actions) + 1):
        own = actions[robot - 1]
        if own["code"] == 0:
            executors.start(MOVES_RANDOMLY, robot, view, _NO_ROLES, m, splitmix, own)
        if executors.act(robot, view, m, own, wheels):
            own["code"] = 0
