"""The grid world, in which two agents must be in the same place at the same time (paper, Figure 3c).

Positions are (row, column), counted from 1, row 1 on top. A position is the cell
``5 * (row - 1) + (column - 1)``. A state is the cells of both agents: ``25 * first + second``.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.stages.paradigms.games.game import Game

SIZE = 5
CELLS = SIZE * SIZE


def _cell(row: int, column: int) -> int:
    return SIZE * (row - 1) + (column - 1)


STARTS = (_cell(5, 1), _cell(5, 5))
SUMMIT = _cell(3, 3)
SUMMIT_REWARD = 10.0
REFUGE = _cell(1, 3)
REFUGE_REWARD = 5.0

#: Rows down and columns to the right of each action: up, down, left, right, stay. The paper names none.
STEPS = ((-1, 0), (1, 0), (0, -1), (0, 1), (0, 0))


def grid_world(k: float, *, punished: Literal["both", "alone"] = "both", stay: bool = False) -> Game:
    """Grid world of section 5 of the paper.

    Both agents move at once and may share a cell. A move off the board leaves the agent in its cell. If both
    are then on (3, 3), each receives 10; if both are on (1, 3), each receives 5; either ends the episode.
    Each step after which exactly one agent is on (3, 3) costs k. All other rewards are 0.

    Args:
        k: penalty as a positive number, at least 0 and finite.
        punished: agents that pay k: both ("they are punished", as printed), or the one on (3, 3) alone.
        stay: add a fifth action, to stay; the paper does not mention it.

    Raises:
        BadSettings: if k or punished is not as above.
    """
    if not (math.isfinite(k) and k >= 0):
        raise BadSettings(f"k cannot be {k}", where="grid world", next_step="Choose a finite k of at least 0")
    if punished not in ("both", "alone"):
        raise BadSettings(
            f"punished cannot be {punished!r}", where="grid world", next_step="Choose both or alone"
        )
    actions = len(STEPS) if stay else len(STEPS) - 1
    down, right = np.array(STEPS[:actions], dtype=np.int64).T
    rows, columns = np.indices((SIZE, SIZE), dtype=np.int64).reshape(2, CELLS, 1)
    moved = SIZE * np.clip(rows + down, 0, SIZE - 1) + np.clip(columns + right, 0, SIZE - 1)

    own = np.indices((CELLS, CELLS), dtype=np.int64).reshape(2, -1)
    choices = np.indices((actions, actions)).reshape(2, -1)
    cells = moved[own[:, :, np.newaxis], choices[:, np.newaxis, :]]  # [N, S, J]

    there = cells == SUMMIT
    summit = there.all(axis=0)
    refuge = (cells == REFUGE).all(axis=0)
    alone = there.any(axis=0) & ~summit
    pays = np.broadcast_to(alone, there.shape) if punished == "both" else there & alone
    rewards = SUMMIT_REWARD * summit + REFUGE_REWARD * refuge - k * pays
    return Game(
        name="grid",
        actions=actions,
        following=CELLS * cells[0] + cells[1],
        rewards=np.ascontiguousarray(np.moveaxis(rewards, 0, -1)[:, :, np.newaxis, :]),
        ends=summit | refuge,
        success=summit,
        own=own,
        start=CELLS * STARTS[0] + STARTS[1],
    )
