"""Nash equilibria in pure strategies of single steps of a game, found by trying every deviation.

A repeated matrix game consists of such steps. Policies of games with more states are another matter.
"""

from __future__ import annotations

import numpy as np

from pipeline.studies.paradigms.games.game import Bool, Game

#: Mean rewards that differ by no more than this are equal: means of outcomes carry rounding errors.
TIE = 1e-9


def pure_equilibria(game: Game, state: int = 0) -> Bool:
    """Joint actions, bool [J], from which no agent gains by deviating alone (paper, inequality 8).

    Rewards are expected rewards of one step. Weak equilibria count: an agent that would receive the same does
    not gain.

    Args:
        game: game of N agents.
        state: state in which the step is taken, in [0, S).
    """
    by_action = game.expected[state].reshape((game.actions,) * game.agents + (game.agents,))
    stable = np.ones(by_action.shape[:-1], dtype=np.bool_)
    for agent in range(game.agents):
        received = by_action[..., agent]
        stable &= received >= received.max(axis=agent, keepdims=True) - TIE
    return stable.reshape(-1)


def optimal(game: Game, state: int = 0) -> Bool:
    """Equilibria, bool [J], that are best for every agent at once (paper, section 5).

    There is none if agents prefer different equilibria, or if there is no equilibrium in pure strategies. If
    all agents receive the same, these are the joint actions of the greatest expected reward.

    Args:
        game: game of N agents.
        state: state in which the step is taken, in [0, S).
    """
    stable = pure_equilibria(game, state)
    if not stable.any():
        return stable
    expected = game.expected[state]
    best = np.asarray((expected >= expected[stable].max(axis=0) - TIE).all(axis=1))
    return np.asarray(stable & best)
