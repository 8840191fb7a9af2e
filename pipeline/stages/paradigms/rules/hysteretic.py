"""Hysteretic Q-learning: a negative error counts less, because a team mate may have caused it.

Source: Matignon, Laurent and Le Fort-Piat, "Hysteretic Q-Learning: an algorithm for decentralized
reinforcement learning in cooperative multi-agent teams", IROS 2007: Q-learning with two step sizes, alpha for
errors of at least 0 and a smaller beta for negative errors. With beta = alpha it is IQ-learning.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from pitchlore.pipeline.stages.paradigms.rules import iq
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import LearnerSettings, Memory, Params, Transition


class Hysteretic(LearnerSettings):
    """Settings of hysteretic Q-learning; alpha is ``step_size``.

    Attributes:
        decrease: beta, step size of negative errors, at most ``step_size``. Published with alpha 0.1: 0.01.
    """

    rule: Literal["hysteretic"] = "hysteretic"
    decrease: float = Field(default=0.01, ge=0)

    @model_validator(mode="after")
    def _decrease_is_the_smaller_step(self) -> Hysteretic:
        if self.decrease > self.step_size:
            raise ValueError(f"decrease {self.decrease:g} is above step_size {self.step_size:g}: lower it")
        return self

    def params(self, agents: int) -> Params:
        """Step size, discount, and as patience beta / alpha; with one agent patience 1."""
        patience = self.decrease / self.step_size if agents > 1 else 1.0
        return Params(self.step_size, self.discount, patience=patience)


@kernel
def error(memory: Memory, params: Params, agent: int, step: Transition, u_t: float) -> float:
    """IQ's error, multiplied by ``patience`` if it is negative."""
    surprise = iq.error(memory, params, agent, step, u_t)
    return surprise if surprise >= 0.0 else params.patience * surprise
