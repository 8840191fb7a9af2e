"""Planning with perfect knowledge of a game: best joint play, equilibria of policies.

A policy is int64 [S], the joint action in each state. What it is worth is the discounted sum of expected
rewards until the episode ends. With discount 1 an episode may go on for ever without rewards, but where
rewards or penalties go on for ever, too, nothing has a worth, and planning refuses.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.pipeline.stages.paradigms.games.game import Game
from pitchlore.pipeline.stages.paradigms.rules.jaq import joint_index

#: Values are at most half of it off. Choices that are tied are all found; none counts as best that is worse by twice as much.
TOLERANCE = 1e-9

#: After so many sweeps without a limit there is none, or it is too far off to wait for.
MOST_SWEEPS = 100_000


def index_of(game: Game, actions: Sequence[int]) -> int:
    """Index of a joint action: N actions in the order of the agents."""
    return int(joint_index(np.array(actions, dtype=np.int64), game.actions))


def choices(game: Game) -> I64:
    """Action of each agent in each joint action, int64 [N, J]."""
    return np.indices((game.actions,) * game.agents, dtype=np.int64).reshape(game.agents, -1)


def named(game: Game, chosen: Bools) -> set[tuple[int, ...]]:
    """The joint actions of a bool [J], as tuples of the agents' actions."""
    return {tuple(int(a) for a in choices(game)[:, j]) for j in np.flatnonzero(chosen)}


class Plan(NamedTuple):
    """The best that can be done in every state; K choices are joint actions, or those of one agent.

    Attributes:
        values: float64 [S], the discounted sum of rewards that is to be had.
        best: bool [S, K], the choices that lead to it; all of them, if several do.
    """

    values: F64
    best: Bools


def value_iteration(game: Game, discount: float) -> Plan:
    """The best joint play of a team that maximises the mean of its agents' rewards.

    Bellman's equation, iterated from zero (Sutton and Barto, 2nd edition, section 4.4). With discount 1
    delay costs nothing: ``best`` then holds choices that waste time, even for ever.

    Args:
        game: N agents.
        discount: in [0, 1].

    Raises:
        BadSettings: if the values do not converge.
    """
    return _solve(game.following, game.expected.mean(axis=2), game.ends, discount)


def evaluate(game: Game, policy: I64, discount: float) -> F64:
    """Value of a policy to each agent from the game's start on, float64 [N].

    Args:
        game: N agents.
        policy: int64 [S], each in [0, J).
        discount: in [0, 1].
    """
    kept = policy[:, np.newaxis]
    return np.array([_from_start(game, kept, agent, discount) for agent in range(game.agents)])


def is_equilibrium(game: Game, policy: I64, discount: float) -> bool:
    """True if no agent gains by deviating from a policy alone (paper, inequality 8), from the start on.

    What a policy does in states that it never comes to still matters: it is how the others answer a
    deviation. They need not answer wisely: this is a Nash equilibrium, not a perfect one.

    Args: as :func:`evaluate`; a gain of no more than the tolerance is none.
    """
    best = [_from_start(game, _deviations(game, policy, agent), agent, discount) for agent in range(game.agents)]
    return bool((best - evaluate(game, policy, discount) <= TOLERANCE).all())


def path_length(game: Game, allowed: Bools) -> int | None:
    """The fewest steps from the start to success by allowed joint actions; null if they never lead there.

    Args:
        game: N agents.
        allowed: bool [S, J], e.g. :attr:`Plan.best`.
    """
    for steps, newest in enumerate(_frontiers(game.following, allowed & ~game.ends, game.start), start=1):
        if (game.success & allowed)[newest].any():
            return steps
    return None


def _frontiers(following: I64, onward: Bools, start: int) -> Iterator[Bools]:
    """The states [S] first come to after 0, 1, 2, … steps, until there are no new ones.

    ``onward`` [S, K] says which choices are taken and do not end the episode.
    """
    known = np.zeros(len(following), dtype=np.bool_)
    newest = known.copy()
    newest[start] = True
    while newest.any():
        yield newest
        known |= newest
        reached = np.zeros_like(known)
        reached[following[onward & newest[:, np.newaxis]]] = True
        newest = reached & ~known


def _deviations(game: Game, policy: I64, agent: int) -> I64:
    """The joint actions [S, A] that come of each of an agent's actions while the others keep to a policy."""
    weight = game.actions ** (game.agents - 1 - agent)
    others = policy - weight * choices(game)[agent, policy]
    return np.asarray(others[:, np.newaxis] + weight * np.arange(game.actions))


def _from_start(game: Game, joint: I64, agent: int, discount: float) -> float:
    """Best value of an agent from the start on if only some joint actions [S, K] are taken.

    States that these never lead to end at once: without discount they need not have a worth.
    """
    rows = np.arange(game.states)[:, np.newaxis]
    following, rewards, ends = game.following[rows, joint], game.expected[rows, joint, agent], game.ends[rows, joint]
    never = ~np.logical_or.reduce(list(_frontiers(following, ~ends, game.start)))[:, np.newaxis]
    return float(_solve(following, rewards, ends | never, discount).values[game.start])


def _solve(following: I64, rewards: F64, ends: Bools, discount: float) -> Plan:
    """Iterate Bellman's equation over K choices, all arrays [S, K], until the values keep still."""
    discounts = np.where(ends, 0.0, discount)
    values = np.zeros(len(rewards))
    for _ in range(MOST_SWEEPS):
        choices = rewards + discounts * values[following]
        before, values = values, choices.max(axis=1)
        # the distance to the limit is at most discount / (1 - discount) times the last change; with
        # discount 1 nothing may change at all
        if discount * np.abs(values - before).max() <= (1 - discount) * TOLERANCE / 2:
            choices = rewards + discounts * values[following]
            return Plan(choices.max(axis=1), choices >= choices.max(axis=1, keepdims=True) - TOLERANCE)
    raise BadSettings(f"values do not converge within {MOST_SWEEPS:,} sweeps at discount {discount}")
