"""IQ, JAQ, IVQ and one who decides for all: what holds for whatever is played."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from support.steps import ACTIONS, ints, learn, learned, plays, values

from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.ivq import IVQ
from pitchlore.pipeline.stages.paradigms.rules.jaq import JAQ, joint_index
from pitchlore.pipeline.stages.paradigms.rules.team import TeamQ


@given(play=plays(), bracket=st.sampled_from(["inside", "outside"]), order=st.sampled_from(["simultaneous", "in turn"]))
def test_ivq_no_influence(play, bracket, order):
    """Without influence IVQ is IQ."""
    swayed = IVQ(discount=0.9, influence=0.0, bracket=bracket, order=order)
    assert learned(swayed, play).q.tobytes() == learned(IQ(discount=0.9, order=order), play).q.tobytes()


@given(play=plays())
def test_team_and_jaq(play):
    """With one reward and one observation for all, the table of each JAQ agent is the team's, bit by bit."""
    alike = [(np.full(3, s[0]), a, np.full(3, r[0]), go, np.full(3, s_t[0])) for s, a, r, go, s_t in play]
    orders = [(s[:1], ints(joint_index(a, ACTIONS)), r[:1], go, s_t[:1]) for s, a, r, go, s_t in alike]
    [team] = learn(TeamQ(discount=0.9), orders, agents=1, actions=ACTIONS**3, observations=2).q
    assert all(table.tobytes() == team.tobytes() for table in learned(JAQ(discount=0.9), alike).q)


def test_one_decides():
    """A team that knows the climbing game takes (a0, b0); JAQ, with the same table, decides by its beliefs: a2."""
    for rule, agents, actions, best in ((TeamQ(), 1, 9, 0), (JAQ(), 2, 3, 2)):
        memory = learn(rule, [], agents=agents, actions=actions)
        memory.q[:] = 11, -30, 0, -30, 7, 6, 0, 0, 5
        assert np.argmax(values(rule, memory, 0)) == best
