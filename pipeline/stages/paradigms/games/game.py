"""A finite game of N agents: next state and rewards of every joint action in every state.

A repeated matrix game has one state, which follows itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools


@dataclass(frozen=True, slots=True, eq=False)
class Game:
    """N agents, S states, A actions of each agent, J = A ** N joint actions, V equally likely outcomes.

    The joint action (a_1, …, a_N) has the index ``sum(a_i * A ** (N - i))``: the first agent's action
    is the most significant digit. The arrays are made read-only.

    Attributes:
        name: name of the game without its parameters, e.g. ``penalty``.
        actions: number of actions of each agent, A.
        following: int64 [S, J], next state.
        rewards: float64 [S, J, V, N], reward of each agent; one of the V outcomes is drawn.
        ends: bool [S, J], True if the step ends the episode.
        success: bool [S, J], True if the step reaches the game's goal: an optimal joint action of a matrix
            game, both agents on (3, 3) in the grid world.
        own: int64 [N, S], observation of each agent that observes only itself, numbered from 0.
        start: first state of an episode.

    Raises:
        SchemaMismatch: if an array is not as above, or a number is not finite or out of range.
    """

    name: str
    actions: int
    following: I64
    rewards: F64
    ends: Bools
    success: Bools
    own: I64
    start: int = 0

    def __post_init__(self) -> None:
        _require(self.rewards.ndim == 4 and 0 not in self.rewards.shape, "rewards", "is not [S, J, V, N]")
        shape = (self.states, self.actions**self.agents)
        _require(self.rewards.shape[:2] == shape, "rewards", "does not have J = A ** N joint actions")
        _require(self.rewards.dtype == np.float64 and bool(np.isfinite(self.rewards).all()),
                 "rewards", "is not float64 or not finite")
        for name, dtype in (("following", np.int64), ("ends", np.bool_), ("success", np.bool_)):
            array = getattr(self, name)
            _require(array.shape == shape and array.dtype == dtype, name, f"is not {np.dtype(dtype)} [S, J]")
        _require(self.own.shape == (self.agents, self.states) and self.own.dtype == np.int64,
                 "own", "is not int64 [N, S]")
        _require(bool(((self.following >= 0) & (self.following < self.states)).all()),
                 "following", "names a state that is not there")
        _require(int(self.own.min()) >= 0, "own", "is negative")
        _require(0 <= self.start < self.states, "start", "is no state")
        for name in ("following", "rewards", "ends", "success", "own"):
            getattr(self, name).flags.writeable = False

    @property
    def agents(self) -> int:
        """Number of agents, N."""
        return int(self.rewards.shape[3])

    @property
    def states(self) -> int:
        """Number of states, S."""
        return int(self.rewards.shape[0])

    @property
    def expected(self) -> F64:
        """Mean reward over the outcomes, float64 [S, J, N]."""
        return np.asarray(self.rewards.mean(axis=2))

    def as_one_agent(self) -> Game:
        """The same game for one agent that observes all and whose actions are the J joint actions.

        Its reward is the mean of the agents'. States, ends and successes stay, and so do the indices of joint
        actions.
        """
        return replace(
            self, actions=self.actions**self.agents, rewards=self.rewards.mean(axis=3, keepdims=True),
            own=np.arange(self.states, dtype=np.int64)[np.newaxis])

    def observed(self, what: Literal["own", "joint"]) -> I64:
        """Observation of each agent in each state, int64 [N, S], numbered from 0.

        Args:
            what: ``own``: the agent observes only itself; ``joint``: the whole state.
        """
        if what == "own":
            return self.own
        return np.tile(np.arange(self.states, dtype=np.int64), (self.agents, 1))


def _require(ok: bool, name: str, breach: str) -> None:
    if not ok:
        raise SchemaMismatch(f"{name} {breach}", where="game", next_step="Pass arrays as Game documents them")
