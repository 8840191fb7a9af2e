"""Lenient learning: bad news is often forgiven at first, and ever more seldom.

Panait, Sullivan and Luke, "Lenient learners in cooperative multiagent systems", AAMAS 2006: every action has
a temperature that falls each time it is taken; the hotter the action, the likelier an error below 0 is
forgiven. Here, as in the later form for games of more states (Palmer, Tuyls, Bloembergen and Savani, AAMAS
2018), temperatures are kept for every pair of observation and action, and the probability of forgiving is
``1 - exp(-leniency * temperature)``.

Wei and Luke's LMRL2 (JMLR 17, 2016, section 4) differs: it forgives with probability
``exp(-1 / (leniency * temperature))``, lets temperature diffuse from the next state, and lets it govern
exploration too. Here exploration is the runner's affair, so ``cooling`` has to be set by how long is
explored: leniency that ends while team mates still explore leaves IQ-learning, which forgets what it was
lenient for. Cooling by the factor that the runner's temperature falls by a step outlasts exploration,
because an action is not taken at every step.
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field

from pipeline.studies.paradigms.rules import iq
from pipeline.studies.paradigms.rules.iq import values
from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import F64, I64, Knobs, LearnerSettings, Memory

__all__ = ["TEMPERATURE", "Lenient", "adapt", "error", "values"]

#: Plane of the notes: the temperature of the action.
TEMPERATURE = 0


class Lenient(LearnerSettings):
    """Settings of lenient learning.

    Attributes:
        leniency: kappa, what a temperature is multiplied by in the exponent.
        temperature: that every action starts from (Wei and Luke 2016: 50).
        cooling: factor of an action's temperature each time it is taken (Wei and Luke 2016: 0.995).
    """

    TOSSES: ClassVar[bool] = True

    rule: Literal["lenient"] = "lenient"
    leniency: float = Field(default=1.0, ge=0)
    temperature: float = Field(default=50.0, ge=0)
    cooling: float = Field(default=0.995, ge=0, le=1)

    def knobs(self, agents: int) -> Knobs:
        """Step size, discount, leniency, cooling; with one agent leniency 0: there is nobody to forgive."""
        leniency = self.leniency if agents > 1 else 0.0
        return Knobs(self.step_size, self.discount, leniency=leniency, cooling=self.cooling)

    def notes(self, actions: int) -> tuple[float, float, float]:
        """The temperature to start from."""
        return self.temperature, 0.0, 0.0


@kernel
def error(
    memory: Memory, knobs: Knobs, agent: int,
    s_tm1: I64, a_tm1: I64, r_t: F64, continues_t: float, s_t: I64, u_t: float,
) -> float:
    """IQ's error; 0 where it is negative and the coin ``u_t`` falls on forgiving."""
    surprise: float = iq.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    if surprise < 0.0:
        temperature = memory.notes[agent, s_tm1[agent], a_tm1[agent], TEMPERATURE]
        if u_t < -math.expm1(-knobs.leniency * temperature):
            return 0.0
    return surprise


@kernel
def adapt(memory: Memory, knobs: Knobs, agent: int, s_tm1: I64, a_tm1: I64, r_t: F64) -> None:
    """Cool the action that was taken."""
    memory.notes[agent, s_tm1[agent], a_tm1[agent], TEMPERATURE] *= knobs.cooling
