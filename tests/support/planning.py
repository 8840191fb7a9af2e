"""Joint actions of a game: their numbers, and the actions of the agents."""

from collections.abc import Sequence

import numpy as np

from pitchlore.pipeline.numbers.arrays import I64, Bools
from pitchlore.pipeline.stages.paradigms.games.game import Game
from pitchlore.pipeline.stages.paradigms.rules.jaq import joint_index


def index_of(game: Game, actions: Sequence[int]) -> int:
    """Index of a joint action: N actions in the order of the agents."""
    return int(joint_index(np.array(actions, dtype=np.int64), game.actions))


def choices(game: Game) -> I64:
    """Action of each agent in each joint action, int64 [N, J]."""
    return np.indices((game.actions,) * game.agents, dtype=np.int64).reshape(game.agents, -1)


def named(game: Game, chosen: Bools) -> set[tuple[int, ...]]:
    """The joint actions of a bool [J], as tuples of the agents' actions."""
    return {tuple(int(a) for a in choices(game)[:, j]) for j in np.flatnonzero(chosen)}
