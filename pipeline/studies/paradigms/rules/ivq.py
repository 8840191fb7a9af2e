"""IVQ-learning: agents are swayed by what others think of their actions (paper, section 2.3.4).

The text leaves open what :class:`IVQ`'s fields name; its defaults are equations 4 to 7 as printed.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pipeline.studies.paradigms.rules import iq
from pipeline.studies.paradigms.rules.iq import values
from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import (
    F64,
    I64,
    Knobs,
    LearnerSettings,
    Memory,
    greatest_value,
    occur,
    occurrence_step,
)

__all__ = ["IVQ", "adapt", "error", "opinion", "values"]


class IVQ(LearnerSettings):
    """Settings of IVQ-learning.

    Attributes:
        influence: beta of equation 4, of every agent over every other.
        bracket: whether the influence value stands inside the learning rate's bracket, as equation 7
            is printed, or outside: ``q <- q + alpha * TD error + influence value``.
        opinion_discount: what the next value counts in an opinion; equation 6 prints 1. None: as much
            as in the agent's own update.
        present: whether the occurrence index counts the visit that is judged.
        recency: constant step of the occurrence index; 0: the share over the whole life.
    """

    rule: Literal["IVQ"] = "IVQ"
    influence: float = Field(default=0.1, ge=0)
    bracket: Literal["inside", "outside"] = "inside"
    opinion_discount: float | None = Field(default=1.0, ge=0, le=1)
    present: bool = True
    recency: float = Field(default=0.0, ge=0, lt=1)

    def knobs(self, agents: int) -> Knobs:
        """All that the rule reads; outside the bracket is inside with beta / alpha."""
        inside = 1.0 if self.bracket == "inside" else 1.0 / self.step_size
        discount = self.discount if self.opinion_discount is None else self.opinion_discount
        return Knobs(
            self.step_size, self.discount, recency=self.recency, influence=self.influence * inside,
            opinion_discount=discount, present=float(self.present),
        )


@kernel
def opinion(
    memory: Memory, knobs: Knobs, judge: int, agent: int,
    s_tm1: I64, a_tm1: I64, r_t: F64, continues_t: float, s_t: I64,
) -> float:
    """What ``judge`` thinks of what ``agent`` did: equations 5 and 6.

    A protest grows, and praise fades, with how often the agent does the same.
    """
    best = greatest_value(memory, judge, s_t)
    expected: float = memory.q[judge, s_tm1[judge], a_tm1[judge]]
    relative: float = r_t[judge] + knobs.opinion_discount * continues_t * best - expected
    s = s_tm1[agent]
    share: float = memory.occurrence[agent, s, a_tm1[agent]]
    if knobs.present > 0.0:
        share += occurrence_step(memory.visits[agent, s], knobs.recency) * (1.0 - share)
    elif memory.visits[agent, s] == 0:
        share = 0.0
    return relative * share if relative <= 0.0 else relative * (1.0 - share)


@kernel
def error(
    memory: Memory, knobs: Knobs, agent: int,
    s_tm1: I64, a_tm1: I64, r_t: F64, continues_t: float, s_t: I64, u_t: float,
) -> float:
    """IQ's error and the influence value, which is ``influence`` times the others' opinions (equation 4)."""
    swayed = 0.0
    for judge in range(memory.q.shape[0]):
        if judge != agent:
            swayed += opinion(memory, knobs, judge, agent, s_tm1, a_tm1, r_t, continues_t, s_t)
    own = iq.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    return own + knobs.influence * swayed


@kernel
def adapt(memory: Memory, knobs: Knobs, agent: int, s_tm1: I64, a_tm1: I64, r_t: F64) -> None:
    """Count the choice into the occurrence index, once all have judged it."""
    occur(memory, knobs, agent, s_tm1, a_tm1)
