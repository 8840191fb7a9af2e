"""A finite game of N agents: what follows from every joint action in every state.

A matrix game that is played again and again is a game of one state that follows itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from pipeline.errors import SchemaMismatch

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
Bool = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Game:
    """N agents, S states, A actions of every agent, J = A ** N joint actions, V equally likely outcomes.

    The joint action (a_1, …, a_N) has the index ``sum(a_i * A ** (N - i))``: the first agent's action
    is the most significant digit. The arrays are made read-only.

    Attributes:
        name: of the game without its parameters, e.g. ``penalty``.
        actions: A.
        following: int64 [S, J], the state that follows.
        rewards: float64 [S, J, V, N], what each agent receives; one of the V outcomes is drawn.
        ends: bool [S, J], whether the episode is over with this step.
        success: bool [S, J], the steps that reach what the game is about: an optimal joint action of a
            matrix game, both agents on (3, 3) in the grid world.
        own: int64 [N, S], what each agent sees if it sees only itself, numbered from 0.
        start: the state that an episode begins in.

    Raises:
        SchemaMismatch: if an array is not as above or a number is not finite or out of range.
    """

    name: str
    actions: int
    following: I64
    rewards: F64
    ends: Bool
    success: Bool
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
        """N."""
        return int(self.rewards.shape[3])

    @property
    def states(self) -> int:
        """S."""
        return int(self.rewards.shape[0])

    @property
    def expected(self) -> F64:
        """float64 [S, J, N]: the mean reward over the outcomes."""
        return np.asarray(self.rewards.mean(axis=2))

    @property
    def choices(self) -> I64:
        """int64 [N, J]: what each agent does in each joint action."""
        return np.indices((self.actions,) * self.agents, dtype=np.int64).reshape(self.agents, -1)

    def joint(self, actions: Sequence[int]) -> int:
        """The index of a joint action.

        Args:
            actions: N of them, in the order of the agents, each in [0, A).

        Raises:
            SchemaMismatch: if they are not.
        """
        _require(len(actions) == self.agents and all(0 <= a < self.actions for a in actions),
                 "actions", f"{tuple(actions)} is not one of {self.actions} for each of {self.agents} agents")
        return int(np.ravel_multi_index(tuple(actions), (self.actions,) * self.agents))

    def observed(self, what: Literal["own", "joint"]) -> I64:
        """int64 [N, S]: what each agent sees of a state, numbered from 0.

        Args:
            what: ``own``, only itself; or ``joint``, the whole state.
        """
        if what == "own":
            return self.own
        return np.tile(np.arange(self.states, dtype=np.int64), (self.agents, 1))


def _require(ok: bool, name: str, breach: str) -> None:
    if not ok:
        raise SchemaMismatch(f"{name} {breach}", where="game", next_step="Pass arrays as Game documents them")
