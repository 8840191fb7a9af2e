"""Hysteretic Q-learning: bad news counts less than good news, because a team mate may be to blame.

Matignon, Laurent and Le Fort-Piat, "Hysteretic Q-Learning: an algorithm for decentralized reinforcement
learning in cooperative multi-agent teams", IROS 2007: Q-learning with two step sizes, alpha where the error
is not negative and a smaller beta where it is. With beta = alpha it is IQ-learning.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from pipeline.studies.paradigms.rules import iq
from pipeline.studies.paradigms.rules.iq import adapt, values
from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import F64, I64, Knobs, LearnerSettings, Memory

__all__ = ["Hysteretic", "adapt", "error", "values"]


class Hysteretic(LearnerSettings):
    """Settings of hysteretic Q-learning; alpha is ``step_size``.

    Attributes:
        decrease: beta, the step size of negative errors, at most ``step_size``. As published with
            alpha 0.1: 0.01.
    """

    rule: Literal["hysteretic"] = "hysteretic"
    decrease: float = Field(default=0.01, ge=0)

    @model_validator(mode="after")
    def _decrease_is_the_smaller_step(self) -> Hysteretic:
        if self.decrease > self.step_size:
            raise ValueError(f"decrease {self.decrease:g} is above step_size {self.step_size:g}: lower it")
        return self

    def knobs(self, agents: int) -> Knobs:
        """Step size, discount, and as patience beta / alpha; with one agent 1, since nobody else errs."""
        patience = self.decrease / self.step_size if agents > 1 else 1.0
        return Knobs(self.step_size, self.discount, patience=patience)


@kernel
def error(
    memory: Memory, knobs: Knobs, agent: int,
    s_tm1: I64, a_tm1: I64, r_t: F64, continues_t: float, s_t: I64, u_t: float,
) -> float:
    """IQ's error, of which only the share ``patience`` counts where it is negative."""
    surprise: float = iq.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    return surprise if surprise >= 0.0 else knobs.patience * surprise
