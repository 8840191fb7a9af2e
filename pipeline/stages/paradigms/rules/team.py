"""Team learning: one learner chooses the joint action of all agents (paper, section 2.3.1).

The team is modelled as a single agent, so the algorithm is Q-learning without a change. The learner observes
the joint state, receives the mean of the agents' rewards, and commands every agent. A team of robots
therefore needs all sensor data and all learning in one place.

Cost: with S own states and A actions of each of N agents the table has ``(S * A) ** N`` values, and each step
looks at ``A ** N`` of them. Without states the table has 9, 27 and 81 values for 2, 3 and 4 agents with three
actions each, and to try every joint action once takes as many steps.

Joint-action learning: if all agents receive the same reward and observe the joint state, the table of each
JAQ agent equals this one after the same steps (:mod:`pipeline.stages.paradigms.rules.jaq`). Two things
differ. One learner decides for all, where each JAQ agent decides for itself. So team learning needs no model
of the others' policies, where JAQ weighs its values by beliefs. Their runs differ even in a game of one
state.

Its functions are those of :mod:`pipeline.stages.paradigms.rules.iq`, in the game that
:meth:`pipeline.stages.paradigms.games.game.Game.as_one_agent` makes.
"""

from __future__ import annotations

from typing import ClassVar, Literal

from pitchlore.pipeline.stages.paradigms.rules.memory import LearnerSettings


class TeamQ(LearnerSettings):
    """Settings of team learning; ``order`` has no effect, since there is one learner.

    Attributes:
        observes: the joint state; one that observes less cannot command all.
    """

    ONE_FOR_ALL: ClassVar[bool] = True

    rule: Literal["team"] = "team"
    observes: Literal["joint"] = "joint"
