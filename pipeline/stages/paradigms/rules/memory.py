"""Memory, parameters, settings and temporal-difference error: what all learning rules share.

A learning rule is three functions, compiled by numba, with the same signatures for all rules:

``error(memory, params, agent, step, u_t) -> float``
    Error of the agent's prediction, in the unit of the rewards. The runner adds ``step_size * error`` to
    the value of the action that was taken, so that no rule applies the step size itself.
``adapt(memory, params, agent, step) -> None``
    Update of what the agent keeps beside the action values. It runs after all values of the step have
    moved.
``values(memory, params, agent, s_t, out) -> None``
    Values of the agent's actions when it chooses, written into ``out``, float64 [A].

Suffixes carry time: an agent observes ``s_tm1``, takes ``a_tm1``, receives ``r_t``, then observes ``s_t``.
"""

from __future__ import annotations

from typing import ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from pitchlore.pipeline.base.toml import Frozen
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel

#: Numbers that a rule may keep for every pair of observation and action.
AUX = 3


class Memory(NamedTuple):
    """Memory of the N agents of one run: O observations, A actions, K = A, or A ** N for joint actions.

    Attributes:
        q: float64 [N, O, K], action values.
        occurrence: float64 [N, O, A], share of the agent's visits to the observation at which it chose the
            action: Pe of equation 5, and what the others believe of the agent in equation 3.
        visits: int64 [N, O], visits that ``occurrence`` counts.
        aux: float64 [N, O, A, AUX], numbers of one rule; its module names the planes.
    """

    q: F64
    occurrence: F64
    visits: I64
    aux: F64


class Transition(NamedTuple):
    """One step of all N agents.

    Attributes:
        s_tm1: int64 [N], observations before the step.
        a_tm1: int64 [N], actions.
        r_t: float64 [N], rewards.
        continues_t: 0 if the episode ends with this step, else 1; it multiplies the discount.
        s_t: int64 [N], observations after the step.
    """

    s_tm1: I64
    a_tm1: I64
    r_t: F64
    continues_t: float
    s_t: I64


class Params(NamedTuple):
    """Parameters of all rules as numbers; a rule reads its own and ignores the others.

    Attributes:
        step_size: share of the error that a value moves by, alpha.
        discount: weight of the next value, gamma.
        recency: constant step of the occurrence; 0: the occurrence is the share over the whole life.
        influence: weight of the others' opinions inside the learning rate's bracket (equation 4's beta).
        opinion_discount: weight of the next value in an opinion (equation 6 prints 1).
        present: 1 if the occurrence counts the visit that is judged, else 0.
        patience: share of a negative error that counts (hysteretic, distributed).
        weight: weight of the heuristic (FMQ).
        leniency, cooling: exponent and factor of an action's temperature (lenient).
        winning, losing: steps of the policy, probability (WoLF-PHC).
    """

    step_size: float
    discount: float
    recency: float = 0.0
    influence: float = 0.0
    opinion_discount: float = 1.0
    present: float = 1.0
    patience: float = 1.0
    weight: float = 0.0
    leniency: float = 0.0
    cooling: float = 1.0
    winning: float = 0.0
    losing: float = 0.0


class LearnerSettings(Frozen):
    """Settings of every rule.

    Attributes:
        step_size: share of the error that a value moves by, alpha.
        discount: weight of the next state's value, gamma. In a matrix game the next state is the same.
        initial: action values before learning, in the unit of the rewards.
        observes: an agent observes its own part of the state, or the joint state.
        order: simultaneous: the errors of all agents are computed before any value moves; in turn: each
            agent's value moves before the next error is computed.
    """

    #: The values are of joint actions.
    JOINT: ClassVar[bool] = False
    #: One learner chooses for all agents: it plays ``Game.as_one_agent``.
    ONE_FOR_ALL: ClassVar[bool] = False
    #: The error is random: it needs one number drawn from [0, 1) for each agent and step.
    TOSSES: ClassVar[bool] = False

    step_size: float = Field(default=0.1, gt=0, le=1)
    discount: float = Field(default=0.0, ge=0, le=1)
    initial: float = 0.0
    observes: Literal["own", "joint"] = "joint"
    order: Literal["simultaneous", "in turn"] = "simultaneous"

    def params(self, agents: int) -> Params:
        """Parameters of the rule for a team of ``agents``: step size, discount, and what the rule adds.

        With one agent every rule must be Q-learning: parameters that concern other agents are then neutral.
        """
        return Params(self.step_size, self.discount)

    def aux(self, actions: int) -> tuple[float, float, float]:
        """Initial numbers in ``Memory.aux`` of every pair of observation and action."""
        return 0.0, 0.0, 0.0


def memory_of(settings: LearnerSettings, agents: int, observations: int, actions: int) -> Memory:
    """Memory of a team before learning."""
    width = actions**agents if settings.JOINT else actions
    aux = np.empty((agents, observations, actions, AUX))
    aux[...] = settings.aux(actions)
    return Memory(
        q=np.full((agents, observations, width), settings.initial),
        occurrence=np.full((agents, observations, actions), 1.0 / actions),
        visits=np.zeros((agents, observations), dtype=np.int64),
        aux=aux,
    )


@kernel
def td_error(memory: Memory, discount: float, agent: int, done: int, step: Transition) -> float:
    """``r_t + discount * max_a q(s_t, a) - q(s_tm1, done)`` of one agent: the temporal-difference error."""
    best = memory.q[agent, step.s_t[agent], 0]
    for a in range(1, memory.q.shape[2]):
        best = max(best, memory.q[agent, step.s_t[agent], a])
    expected = memory.q[agent, step.s_tm1[agent], done]
    return float(step.r_t[agent] + discount * step.continues_t * best - expected)


@kernel
def occurrence_step(visits: int, recency: float) -> float:
    """Step of the occurrence at the visit after ``visits``: 1 / (visits + 1), or the constant ``recency``."""
    return recency if recency > 0.0 else 1.0 / (visits + 1)


@kernel
def occurrence_after(occurrence: float, chosen: float, step: float) -> float:
    """Equation 5, visit by visit: an action's occurrence after a visit at which it was chosen (1) or not (0).

    With ``step = 1 / n`` at visit n it is the share of n visits.
    """
    return occurrence + step * (chosen - occurrence)


@kernel
def observe_choice(memory: Memory, params: Params, agent: int, step: Transition) -> None:
    """Update the occurrence of the agent's actions by its choice."""
    s = step.s_tm1[agent]
    size = occurrence_step(memory.visits[agent, s], params.recency)
    for a in range(memory.occurrence.shape[2]):
        chosen = 1.0 if a == step.a_tm1[agent] else 0.0
        memory.occurrence[agent, s, a] = occurrence_after(memory.occurrence[agent, s, a], chosen, size)
    memory.visits[agent, s] += 1
