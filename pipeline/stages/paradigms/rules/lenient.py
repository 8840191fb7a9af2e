"""Lenient learning: negative errors are often ignored at first, and less and less.

Source: Panait, Sullivan and Luke, "Lenient learners in cooperative multiagent systems", AAMAS 2006. Every
action has a temperature that falls each time it is taken. The hotter the action, the likelier a negative
error is ignored. As in the later form for games of more states (Palmer, Tuyls, Bloembergen and Savani, AAMAS
2018), temperatures belong to pairs of observation and action, and the probability of ignoring an error is
``1 - exp(-leniency * temperature)``.

Wei and Luke's LMRL2 (JMLR 17, 2016, section 4) differs in three points: it ignores with probability
``exp(-1 / (leniency * temperature))``, lets temperature diffuse from the next state, and lets it govern
exploration. Here the runner governs exploration, so ``cooling`` must match the length of exploration: if
leniency ends while team mates still explore, IQ-learning is left, which forgets what leniency had protected.
Cooling by the factor that the runner's temperature falls by a step outlasts exploration, because an action is
not taken at every step.
"""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from pydantic import Field

from pitchlore.pipeline.stages.paradigms.rules import iq
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import LearnerSettings, Memory, Params, Transition

#: Plane of ``Memory.aux``: the temperature of the action.
TEMPERATURE = 0


class Lenient(LearnerSettings):
    """Settings of lenient learning.

    Attributes:
        leniency: kappa, factor of the temperature in the exponent.
        temperature: initial temperature of every action (Wei and Luke 2016: 50).
        cooling: factor of an action's temperature each time it is taken (Wei and Luke 2016: 0.995).
    """

    TOSSES: ClassVar[bool] = True

    rule: Literal["lenient"] = "lenient"
    leniency: float = Field(default=1.0, ge=0)
    temperature: float = Field(default=50.0, ge=0)
    cooling: float = Field(default=0.995, ge=0, le=1)

    def params(self, agents: int) -> Params:
        """Step size, discount, leniency, cooling; with one agent leniency 0."""
        leniency = self.leniency if agents > 1 else 0.0
        return Params(self.step_size, self.discount, leniency=leniency, cooling=self.cooling)

    def aux(self, actions: int) -> tuple[float, float, float]:
        """Initial temperature."""
        return self.temperature, 0.0, 0.0


@kernel
def error(memory: Memory, params: Params, agent: int, step: Transition, u_t: float) -> float:
    """IQ's error; 0 if it is negative and ``u_t`` is below the probability of ignoring it."""
    surprise = iq.error(memory, params, agent, step, u_t)
    if surprise < 0.0:
        temperature = memory.aux[agent, step.s_tm1[agent], step.a_tm1[agent], TEMPERATURE]
        if u_t < -math.expm1(-params.leniency * temperature):
            return 0.0
    return surprise


@kernel
def adapt(memory: Memory, params: Params, agent: int, step: Transition) -> None:
    """Cool the action that was taken."""
    memory.aux[agent, step.s_tm1[agent], step.a_tm1[agent], TEMPERATURE] *= params.cooling
