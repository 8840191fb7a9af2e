"""JAQ-learning: every agent values joint actions and estimates the others' choices (paper, section 2.3.3)."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import (
    LearnerSettings,
    Memory,
    Params,
    Transition,
    observe_choice,
    td_error,
)


class JAQ(LearnerSettings):
    """Settings of JAQ-learning.

    Attributes:
        recency: constant step of the beliefs, so that they forget; 0: frequencies over the whole life, as
            in fictitious play (Claus and Boutilier 1998). The paper does not say which.
    """

    JOINT: ClassVar[bool] = True

    rule: Literal["JAQ"] = "JAQ"
    recency: float = Field(default=0.0, ge=0, lt=1)

    def params(self, agents: int) -> Params:
        """Step size, discount and recency of the beliefs."""
        return Params(self.step_size, self.discount, recency=self.recency)


@kernel
def joint_index(a_t: I64, actions: int) -> int:
    """Index of a joint action, int64 [N]; the first agent's action is the most significant digit."""
    index = 0
    for agent in range(a_t.shape[0]):
        index = index * actions + a_t[agent]
    return index


@kernel
def error(memory: Memory, params: Params, agent: int, step: Transition, u_t: float) -> float:
    """Temporal-difference error over joint actions: equation 2's bracket."""
    done = joint_index(step.a_tm1, memory.occurrence.shape[2])
    return td_error(memory, params.discount, agent, done, step)


@kernel
def adapt(memory: Memory, params: Params, agent: int, step: Transition) -> None:
    """Update the others' belief about the agent by its choice."""
    observe_choice(memory, params, agent, step)


@kernel
def values(memory: Memory, params: Params, agent: int, s_t: I64, out: F64) -> None:
    """Expected values of the agent's own actions under its beliefs about the others' (equation 3).

    Before the first visit all actions of another agent are believed to be equally likely.
    """
    agents, _, actions = memory.occurrence.shape
    last = agents - 1
    for a in range(actions):
        out[a] = 0.0
    joint = 0
    for others in range(memory.q.shape[2] // actions):  # actions of all but the last: taking digits is slow
        belief = 1.0
        own = 0
        rest = others
        for j in range(last - 1, -1, -1):
            a_j = rest % actions
            rest //= actions
            if j == agent:
                own = a_j
            else:
                belief *= memory.occurrence[j, s_t[j], a_j]
        for a in range(actions):
            worth = belief * memory.q[agent, s_t[agent], joint]
            if agent == last:
                out[a] += worth
            else:
                out[own] += memory.occurrence[last, s_t[last], a] * worth
            joint += 1
