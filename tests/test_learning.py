"""IQ, JAQ and IVQ: worked on paper, and what holds for whatever is played."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.steps import ACTIONS, floats, ints, learn, learned, plays, values

from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.ivq import IVQ
from pitchlore.pipeline.stages.paradigms.rules.jaq import JAQ, joint_index
from pitchlore.pipeline.stages.paradigms.rules.team import TeamQ

PAPER = [IQ, JAQ, IVQ]


def repeated(*steps):
    """Steps of a game of one state, from (actions, rewards)."""
    return [(ints(*[0] * len(a)), ints(*a), floats(*r), 1.0, ints(*[0] * len(a))) for a, r in steps]


def assert_q(memory, *rows):
    np.testing.assert_allclose(memory.q[:, 0], rows, rtol=0, atol=1e-12)


# -- three steps on paper ---------------------------------------------------------------------------------


def test_iq_by_hand():
    """IQ learns from three steps what was worked by hand."""
    settings = IQ(step_size=0.5, discount=0.5)
    # 1. both see 0, do (0, 1), get (4, -4), see 1:  q1(0,0) = .5*(4 + .5*0 - 0) = 2, q2(0,1) = -2
    # 2. see 1, do (1, 1), get 8, see 0:             q1(1,1) = .5*(8 + .5*max(2, 0)) = 4.5
    #                                                q2(1,1) = .5*(8 + .5*max(0, -2)) = 4
    # 3. see 0, do (0, 1), get 6, and it ends:       q1(0,0) = 2 + .5*(6 - 2) = 4
    #                                                q2(0,1) = -2 + .5*(6 + 2) = 2
    steps = [
        (ints(0, 0), ints(0, 1), floats(4, -4), 1.0, ints(1, 1)),
        (ints(1, 1), ints(1, 1), floats(8, 8), 1.0, ints(0, 0)),
        (ints(0, 0), ints(0, 1), floats(6, 6), 0.0, ints(1, 1)),
    ]
    memory = learn(settings, steps, observations=2)
    assert memory.q.tolist() == [[[4, 0], [0, 4.5]], [[0, 2], [0, 4]]]
    assert values(settings, memory, 0, [1, 0]) == [0, 4.5]
    assert values(settings, memory, 1, [1, 0]) == [0, 2]
    # had it gone on: q1(0,0) = 2 + .5*(6 + .5*4.5 - 2) = 5.125, q2(0,1) = -2 + .5*(6 + .5*4 + 2) = 3
    went_on = learn(settings, [*steps[:2], (*steps[2][:3], 1.0, ints(1, 1))], observations=2)
    assert went_on.q[:, 0].tolist() == [[5.125, 0], [0, 3]]


@pytest.mark.parametrize("settings", [IQ(initial=12.0), JAQ(initial=12.0), IVQ(initial=12.0)])
def test_initial_values(settings):
    """Values start where the settings say."""
    assert values(settings, learn(settings, []), 1) == [12, 12]


JAQ_STEPS = repeated(((0, 1), (8, 8)), ((1, 1), (-4, -4)), ((0, 0), (2, 2)))
# for both agents, with learning rate and discount .5, of the joint actions 00, 01, 10, 11:
# 1. q(01) = .5*8 = 4. 2. q(11) = .5*(-4 + .5*4) = -1. 3. q(00) = .5*(2 + .5*4) = 2
JAQ_Q = [2, 4, 0, -1]


def test_jaq_by_hand():
    """JAQ learns from three steps what was worked by hand."""
    settings = JAQ(step_size=0.5, discount=0.5)
    memory = learn(settings, JAQ_STEPS)
    assert_q(memory, JAQ_Q, JAQ_Q)
    # the first did 0, 1, 0 and the second 1, 1, 0: believed to do 0 with 2/3, and with 1/3
    # first:  EV(0) = 1/3*2 + 2/3*4 = 10/3, EV(1) = 1/3*0 + 2/3*(-1) = -2/3
    # second: EV(0) = 2/3*2 + 1/3*0 = 4/3,  EV(1) = 2/3*4 + 1/3*(-1) = 7/3
    assert values(settings, memory, 0) == pytest.approx([10 / 3, -2 / 3], abs=1e-12)
    assert values(settings, memory, 1) == pytest.approx([4 / 3, 7 / 3], abs=1e-12)


IVQ_STEPS = repeated(((0, 1), (4, -2)), ((0, 0), (2, 6)), ((1, 0), (-4, -1)))


def test_ivq_by_hand():
    """IVQ as printed learns from three steps what was worked by hand."""
    # learning rate, discount and influence .5; RV counts the next value wholly (equation 6)
    # 1. TD = RV = 4, -2. Both did for the first time what they always did: Pe = 1, 1
    #    OP2(1) = -2*1, OP1(2) = 4*(1-1) = 0
    #    q1(0) = .5*(4 + .5*(-2)) = 1.5;                q2(1) = .5*(-2 + 0) = -1
    # 2. TD1 = 2 + .75 - 1.5 = 1.25, RV1 = 2 + 1.5 - 1.5 = 2; TD2 = RV2 = 6. Pe = 2/2, 1/2
    #    OP2(1) = 6*0, OP1(2) = 2*1/2 = 1
    #    q1(0) = 1.5 + .5*1.25 = 2.125;                 q2(0) = .5*(6 + .5*1) = 3.25
    # 3. TD1 = -4 + 1.0625 = -2.9375, RV1 = -4 + 2.125 = -1.875
    #    TD2 = -1 + 1.625 - 3.25 = -2.625, RV2 = -1 + 3.25 - 3.25 = -1. Pe = 1/3, 2/3
    #    OP2(1) = -1/3, OP1(2) = -1.875*2/3 = -1.25
    #    q1(1) = .5*(-2.9375 - 1/6) = -1.46875 - 1/12;  q2(0) = 3.25 + .5*(-2.625 - .625) = 1.625
    settings = IVQ(step_size=0.5, discount=0.5, influence=0.5)
    assert_q(learn(settings, IVQ_STEPS), [2.125, -1.46875 - 1 / 12], [1.625, -1])


# -- what holds for whatever was played -------------------------------------------------------------------


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
