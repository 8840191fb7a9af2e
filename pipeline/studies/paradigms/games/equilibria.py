"""Nash equilibria in pure strategies of a game's single steps, found by trying every deviation.

In a matrix game that is played again and again a step is all there is. Policies of games with several
states are judged by :mod:`pipeline.studies.paradigms.games.planning`.
"""

from __future__ import annotations

import numpy as np

from pipeline.studies.paradigms.games.game import Bool, Game

#: Mean rewards that differ by no more than this are equal: means of outcomes carry rounding errors.
TIE = 1e-9


def pure_equilibria(game: Game, state: int = 0) -> Bool:
    """The joint actions, bool [J], that no agent gains from leaving alone (paper, inequality 8).

    Rewards are expected rewards of one step. An agent that would only keep what it has does not gain,
    so weak equilibria count, as the inequality has it.

    Args:
        game: N agents.
        state: that the step is taken in, in [0, S).
    """
    by_action = game.expected[state].reshape((game.actions,) * game.agents + (game.agents,))
    stable = np.ones(by_action.shape[:-1], dtype=np.bool_)
    for agent in range(game.agents):
        received = by_action[..., agent]
        stable &= received >= received.max(axis=agent, keepdims=True) - TIE
    return stable.reshape(-1)


def optimal(game: Game, state: int = 0) -> Bool:
    """The equilibria, bool [J], that are best for every agent at once (paper, section 5).

    None is where agents prefer different equilibria or there is none in pure strategies. Where all
    agents receive the same, these are the joint actions of the greatest expected reward.

    Args:
        game: N agents.
        state: that the step is taken in, in [0, S).
    """
    stable = pure_equilibria(game, state)
    if not stable.any():
        return stable
    expected = game.expected[state]
    best = np.asarray((expected >= expected[stable].max(axis=0) - TIE).all(axis=1))
    return np.asarray(stable & best)
