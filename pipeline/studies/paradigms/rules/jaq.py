"""JAQ-learning: every agent values joint actions and believes in others' habits (paper, section 2.3.3)."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import (
    F64,
    I64,
    Knobs,
    LearnerSettings,
    Memory,
    greatest_value,
    occur,
)


class JAQ(LearnerSettings):
    """Settings of JAQ-learning.

    Attributes:
        recency: constant step of the beliefs, so that they forget; 0: frequencies over the whole life,
            as in fictitious play (Claus and Boutilier 1998). The paper does not say which.
    """

    JOINT: ClassVar[bool] = True

    rule: Literal["JAQ"] = "JAQ"
    recency: float = Field(default=0.0, ge=0, lt=1)

    def knobs(self, agents: int) -> Knobs:
        """Step size, discount and recency of the beliefs."""
        return Knobs(self.step_size, self.discount, recency=self.recency)


@kernel
def joint_index(a_t: I64, actions: int) -> int:
    """The index of a joint action [N]; the first agent's action is the most significant digit."""
    index = 0
    for agent in range(a_t.shape[0]):
        index = index * actions + a_t[agent]
    return index


@kernel
def error(
    memory: Memory, knobs: Knobs, agent: int,
    s_tm1: I64, a_tm1: I64, r_t: F64, continues_t: float, s_t: I64, u_t: float,
) -> float:
    """``r_t + discount * max_a q(s_t, a) - q(s_tm1, a_tm1)`` over joint actions: equation 2's bracket."""
    best = greatest_value(memory, agent, s_t)
    done = joint_index(a_tm1, memory.occurrence.shape[2])
    return float(r_t[agent] + knobs.discount * continues_t * best - memory.q[agent, s_tm1[agent], done])


@kernel
def adapt(memory: Memory, knobs: Knobs, agent: int, s_tm1: I64, a_tm1: I64, r_t: F64) -> None:
    """Let all others see the agent's choice: it counts in what they believe of it."""
    occur(memory, knobs, agent, s_tm1, a_tm1)


@kernel
def values(memory: Memory, knobs: Knobs, agent: int, s_t: I64, out: F64) -> None:
    """The expected values of the agent's own actions under its beliefs of the others' (equation 3).

    Before anybody has been seen, every action of theirs is believed to be as likely.
    """
    agents, _, actions = memory.occurrence.shape
    last = agents - 1
    for a in range(actions):
        out[a] = 0.0
    joint = 0
    for others in range(memory.q.shape[2] // actions):  # what all but the last do: taking digits is slow
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
