"""Distributed Q-learning: the value of an action is the best return that it ever led to.

Source: Lauer and Riedmiller, "An Algorithm for Distributed Reinforcement Learning in Cooperative Multi-Agent
Systems", ICML 2000. No value ever falls, so each agent values an action as if all others did their best. An
agent's policy changes only if the greatest value of the state rises. All agents see it rise in the same step,
and so agree on one of several optimal joint actions.

The publication proves that an optimal policy is found in deterministic games with equal rewards for all
agents. With a step size below 1 values rise at the pace of each agent's own visits, and agents may disagree
between tied joint actions. With random rewards a lucky one is never forgotten. Initial values must be at or
below the return of the best play, since values cannot fall to it.

Its error is :func:`pipeline.stages.paradigms.rules.hysteretic.error` with patience 0.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.paradigms.rules import iq
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import LearnerSettings, Memory, Params, Transition

#: Plane of ``Memory.aux``: 1 for the action of the agent's policy, else 0; at first it has none.
KEPT = 0

#: Values that differ by a smaller share of themselves are tied: agents do not share rounding errors.
ROUNDING = 1e-9


class Distributed(LearnerSettings):
    """Settings of distributed Q-learning.

    Attributes:
        step_size: published: 1, since a deterministic game leaves nothing to average.
    """

    rule: Literal["distributed"] = "distributed"
    step_size: float = Field(default=1.0, gt=0, le=1)

    def params(self, agents: int) -> Params:
        """Step size, discount, and patience 0; with one agent patience 1."""
        return Params(self.step_size, self.discount, patience=0.0 if agents > 1 else 1.0)


@kernel
def adapt(memory: Memory, params: Params, agent: int, step: Transition) -> None:
    """Make the action the policy's if it raised the greatest value of the state.

    It did if its value is now above all others: only its value moved, and before that the greatest value
    was that of the policy's action.
    """
    s = step.s_tm1[agent]
    q = memory.q[agent, s]
    done = step.a_tm1[agent]
    for a in range(q.shape[0]):
        if a != done and q[a] >= q[done] - ROUNDING * abs(q[done]):
            return
    for a in range(q.shape[0]):
        memory.aux[agent, s, a, KEPT] = 1.0 if a == done else 0.0


@kernel
def values(memory: Memory, params: Params, agent: int, s_t: I64, out: F64) -> None:
    """Action values; an action that ties with the policy's gets the next float below it.

    At temperature or epsilon 0 the agent therefore takes its policy's action, as published. At any
    temperature above 0 it explores by the action values alone, tied actions equally often. For agents that
    coordinate while they explore, choose epsilon-greedily.
    """
    iq.values(memory, params, agent, s_t, out)
    best = out[0]
    for a in range(1, out.shape[0]):
        best = max(best, out[a])
    for kept in range(out.shape[0]):
        if memory.aux[agent, s_t[agent], kept, KEPT] > 0.0 and out[kept] >= best - ROUNDING * abs(best):
            for a in range(out.shape[0]):
                if a != kept and out[a] >= out[kept]:
                    out[a] = np.nextafter(out[kept], -np.inf)
