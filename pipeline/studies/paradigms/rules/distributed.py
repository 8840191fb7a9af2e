"""Distributed Q-learning: an action is worth the best that ever came of it.

Lauer and Riedmiller, "An Algorithm for Distributed Reinforcement Learning in Cooperative Multi-Agent
Systems", ICML 2000. No value ever falls, so that each agent values an action as if all others did their
best. An agent's policy changes only when the greatest value of the state rises: all agents see it rise in
the same step, and so agree on one of several optimal joint actions.

Published, and proved to find an optimal policy, for deterministic games where all agents receive the same
reward; with a step size below 1 values rise at the pace of each agent's own visits, so that agents may
disagree where joint actions tie. Where rewards are drawn, a lucky one is never forgotten. Values must start
at or below what the best play brings, since they cannot fall to it.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from pipeline.studies.paradigms.rules import iq
from pipeline.studies.paradigms.rules.hysteretic import error
from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import F64, I64, Knobs, LearnerSettings, Memory

__all__ = ["KEPT", "Distributed", "adapt", "error", "values"]

#: Plane of the notes: 1 for the action that the agent's policy keeps to, else 0; none is kept at first.
KEPT = 0

#: Values that differ by a smaller share of themselves are equal but for rounding, which agents do not share.
ROUNDING = 1e-9


class Distributed(LearnerSettings):
    """Settings of distributed Q-learning.

    Attributes:
        step_size: as published 1, since in a deterministic game nothing is averaged out.
    """

    rule: Literal["distributed"] = "distributed"
    step_size: float = Field(default=1.0, gt=0, le=1)

    def knobs(self, agents: int) -> Knobs:
        """Step size, discount, and patience 0: negative errors do not count; with one agent they do."""
        return Knobs(self.step_size, self.discount, patience=0.0 if agents > 1 else 1.0)


@kernel
def adapt(memory: Memory, knobs: Knobs, agent: int, s_tm1: I64, a_tm1: I64, r_t: F64) -> None:
    """Keep to the action from now on if it raised the greatest value.

    It did if its value is now above all others: only its value moved, and until then the greatest value
    was that of the action kept so far.
    """
    q = memory.q[agent, s_tm1[agent]]
    done = a_tm1[agent]
    for a in range(q.shape[0]):
        if a != done and q[a] >= q[done] - ROUNDING * abs(q[done]):
            return
    for a in range(q.shape[0]):
        memory.notes[agent, s_tm1[agent], a, KEPT] = 1.0 if a == done else 0.0


@kernel
def values(memory: Memory, knobs: Knobs, agent: int, s_t: I64, out: F64) -> None:
    """The action values, where what ties with the action kept is the next float below it.

    A greedy agent (temperature or epsilon 0) so does what its policy keeps to, as published. At any
    temperature above 0 it explores by the action values alone, tied actions equally often: to
    coordinate while still exploring, choose epsilon-greedily.
    """
    iq.values(memory, knobs, agent, s_t, out)
    best = out[0]
    for a in range(1, out.shape[0]):
        best = max(best, out[a])
    for kept in range(out.shape[0]):
        if memory.notes[agent, s_t[agent], kept, KEPT] > 0.0 and out[kept] >= best - ROUNDING * abs(best):
            for a in range(out.shape[0]):
                if a != kept and out[a] >= out[kept]:
                    out[a] = np.nextafter(out[kept], -np.inf)
