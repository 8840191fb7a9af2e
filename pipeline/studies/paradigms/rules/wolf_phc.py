"""WoLF-PHC: a mixed policy climbs towards the best action, slowly while it wins, fast while it loses.

Bowling and Veloso, "Multiagent learning using a variable learning rate", Artificial Intelligence 136, 2002
(win or learn fast, policy hill climbing). Values are learned as in IQ-learning. The agent wins while its
policy is expected to bring more, by these values, than the mean of its policies so far.

Made for convergence in self-play, not for finding the best of several equilibria: in a coordination game it
settles where independent learners do.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from pipeline.studies.paradigms.rules.iq import error
from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import F64, I64, Knobs, LearnerSettings, Memory

__all__ = ["MEAN", "POLICY", "WoLFPHC", "adapt", "error", "values"]

#: Planes of the notes: the policy, and the mean of the policies at all visits to the observation.
POLICY, MEAN = 0, 1


class WoLFPHC(LearnerSettings):
    """Settings of WoLF-PHC; the policy's steps are constant, where the publication lets them fall.

    Attributes:
        winning: delta_w, by how much the policy moves at a visit while it wins.
        losing: delta_l, the same while it loses, at least as much; the publication's experiments take 2 or
            4 times ``winning``. Equal: plain policy hill climbing.
    """

    rule: Literal["WoLF-PHC"] = "WoLF-PHC"
    winning: float = Field(default=0.001, gt=0, le=1)
    losing: float = Field(default=0.004, gt=0, le=1)

    @model_validator(mode="after")
    def _losing_is_the_larger_step(self) -> WoLFPHC:
        if self.losing < self.winning:
            raise ValueError(f"losing {self.losing:g} is below winning {self.winning:g}: raise it")
        return self

    def knobs(self, agents: int) -> Knobs:
        """Step size, discount, and both steps, which are how the policy learns, with others or without."""
        return Knobs(self.step_size, self.discount, winning=self.winning, losing=self.losing)

    def notes(self, actions: int) -> tuple[float, float, float]:
        """The uniform policy, and as its mean."""
        return 1.0 / actions, 1.0 / actions, 0.0


@kernel
def adapt(memory: Memory, knobs: Knobs, agent: int, s_tm1: I64, a_tm1: I64, r_t: F64) -> None:
    """Count the policy into its mean, then move it towards the actions of the greatest value.

    Every other action gives ``min(its probability, step / (A - 1))``. Where several share the greatest
    value, they share what is given; the publication has one.
    """
    s = s_tm1[agent]
    q = memory.q[agent, s]
    notes = memory.notes[agent, s]
    actions = notes.shape[0]
    memory.visits[agent, s] += 1
    best = q[0]
    for a in range(1, actions):
        best = max(best, q[a])
    greedy = 0
    expected = 0.0
    expected_of_mean = 0.0
    for a in range(actions):
        notes[a, MEAN] += (notes[a, POLICY] - notes[a, MEAN]) / memory.visits[agent, s]
        expected += notes[a, POLICY] * q[a]
        expected_of_mean += notes[a, MEAN] * q[a]
        greedy += q[a] == best
    step = knobs.winning if expected > expected_of_mean else knobs.losing
    given = 0.0
    for a in range(actions):
        if q[a] < best:
            gives = min(notes[a, POLICY], step / (actions - 1))
            notes[a, POLICY] -= gives
            given += gives
    for a in range(actions):
        if q[a] == best:
            notes[a, POLICY] += given / greedy


@kernel
def values(memory: Memory, knobs: Knobs, agent: int, s_t: I64, out: F64) -> None:
    """The agent's policy: probabilities, not worths, to be chosen from by ``Selection.MIXED``."""
    for a in range(out.shape[0]):
        out[a] = memory.notes[agent, s_t[agent], a, POLICY]
