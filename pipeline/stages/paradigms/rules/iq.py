"""IQ-learning: every agent learns as if it were alone (paper, section 2.3.2, equation 1).

Its functions are the defaults of :class:`pipeline.stages.paradigms.rules.rules.LearningRule`.
"""

from __future__ import annotations

from typing import Literal

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import (
    LearnerSettings,
    Memory,
    Params,
    Transition,
    td_error,
)


class IQ(LearnerSettings):
    """Settings of IQ-learning; equation 1 has no others."""

    rule: Literal["IQ"] = "IQ"


@kernel
def error(memory: Memory, params: Params, agent: int, step: Transition, u_t: float) -> float:
    """Temporal-difference error over the agent's own actions: equation 1's bracket."""
    return td_error(memory, params.discount, agent, step.a_tm1[agent], step)


@kernel
def adapt(memory: Memory, params: Params, agent: int, step: Transition) -> None:
    """Change nothing: the action values are all that the agent keeps."""


@kernel
def values(memory: Memory, params: Params, agent: int, s_t: I64, out: F64) -> None:
    """Action values of the agent's own actions."""
    for a in range(out.shape[0]):
        out[a] = memory.q[agent, s_t[agent], a]
