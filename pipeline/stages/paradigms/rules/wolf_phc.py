"""WoLF-PHC: a mixed policy climbs towards the best action, slowly while it wins and fast while it loses.

Source: Bowling and Veloso, "Multiagent learning using a variable learning rate", Artificial Intelligence 136,
2002 (win or learn fast, policy hill climbing). Values are learned as in IQ-learning. The agent wins while its
policy's expected value, by these values, is above that of the mean of its policies so far.

The rule is made for convergence in self-play, not for the best of several equilibria: in a coordination game
it settles where independent learners do.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import LearnerSettings, Memory, Params, Transition

#: Planes of ``Memory.aux``: the policy, and the mean of the policies at all visits to the observation.
POLICY, MEAN = 0, 1


class WoLFPHC(LearnerSettings):
    """Settings of WoLF-PHC; the policy's steps are constant, while the publication lets them fall.

    Attributes:
        winning: delta_w, step of the policy at a visit while it wins, probability.
        losing: delta_l, the same while it loses, at least ``winning``; the publication's experiments take 2
            or 4 times ``winning``. Equal: plain policy hill climbing.
    """

    rule: Literal["WoLF-PHC"] = "WoLF-PHC"
    winning: float = Field(default=0.001, gt=0, le=1)
    losing: float = Field(default=0.004, gt=0, le=1)

    @model_validator(mode="after")
    def _losing_is_the_larger_step(self) -> WoLFPHC:
        if self.losing < self.winning:
            raise ValueError(f"losing {self.losing:g} is below winning {self.winning:g}: raise it")
        return self

    def params(self, agents: int) -> Params:
        """Step size, discount and both steps of the policy."""
        return Params(self.step_size, self.discount, winning=self.winning, losing=self.losing)

    def aux(self, actions: int) -> tuple[float, float, float]:
        """The uniform policy, and the same as the mean."""
        return 1.0 / actions, 1.0 / actions, 0.0


@kernel
def adapt(memory: Memory, params: Params, agent: int, step: Transition) -> None:
    """Update the mean by the policy, then move the policy towards the actions of the greatest value.

    Every other action gives ``min(its probability, delta / (A - 1))``. Actions that tie for the greatest
    value share what is given; the publication has one such action.
    """
    s = step.s_tm1[agent]
    q = memory.q[agent, s]
    aux = memory.aux[agent, s]
    actions = aux.shape[0]
    memory.visits[agent, s] += 1
    best = q[0]
    for a in range(1, actions):
        best = max(best, q[a])
    greedy = 0
    expected = 0.0
    expected_of_mean = 0.0
    for a in range(actions):
        aux[a, MEAN] += (aux[a, POLICY] - aux[a, MEAN]) / memory.visits[agent, s]
        expected += aux[a, POLICY] * q[a]
        expected_of_mean += aux[a, MEAN] * q[a]
        greedy += q[a] == best
    delta = params.winning if expected > expected_of_mean else params.losing
    given = 0.0
    for a in range(actions):
        if q[a] < best:
            gives = min(aux[a, POLICY], delta / (actions - 1))
            aux[a, POLICY] -= gives
            given += gives
    for a in range(actions):
        if q[a] == best:
            aux[a, POLICY] += given / greedy


@kernel
def values(memory: Memory, params: Params, agent: int, s_t: I64, out: F64) -> None:
    """The agent's policy, probabilities instead of values, for ``ActionSelection.MIXED``."""
    for a in range(out.shape[0]):
        out[a] = memory.aux[agent, s_t[agent], a, POLICY]
