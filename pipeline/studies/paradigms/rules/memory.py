"""What N learners have in common: their memory, their knobs, and the settings of every rule.

A learning rule is a module with three functions of the same signatures for all rules, compiled by
numba:

``error(memory, knobs, agent, s_tm1, a_tm1, r_t, continues_t, s_t, u_t)``
    by how much what happened beat what the agent expected. The runner adds ``step_size`` times it to
    the value of what was done, so that the step size stays outside.
``adapt(memory, knobs, agent, s_tm1, a_tm1, r_t)``
    what the agent notes down beside the values, after all values of the step were updated.
``values(memory, knobs, agent, s_t, out)``
    what the agent's actions are worth to it when it chooses, into ``out``.

Suffixes carry time: an agent that saw ``s_tm1`` did ``a_tm1``, received ``r_t`` and sees ``s_t``.
All four are of every agent, [N]; ``continues_t`` is 0 where the episode ended with this step, else 1, so
that a rule discounts by ``knobs.discount * continues_t``; ``u_t`` is a number drawn from [0, 1) for
rules that toss a coin.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import Field

from pipeline.settings import Frozen
from pipeline.studies.paradigms.rules.kernel import kernel

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]

#: Numbers that a rule may note down for every pair of observation and action.
NOTES = 3


class Memory(NamedTuple):
    """What the N agents of one run know; O observations, A actions, K = A, or A ** N for joint actions.

    Attributes:
        q: float64 [N, O, K], action values.
        occurrence: float64 [N, O, A], the share of the agent's visits to the observation in which it
            chose the action: Pe of equation 5, and what others believe of it in equation 3.
        visits: int64 [N, O].
        notes: float64 [N, O, A, NOTES]; the rule's module names its planes.
    """

    q: F64
    occurrence: F64
    visits: I64
    notes: F64


class Knobs(NamedTuple):
    """The settings of all rules as numbers; a rule reads its own and ignores the others.

    Attributes:
        step_size: of the update; also the constant step of :func:`occur` where ``recency`` is not 0.
        discount: gamma.
        recency: constant step of the occurrence; 0: the share over the whole life.
        influence: beta of equation 4, as it stands inside the learning rate's bracket.
        opinion_discount: what the next value counts in an opinion (equation 6 prints 1).
        present: 1 if the occurrence index counts the present visit, else 0.
        patience: share of a negative error that counts (hysteretic, distributed).
        weight: of the heuristic (FMQ).
        leniency, cooling: exponent and decay of the temperature (lenient).
        winning, losing: steps of the policy (WoLF-PHC).
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


class LearnerSettings(Frozen, ABC):
    """What every rule has.

    Attributes:
        step_size: share of the error that a value moves by.
        discount: gamma, what the next state's value counts. In a matrix game the next state is the same.
        initial: action values to start from.
        observes: whether an agent sees only itself or the whole state.
        order: whether all agents' errors are computed before any value moves, or one after the other.
    """

    #: Whether values are of joint actions, and whether the rule's error tosses a coin.
    JOINT: ClassVar[bool] = False
    TOSSES: ClassVar[bool] = False

    step_size: float = Field(default=0.1, gt=0, le=1)
    discount: float = Field(default=0.0, ge=0, le=1)
    initial: float = 0.0
    observes: Literal["own", "joint"] = "joint"
    order: Literal["simultaneous", "in turn"] = "simultaneous"

    @abstractmethod
    def knobs(self, agents: int) -> Knobs:
        """The numbers that the rule reads, for a team of so many agents.

        What a rule does about others is nothing where there are no others: with one agent every rule
        is Q-learning.
        """

    def notes(self, actions: int) -> tuple[float, float, float]:
        """What the notes of every pair start from."""
        return 0.0, 0.0, 0.0


def memory_of(settings: LearnerSettings, agents: int, observations: int, actions: int) -> Memory:
    """A memory that nothing was learned in yet."""
    width = actions**agents if settings.JOINT else actions
    notes = np.empty((agents, observations, actions, NOTES))
    notes[...] = settings.notes(actions)
    return Memory(
        q=np.full((agents, observations, width), settings.initial),
        occurrence=np.full((agents, observations, actions), 1.0 / actions),
        visits=np.zeros((agents, observations), dtype=np.int64),
        notes=notes,
    )


@kernel
def occurrence_step(visits: int, recency: float) -> float:
    """The step of an occurrence index at the visit after ``visits``: 1 / n over a life, else constant."""
    return recency if recency > 0.0 else 1.0 / (visits + 1)


@kernel
def greatest_value(memory: Memory, agent: int, s_t: I64) -> float:
    """The greatest of an agent's action values of what it sees: what it may expect from there."""
    best: float = memory.q[agent, s_t[agent], 0]
    for a in range(1, memory.q.shape[2]):
        best = max(best, memory.q[agent, s_t[agent], a])
    return best


@kernel
def occur(memory: Memory, knobs: Knobs, agent: int, s_tm1: I64, a_tm1: I64) -> None:
    """Count a choice of the agent's into its occurrence index."""
    s = s_tm1[agent]
    step = occurrence_step(memory.visits[agent, s], knobs.recency)
    for a in range(memory.occurrence.shape[2]):
        chosen = 1.0 if a == a_tm1[agent] else 0.0
        memory.occurrence[agent, s, a] += step * (chosen - memory.occurrence[agent, s, a])
    memory.visits[agent, s] += 1
