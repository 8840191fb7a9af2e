"""Repeated matrix games: penalty, climbing and its stochastic variants; their Nash equilibria.

Rows are the first agent's actions, columns the second's; both agents receive the cell. Source of penalty and
climbing: Claus and Boutilier, *The dynamics of reinforcement learning in cooperative multiagent systems*,
AAAI 1998 (paper, Figures 3a and 3b). Source of the stochastic variants: Kapetanakis and Kudenko,
*Reinforcement learning of coordination in cooperative multi-agent systems*, AAAI 2002.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.base.errors import BadSettings, SchemaMismatch
from pitchlore.pipeline.numbers.arrays import Bools
from pitchlore.pipeline.stages.paradigms.games.game import Game

CLIMBING = ((11, -30, 0), (-30, 7, 6), (0, 0, 5))

#: Mean rewards that differ by no more than this are equal: means of outcomes carry rounding errors.
TIE = 1e-9

#: The two outcomes of every cell. Some publications print 10/0 in the last cell; the mean is the same.
FULLY_STOCHASTIC_CLIMBING = (
    ((10, 12), (5, -65), (8, -8)),
    ((5, -65), (14, 0), (12, 0)),
    ((5, -5), (5, -5), (7, 3)),
)


def matrix_game(
    name: str, payoff: npt.ArrayLike, *, outcomes: bool = False, individual: bool = False
) -> Game:
    """Repeated matrix game of N agents with A actions each.

    Its success is computed: the :func:`optimal` equilibria. With individual rewards there may be none.

    Args:
        name: name of the game.
        payoff: numbers [A] * N, the reward of a joint action; then an axis [V] if there are ``outcomes``,
            then an axis [N] if rewards are ``individual``. It is copied.
        outcomes: there is an axis of V equally likely outcomes.
        individual: there is a last axis of each agent's reward; else all receive the same.

    Raises:
        SchemaMismatch: if the axes are not as above or a number is not finite.
    """
    rewards = np.array(payoff, dtype=np.float64)
    agents = rewards.ndim - outcomes - individual
    axes = ["A"] * agents + ["V"] * outcomes + ["N"] * individual
    if (agents < 1 or 0 in rewards.shape or len(set(rewards.shape[:agents])) != 1
            or (individual and rewards.shape[-1] != agents)):
        raise SchemaMismatch(
            f"payoff of shape {rewards.shape} is not [{', '.join(axes)}]", where=f"game {name}",
            next_step="Give every agent as many actions, and say whether there are outcomes or "
            "individual rewards",
        )
    if not individual:
        rewards = np.repeat(rewards[..., np.newaxis], agents, axis=-1)
    actions = rewards.shape[0]
    joint = actions**agents
    game = Game(
        name=name,
        actions=actions,
        following=np.zeros((1, joint), dtype=np.int64),
        rewards=rewards.reshape(1, joint, -1, agents),
        ends=np.zeros((1, joint), dtype=np.bool_),
        success=np.zeros((1, joint), dtype=np.bool_),
        own=np.zeros((agents, 1), dtype=np.int64),
    )
    return replace(game, success=optimal(game)[np.newaxis])


def pure_equilibria(game: Game) -> Bools:
    """Joint actions, bool [J], from which no agent gains by deviating alone (paper, inequality 8).

    Rewards are expected rewards of one step in the first state. Weak equilibria count: an agent that would
    receive the same does not gain.
    """
    by_action = game.expected[0].reshape((game.actions,) * game.agents + (game.agents,))
    stable = np.ones(by_action.shape[:-1], dtype=np.bool_)
    for agent in range(game.agents):
        received = by_action[..., agent]
        stable &= received >= received.max(axis=agent, keepdims=True) - TIE
    return stable.reshape(-1)


def optimal(game: Game) -> Bools:
    """Equilibria, bool [J], that are best for every agent at once (paper, section 5).

    There is none if agents prefer different equilibria, or if there is no equilibrium in pure strategies. If
    all agents receive the same, these are the joint actions of the greatest expected reward.
    """
    stable = pure_equilibria(game)
    if not stable.any():
        return stable
    expected = game.expected[0]
    best = (expected >= expected[stable].max(axis=0) - TIE).all(axis=1)
    return np.asarray(stable & best)


def penalty(k: float) -> Game:
    """Penalty game: agents that choose different ones of two optimal equilibria, (0, 0) and (2, 2), pay k.

    Args:
        k: reward of (0, 2) and (2, 0), at most 0 and finite.

    Raises:
        BadSettings: if k is not as above: with a positive k it is another game.
    """
    if not (math.isfinite(k) and k <= 0):
        raise BadSettings(f"k cannot be {k}", where="penalty game", next_step="Choose a finite k up to 0")
    return matrix_game("penalty", ((10, 0, k), (0, 2, 0), (k, 0, 10)))


def climbing() -> Game:
    """Climbing game: penalties surround the optimal equilibrium, (0, 0)."""
    return matrix_game("climbing", CLIMBING)


def partially_stochastic_climbing() -> Game:
    """Climbing game in which (1, 1) pays 14 or 0, equally likely."""
    payoff = np.repeat(np.array(CLIMBING, dtype=np.float64)[..., np.newaxis], 2, axis=-1)
    payoff[1, 1] = 14, 0
    return matrix_game("partially stochastic climbing", payoff, outcomes=True)


def fully_stochastic_climbing() -> Game:
    """Climbing game in which every joint action pays one of two rewards, equally likely."""
    return matrix_game("fully stochastic climbing", FULLY_STOCHASTIC_CLIMBING, outcomes=True)
