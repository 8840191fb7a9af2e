"""IVQ-learning: the others' opinions influence what an agent learns (paper, section 2.3.4).

The paper leaves open what :class:`IVQ`'s fields name. Their defaults are equations 4 to 7 as printed.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pitchlore.pipeline.stages.paradigms.rules import iq
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import (
    LearnerSettings,
    Memory,
    Params,
    Transition,
    observe_choice,
    occurrence_after,
    occurrence_step,
    td_error,
)


class IVQ(LearnerSettings):
    """Settings of IVQ-learning.

    Attributes:
        influence: beta of equation 4, of every agent over every other.
        bracket: inside: the influence value stands inside the learning rate's bracket, as equation 7 is
            printed; outside: ``q <- q + alpha * TD error + influence value``.
        opinion_discount: weight of the next value in an opinion; equation 6 prints 1. None: ``discount``.
        present: the occurrence counts the visit that is judged.
        recency: constant step of the occurrence; 0: the share over the whole life.
    """

    rule: Literal["IVQ"] = "IVQ"
    influence: float = Field(default=0.1, ge=0)
    bracket: Literal["inside", "outside"] = "inside"
    opinion_discount: float | None = Field(default=1.0, ge=0, le=1)
    present: bool = True
    recency: float = Field(default=0.0, ge=0, lt=1)

    def params(self, agents: int) -> Params:
        """All parameters that the rule reads; outside the bracket is inside with beta / alpha."""
        inside = 1.0 if self.bracket == "inside" else 1.0 / self.step_size
        discount = self.discount if self.opinion_discount is None else self.opinion_discount
        return Params(
            self.step_size, self.discount, recency=self.recency, influence=self.influence * inside,
            opinion_discount=discount, present=float(self.present),
        )


@kernel
def opinion(memory: Memory, params: Params, judge: int, agent: int, step: Transition) -> float:
    """Opinion of ``judge`` about the action of ``agent``, in the unit of the rewards (equations 5 and 6).

    The more often the agent repeats the action, the more a negative opinion weighs and the less a positive.
    """
    relative = td_error(memory, params.opinion_discount, judge, step.a_tm1[judge], step)
    s = step.s_tm1[agent]
    share: float = memory.occurrence[agent, s, step.a_tm1[agent]]
    if params.present > 0.0:
        share = occurrence_after(share, 1.0, occurrence_step(memory.visits[agent, s], params.recency))
    elif memory.visits[agent, s] == 0:
        share = 0.0
    return relative * share if relative <= 0.0 else relative * (1.0 - share)


@kernel
def error(memory: Memory, params: Params, agent: int, step: Transition, u_t: float) -> float:
    """IQ's error plus ``influence`` times the sum of the others' opinions (equations 4 and 7)."""
    opinions = 0.0
    for judge in range(memory.q.shape[0]):
        if judge != agent:
            opinions += opinion(memory, params, judge, agent, step)
    own = iq.error(memory, params, agent, step, u_t)
    return own + params.influence * opinions


@kernel
def adapt(memory: Memory, params: Params, agent: int, step: Transition) -> None:
    """Update the agent's occurrence by its choice, after all others have judged it."""
    observe_choice(memory, params, agent, step)
