"""Training that goes on at its last temperature until a team of learners settles.

JAQ's beliefs are shares of a whole life. When the temperature has fallen, they still hold what the others did
while they explored, so that a greedy action may be no answer to what the others do now. Such a team is not
done: it goes on until nothing moves any more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import Memory, Params
from pitchlore.pipeline.stages.paradigms.rules.rules import values

#: Late in training a team is looked at again after one of so many parts of the steps that it has trained.
PARTS = 100


@dataclass(frozen=True, slots=True)
class Settling:
    """How long a training goes on at its last temperature, in a game of one state.

    A team has settled when two things hold. Its greedy joint action is the same as at the look before. No
    agent would choose another action if it believed with certainty that the others repeat theirs. From then
    on beliefs move only towards this certainty. Values of two agents are linear in beliefs, so neither
    changes its action any more, if rewards are certain.

    Attributes:
        still: least number of steps between two looks; it is greater, 1 % of all steps, late in training.
        most: steps after which training ends unsettled, in multiples of those before.
    """

    still: int = 1_000
    most: int = 1_000


@kernel
def _greedy(rule: int, memory: Memory, params: Params, s_t: I64, worth: F64, a_t: I64) -> None:
    """Each agent's first action of the greatest value, into ``a_t``."""
    for agent in range(a_t.shape[0]):
        values(rule, memory, params, agent, s_t, worth)
        a_t[agent] = 0
        for a in range(1, worth.shape[0]):
            if worth[a] > worth[a_t[agent]]:
                a_t[agent] = a


@njit(cache=True, nogil=True, error_model="numpy")
def greedy_joint_action(rule: int, memory: Memory, params: Params) -> tuple[I64, bool]:
    """The greedy joint action, int64 [N], and whether it stays if everybody is certain of the others'.

    The game has one state. The memory is left as it was.
    """
    agents, _, actions = memory.occurrence.shape
    s_t = np.zeros(agents, np.int64)
    worth, now, certain = np.empty(actions), np.empty(agents, np.int64), np.empty(agents, np.int64)
    _greedy(rule, memory, params, s_t, worth, now)
    believed = memory.occurrence[:, 0].copy()
    for agent in range(agents):
        for a in range(actions):
            memory.occurrence[agent, 0, a] = 1.0 if a == now[agent] else 0.0
    _greedy(rule, memory, params, s_t, worth, certain)
    for agent in range(agents):  # to assign whole arrays takes two seconds more to compile
        for a in range(actions):
            memory.occurrence[agent, 0, a] = believed[agent, a]
    return now, bool((now == certain).all())
