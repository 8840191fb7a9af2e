"""IQ-learning: every agent learns as if it were alone (paper, section 2.3.2, equation 1)."""

from __future__ import annotations

from typing import Literal

from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import F64, I64, Knobs, LearnerSettings, Memory, greatest_value


class IQ(LearnerSettings):
    """Settings of IQ-learning; equation 1 has no others."""

    rule: Literal["IQ"] = "IQ"

    def knobs(self, agents: int) -> Knobs:
        """Step size and discount."""
        return Knobs(self.step_size, self.discount)


@kernel
def error(
    memory: Memory, knobs: Knobs, agent: int,
    s_tm1: I64, a_tm1: I64, r_t: F64, continues_t: float, s_t: I64, u_t: float,
) -> float:
    """``r_t + discount * max_a q(s_t, a) - q(s_tm1, a_tm1)``: equation 1's bracket."""
    best = greatest_value(memory, agent, s_t)
    expected: float = memory.q[agent, s_tm1[agent], a_tm1[agent]]
    return float(r_t[agent] + knobs.discount * continues_t * best - expected)


@kernel
def adapt(memory: Memory, knobs: Knobs, agent: int, s_tm1: I64, a_tm1: I64, r_t: F64) -> None:
    """Note nothing down."""


@kernel
def values(memory: Memory, knobs: Knobs, agent: int, s_t: I64, out: F64) -> None:
    """The action values of the agent's own actions."""
    for a in range(out.shape[0]):
        out[a] = memory.q[agent, s_t[agent], a]
