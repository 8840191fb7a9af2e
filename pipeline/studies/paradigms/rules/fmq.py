"""FMQ: actions that often bring their greatest reward look better than they are valued.

Kapetanakis and Kudenko, "Reinforcement Learning of Coordination in Cooperative Multi-Agent Systems", AAAI
2002 (the frequency maximum Q value heuristic). Values are learned as in IQ-learning; what an agent chooses by
is ``EV(a) = Q(a) + weight * freq(maxR(a)) * maxR(a)``, where maxR(a) is the greatest reward that the action
ever brought, and freq the share of the times the action was taken that it brought it.

With a great weight an action that once brought a penalty looks far worse than it is until it has been tried
again: the runner's temperature has to start at the scale of EV, not of the rewards (published: about 500 for
the climbing game).

Published for games of one state. With more states the statistics are kept for every pair of observation and
action and are of the reward alone, not of what follows: where only the end of an episode is rewarded, FMQ
helps at its last step and is IQ-learning before. Where rewards are drawn from a continuum, the greatest never
comes again and the heuristic fades away.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pipeline.studies.paradigms.rules import iq
from pipeline.studies.paradigms.rules.iq import error
from pipeline.studies.paradigms.rules.kernel import kernel
from pipeline.studies.paradigms.rules.memory import F64, I64, Knobs, LearnerSettings, Memory

__all__ = ["FMQ", "GREATEST", "HITS", "TAKEN", "adapt", "error", "values"]

#: Planes of the notes: the greatest reward so far, how often it came, how often the action was taken.
GREATEST, HITS, TAKEN = 0, 1, 2


class FMQ(LearnerSettings):
    """Settings of FMQ.

    Attributes:
        weight: c, how much the heuristic counts; as published for the climbing game 10.
    """

    rule: Literal["FMQ"] = "FMQ"
    weight: float = Field(default=10.0, ge=0)

    def knobs(self, agents: int) -> Knobs:
        """Step size, discount and weight; with one agent weight 0, since there is nobody to agree with."""
        return Knobs(self.step_size, self.discount, weight=self.weight if agents > 1 else 0.0)


@kernel
def adapt(memory: Memory, knobs: Knobs, agent: int, s_tm1: I64, a_tm1: I64, r_t: F64) -> None:
    """Count the reward into what is known of the action's greatest."""
    notes = memory.notes[agent, s_tm1[agent], a_tm1[agent]]
    reward = r_t[agent]
    if notes[TAKEN] == 0.0 or reward > notes[GREATEST]:
        notes[GREATEST] = reward
        notes[HITS] = 1.0
    elif reward == notes[GREATEST]:
        notes[HITS] += 1.0
    notes[TAKEN] += 1.0


@kernel
def values(memory: Memory, knobs: Knobs, agent: int, s_t: I64, out: F64) -> None:
    """EV of the agent's actions; of one that was never taken, its action value."""
    iq.values(memory, knobs, agent, s_t, out)
    for a in range(out.shape[0]):
        notes = memory.notes[agent, s_t[agent], a]
        if notes[TAKEN] > 0.0:
            out[a] += knobs.weight * notes[HITS] / notes[TAKEN] * notes[GREATEST]
