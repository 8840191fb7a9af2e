"""All learning rules, and the one place that calls them by number inside compiled code.

To add a rule: its module with the three functions and its settings, a number here, and a branch in
each of the three functions below.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pipeline.studies.paradigms.rules import distributed, fmq, hysteretic, iq, ivq, jaq, lenient, wolf_phc
from pipeline.studies.paradigms.rules.distributed import Distributed
from pipeline.studies.paradigms.rules.fmq import FMQ
from pipeline.studies.paradigms.rules.hysteretic import Hysteretic
from pipeline.studies.paradigms.rules.iq import IQ
from pipeline.studies.paradigms.rules.ivq import IVQ
from pipeline.studies.paradigms.rules.jaq import JAQ
from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.lenient import Lenient
from pipeline.studies.paradigms.rules.memory import F64, I64, Knobs, LearnerSettings, Memory
from pipeline.studies.paradigms.rules.wolf_phc import WoLFPHC

#: Settings of any rule; the field ``rule`` tells which.
AnyLearner = Annotated[
    IQ | JAQ | IVQ | Hysteretic | FMQ | Lenient | Distributed | WoLFPHC, Field(discriminator="rule")
]

#: A rule's number is its place here.
RULES: tuple[type[LearnerSettings], ...] = (IQ, JAQ, IVQ, Hysteretic, FMQ, Lenient, Distributed, WoLFPHC)


@kernel
def error(
    rule: int, memory: Memory, knobs: Knobs, agent: int,
    s_tm1: I64, a_tm1: I64, r_t: F64, continues_t: float, s_t: I64, u_t: float,
) -> float:
    """The error of a rule (see :mod:`pipeline.studies.paradigms.rules.memory`)."""
    if rule == 0:
        return iq.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    if rule == 1:
        return jaq.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    if rule == 2:
        return ivq.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    if rule == 3:
        return hysteretic.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    if rule == 4:
        return fmq.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    if rule == 5:
        return lenient.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    if rule == 6:
        return distributed.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)
    return wolf_phc.error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)


@kernel
def adapt(rule: int, memory: Memory, knobs: Knobs, agent: int, s_tm1: I64, a_tm1: I64, r_t: F64) -> None:
    """What a rule notes down after a step."""
    if rule == 0:
        iq.adapt(memory, knobs, agent, s_tm1, a_tm1, r_t)
    elif rule == 1:
        jaq.adapt(memory, knobs, agent, s_tm1, a_tm1, r_t)
    elif rule == 2:
        ivq.adapt(memory, knobs, agent, s_tm1, a_tm1, r_t)
    elif rule == 3:
        hysteretic.adapt(memory, knobs, agent, s_tm1, a_tm1, r_t)
    elif rule == 4:
        fmq.adapt(memory, knobs, agent, s_tm1, a_tm1, r_t)
    elif rule == 5:
        lenient.adapt(memory, knobs, agent, s_tm1, a_tm1, r_t)
    elif rule == 6:
        distributed.adapt(memory, knobs, agent, s_tm1, a_tm1, r_t)
    else:
        wolf_phc.adapt(memory, knobs, agent, s_tm1, a_tm1, r_t)


@kernel
def values(rule: int, memory: Memory, knobs: Knobs, agent: int, s_t: I64, out: F64) -> None:
    """What a rule's actions are worth when the agent chooses."""
    if rule == 1:
        jaq.values(memory, knobs, agent, s_t, out)
    elif rule == 4:
        fmq.values(memory, knobs, agent, s_t, out)
    elif rule == 6:
        distributed.values(memory, knobs, agent, s_t, out)
    elif rule == 7:
        wolf_phc.values(memory, knobs, agent, s_t, out)
    else:
        iq.values(memory, knobs, agent, s_t, out)
