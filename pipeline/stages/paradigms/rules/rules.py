"""All learning rules as one table, and the compiled functions that call a rule by its number.

To add a rule, write its module (see :mod:`pipeline.stages.paradigms.rules.memory` for the three functions)
and add its entry to :data:`RULES`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, NamedTuple

from pydantic import Field

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.paradigms.rules import (
    distributed,
    fmq,
    hysteretic,
    iq,
    ivq,
    jaq,
    lenient,
    team,
    wolf_phc,
)
from pitchlore.pipeline.stages.paradigms.rules.kernel import switch
from pitchlore.pipeline.stages.paradigms.rules.memory import LearnerSettings, Memory, Params, Transition


class LearningRule(NamedTuple):
    """A learning rule; the functions that an entry does not name are IQ-learning's.

    Attributes:
        settings: class of its settings.
        error, adapt, values: its compiled functions.
    """

    settings: type[LearnerSettings]
    error: Callable[[Memory, Params, int, Transition, float], float] = iq.error
    adapt: Callable[[Memory, Params, int, Transition], None] = iq.adapt
    values: Callable[[Memory, Params, int, I64, F64], None] = iq.values


#: The number of a rule is its place here.
RULES = (
    LearningRule(iq.IQ),
    LearningRule(jaq.JAQ, error=jaq.error, adapt=jaq.adapt, values=jaq.values),
    LearningRule(ivq.IVQ, error=ivq.error, adapt=ivq.adapt),
    LearningRule(hysteretic.Hysteretic, error=hysteretic.error),
    LearningRule(fmq.FMQ, adapt=fmq.adapt, values=fmq.values),
    LearningRule(lenient.Lenient, error=lenient.error, adapt=lenient.adapt),
    LearningRule(distributed.Distributed, error=hysteretic.error, adapt=distributed.adapt,
                 values=distributed.values),
    LearningRule(wolf_phc.WoLFPHC, adapt=wolf_phc.adapt, values=wolf_phc.values),
    LearningRule(team.TeamQ),
)

if TYPE_CHECKING:
    AnyLearner = LearnerSettings
else:
    #: Settings of any rule; the field ``rule`` tells which.
    AnyLearner = Annotated[reduce(or_, [rule.settings for rule in RULES]), Field(discriminator="rule")]

def rule_number(settings: LearnerSettings) -> int:
    """Number of the rule that the settings belong to.

    Raises:
        ValueError: if they belong to no rule in RULES.
    """
    return [rule.settings for rule in RULES].index(type(settings))


#: Error of a rule: ``error(number, memory, params, agent, step, u_t)``.
error: Callable[[int, Memory, Params, int, Transition, float], float] = switch(
    "error", [rule.error for rule in RULES])

#: Update of what a rule keeps beside the action values: ``adapt(number, memory, params, agent, step)``.
adapt: Callable[[int, Memory, Params, int, Transition], None] = switch(
    "adapt", [rule.adapt for rule in RULES])

#: Values of an agent's actions when it chooses: ``values(number, memory, params, agent, s_t, out)``.
values: Callable[[int, Memory, Params, int, I64, F64], None] = switch(
    "values", [rule.values for rule in RULES])
