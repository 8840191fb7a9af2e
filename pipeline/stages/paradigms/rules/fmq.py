"""FMQ: an action that often brings its greatest reward is preferred to its action value.

Source: Kapetanakis and Kudenko, "Reinforcement Learning of Coordination in Cooperative Multi-Agent Systems",
AAAI 2002 (the frequency maximum Q value heuristic). Action values are learned as in IQ-learning. An agent
chooses by ``EV(a) = Q(a) + weight * freq(maxR(a)) * maxR(a)``. maxR(a) is the greatest reward that the action
ever brought; freq is the share of the action's uses that brought it.

With a great weight, one early penalty makes an action look far worse than it is until it is tried again. The
runner's temperature therefore has to start at the scale of EV, not of the rewards (published for the climbing
game: about 500).

The publication covers games of one state. With more states the statistics are kept for every pair of
observation and action and count the reward alone, not what follows. If only the end of an episode is
rewarded, FMQ helps at the last step and is IQ-learning before. If rewards are continuous, the greatest never
returns and the heuristic vanishes.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.paradigms.rules import iq
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel
from pitchlore.pipeline.stages.paradigms.rules.memory import LearnerSettings, Memory, Params, Transition

#: Planes of ``Memory.aux``: the greatest reward so far, how often it came, how often the action was taken.
GREATEST, HITS, TAKEN = 0, 1, 2


class FMQ(LearnerSettings):
    """Settings of FMQ.

    Attributes:
        weight: c, weight of the heuristic; published for the climbing game: 10.
    """

    rule: Literal["FMQ"] = "FMQ"
    weight: float = Field(default=10.0, ge=0)

    def params(self, agents: int) -> Params:
        """Step size, discount and weight; with one agent weight 0."""
        return Params(self.step_size, self.discount, weight=self.weight if agents > 1 else 0.0)


@kernel
def adapt(memory: Memory, params: Params, agent: int, step: Transition) -> None:
    """Update the action's greatest reward and its counts."""
    aux = memory.aux[agent, step.s_tm1[agent], step.a_tm1[agent]]
    reward = step.r_t[agent]
    if aux[TAKEN] == 0.0 or reward > aux[GREATEST]:
        aux[GREATEST] = reward
        aux[HITS] = 1.0
    elif reward == aux[GREATEST]:
        aux[HITS] += 1.0
    aux[TAKEN] += 1.0


@kernel
def values(memory: Memory, params: Params, agent: int, s_t: I64, out: F64) -> None:
    """EV of the agent's actions; the action value if the action was never taken."""
    iq.values(memory, params, agent, s_t, out)
    for a in range(out.shape[0]):
        aux = memory.aux[agent, s_t[agent], a]
        if aux[TAKEN] > 0.0:
            out[a] += params.weight * aux[HITS] / aux[TAKEN] * aux[GREATEST]
