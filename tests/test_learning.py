"""IQ, JAQ and IVQ: worked on paper, and what holds for whatever is played."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.steps import ACTIONS, AGENTS, OBSERVATIONS, floats, ints, learn, learned, plays, vectors

from pitchlore.pipeline.stages.paradigms.rules import rules
from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.ivq import IVQ
from pitchlore.pipeline.stages.paradigms.rules.jaq import JAQ
from pitchlore.pipeline.stages.paradigms.rules.memory import Memory, memory_of
from pitchlore.pipeline.stages.paradigms.rules.rules import rule_number

PAPER = [IQ, JAQ, IVQ]


def repeated(*steps):
    """Steps of a game of one state, from (actions, rewards)."""
    return [(ints(*[0] * len(a)), ints(*a), floats(*r), 1.0, ints(*[0] * len(a))) for a, r in steps]


def values(settings, memory, agent, seen=None, actions=2):
    agents = memory.q.shape[0]
    out = np.empty(actions)
    rules.values(
        rule_number(settings), memory, settings.params(agents), agent,
        ints(*(seen or [0] * agents)), out)
    return out.tolist()


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


def test_jaq_recency_by_hand():
    """JAQ with beliefs that forget expects what was worked by hand."""
    settings = JAQ(step_size=0.5, discount=0.5, recency=0.5)
    memory = learn(settings, JAQ_STEPS)
    assert_q(memory, JAQ_Q, JAQ_Q)
    # P(first does 0): 1/2, 3/4, 3/8, 11/16. P(second does 0): 1/2, 1/4, 1/8, 9/16
    # first:  EV(0) = (9*2 + 7*4)/16 = 2.875,  EV(1) = 7/16*(-1)
    # second: EV(0) = 11/16*2 = 1.375,         EV(1) = (11*4 - 5)/16 = 2.4375
    assert values(settings, memory, 0) == [2.875, -0.4375]
    assert values(settings, memory, 1) == [1.375, 2.4375]


def test_jaq_first_beliefs():
    """Before anybody was seen JAQ believes in all actions alike."""
    settings = JAQ()
    memory = learn(settings, [])
    memory.q[0, 0] = [1, 2, 4, 8]
    assert values(settings, memory, 0) == [1.5, 6]


def test_jaq_three_agents():
    """JAQ's expected values with three agents are those worked by hand."""
    # what the middle agent expects: over the first, believed in where it stands (observation 1) to do
    # 1/4, 3/4, and the third (observation 0): 1/8, 7/8. q is 1 to 8 in the order 000, 001, 010, ..., 111
    settings = JAQ()
    memory = memory_of(settings, 3, 2, 2)
    memory.q[1, 1] = range(1, 9)
    memory.occurrence[0, 1] = [1 / 4, 3 / 4]
    memory.occurrence[2, 0] = [1 / 8, 7 / 8]
    memory.occurrence[0, 0] = memory.occurrence[2, 1] = memory.occurrence[1] = np.nan  # not to be read
    # EV(0) = 1/4*(1/8*1 + 7/8*2) + 3/4*(1/8*5 + 7/8*6) = (15 + 141)/32 = 4.875
    # EV(1), every value 2 greater: 6.875
    assert values(settings, memory, 1, [1, 1, 0]) == [4.875, 6.875]


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


@pytest.mark.parametrize(("reading", "first", "second"), [
    # 1. q1(0) = .5*4 + .5*(-2) = 1;                    q2(1) = .5*(-2) + 0 = -1
    # 2. TD1 = 2 + .5 - 1 = 1.5, RV1 = 2; TD2 = RV2 = 6; OP2(1) = 0, OP1(2) = 1
    #    q1(0) = 1 + .75 = 1.75;                        q2(0) = 3 + .5 = 3.5
    # 3. TD1 = -4 + .875 = -3.125, RV1 = -4 + 1.75 = -2.25; TD2 = -1 + 1.75 - 3.5 = -2.75, RV2 = -1
    #    OP2(1) = -1/3, OP1(2) = -2.25*2/3 = -1.5
    #    q1(1) = -1.5625 - 1/6;                         q2(0) = 3.5 - 1.375 - .75 = 1.375
    ({"bracket": "outside"}, [1.75, -1.5625 - 1 / 6], [1.375, -1]),
    # 1. as printed: 1.5, -1
    # 2. RV1 = TD1 = 1.25, OP1(2) = .625:               q2(0) = .5*(6 + .3125) = 3.15625
    # 3. RV1 = TD1 = -2.9375 = -47/16; RV2 = TD2 = -1 + 1.578125 - 3.15625 = -2.578125
    #    OP2(1) = -.859375, OP1(2) = -47/16*2/3 = -47/24
    #    q1(1) = .5*(-2.9375 - .4296875) = -1.68359375; q2(0) = 3.15625 + .5*(-2.578125 - 47/48)
    ({"opinion_discount": None}, [2.125, -1.68359375], [1.8671875 - 47 / 96, -1]),
    # 1. as printed: 1.5, -1
    # 2. RV1 = 2 - 1.5 = .5, OP1(2) = .25:              q2(0) = .5*(6 + .125) = 3.0625
    # 3. RV1 = -4, RV2 = -1 - 3.0625 = -4.0625; TD2 = -1 + 1.53125 - 3.0625 = -2.53125
    #    OP2(1) = -4.0625/3, OP1(2) = -8/3
    #    q1(1) = .5*(-2.9375 - 4.0625/6);               q2(0) = 3.0625 + .5*(-2.53125 - 4/3)
    ({"opinion_discount": 0.0}, [2.125, -1.46875 - 4.0625 / 12], [1.796875 - 2 / 3, -1]),
    # 1. nobody has done anything before: Pe = 0, 0; OP2(1) = -2*0, OP1(2) = 4*1
    #    q1(0) = .5*4 = 2;                              q2(1) = .5*(-2 + 2) = 0
    # 2. Pe = 1/1, 0/1; TD1 = 2 + 1 - 2 = 1, RV1 = 2; TD2 = RV2 = 6; OP2(1) = 6*0, OP1(2) = 2*1
    #    q1(0) = 2.5;                                   q2(0) = .5*(6 + 1) = 3.5
    # 3. Pe = 0/2, 1/2; TD1 = -4 + 1.25 = -2.75, RV1 = -1.5; TD2 = -1 + 1.75 - 3.5 = -2.75, RV2 = -1
    #    OP2(1) = -1*0, OP1(2) = -.75
    #    q1(1) = -1.375;                                q2(0) = 3.5 + .5*(-2.75 - .375) = 1.9375
    ({"present": False}, [2.5, -1.375], [1.9375, 0]),
    # the occurrence starts from 1/2 and moves half way to what was done
    # 1. Pe = 3/4, 3/4; OP2(1) = -1.5, OP1(2) = 4*1/4
    #    q1(0) = .5*(4 - .75) = 1.625;                  q2(1) = .5*(-2 + .5) = -.75
    # 2. Pe = 7/8, 5/8; TD1 = 2 + .8125 - 1.625 = 1.1875, RV1 = 2; TD2 = RV2 = 6
    #    OP2(1) = 6/8, OP1(2) = 2*3/8
    #    q1(0) = 1.625 + .5*(1.1875 + .375) = 2.40625;  q2(0) = .5*(6 + .375) = 3.1875
    # 3. Pe = (1/8 + 1)/2 = 9/16, (5/8 + 1)/2 = 13/16; TD1 = -4 + 1.203125, RV1 = -4 + 2.40625 = -1.59375
    #    TD2 = -1 + 1.59375 - 3.1875 = -2.59375, RV2 = -1
    #    OP2(1) = -9/16, OP1(2) = -1.59375*13/16 = -1.294921875
    #    q1(1) = .5*(-2.796875 - .28125) = -1.5390625
    #    q2(0) = 3.1875 + .5*(-2.59375 - .6474609375) = 1.56689453125
    ({"recency": 0.5}, [2.40625, -1.5390625], [1.56689453125, -0.75]),
    # the first moves before the second, who then judges by its new value
    # 1. and 2. as printed, since RV1 = r + max q1 - q1(0) while 0 is the first's best
    # 3. q1(1) = -1.46875 - 1/12 = -149/96 first; then RV1 = -4 + 2.125 + 149/96 = -31/96
    #    OP1(2) = -31/96*2/3 = -31/144;                 q2(0) = 3.25 + .5*(-2.625 - 31/288)
    ({"order": "in turn"}, [2.125, -149 / 96], [1.9375 - 31 / 576, -1]),
], ids=["outside", "opinions discounted", "opinions of the reward", "present not counted", "by recency", "in turn"])
def test_ivq_readings_by_hand(reading, first, second):
    """Every reading of IVQ learns from three steps what was worked by hand."""
    settings = IVQ(step_size=0.5, discount=0.5, influence=0.5, **reading)
    assert_q(learn(settings, IVQ_STEPS), first, second)


def test_ivq_never_seen():
    """If only earlier visits count, an action that was never seen counts nothing."""
    # by recency, too: without it the occurrence index would be what it starts from, 1/2
    settings = IVQ(step_size=0.5, influence=0.5, present=False, recency=0.5)
    # RV1 = 4, OP1(2) = 4*(1 - 0): q2(1) = .5*(-2 + .5*4) = 0; OP2(1) = -2*0: q1(0) = .5*4
    assert_q(learn(settings, IVQ_STEPS[:1]), [2, 0], [0, 0])


def test_ivq_end_of_episode():
    """At the end of an episode nothing that follows counts in an opinion."""
    # 1. as printed: 1.5, -1. 2. ends: TD1 = RV1 = 2 - 1.5 = .5, TD2 = RV2 = 6; OP2(1) = 0, OP1(2) = .25
    # q1(0) = 1.5 + .25; q2(0) = .5*(6 + .125)
    ends = (*IVQ_STEPS[1][:3], 0.0, ints(0, 0))
    settings = IVQ(step_size=0.5, discount=0.5, influence=0.5)
    assert_q(learn(settings, [IVQ_STEPS[0], ends]), [1.75, 0], [3.0625, -1])


def test_ivq_three_agents():
    """IVQ with three agents learns from three steps what was worked by hand."""
    # learning rate and influence .5, discount 0 (but RV counts the next value wholly)
    # 1. TD = RV = 2, -4, 6; Pe = 1, 1, 1: only the second's opinion is not 0, -4
    #    q1(0) = .5*(2 - 2) = 0;  q2(0) = -2;  q3(1) = .5*(6 - 2) = 2
    # 2. Pe = 1, 1/2, 1. RV1 = 4, RV2 = 4 + 0 - 0 = 4, RV3 = -2 + 2 - 2 = -2; TD = 4, 4, -2 - 2
    #    of the first: 4*0 and -2*1; of the second: 4*1/2 and -2*1/2; of the third: 4*0 and 4*0
    #    q1(0) = .5*(4 - 1) = 1.5;  q2(1) = .5*(4 + .5) = 2.25;  q3(1) = 2 + .5*(-4) = 0
    # 3. Pe = 1/3, 2/3, 1/3. RV1 = -3 + 1.5 = -1.5, RV2 = 3 + 2.25 + 2 = 7.25, RV3 = 0; TD = -3, 5, 0
    #    of the first: 7.25*2/3 and 0; of the second: -1.5*2/3 and 0; of the third: -1.5*1/3 and 7.25*2/3
    #    q1(1) = .5*(-3 + 29/12) = -7/24;  q2(0) = -2 + .5*(5 - .5) = .25;  q3(0) = .5*13/6
    settings = IVQ(step_size=0.5, influence=0.5)
    steps = repeated(((0, 0, 1), (2, -4, 6)), ((0, 1, 1), (4, 4, -2)), ((1, 0, 0), (-3, 3, 0)))
    assert_q(learn(settings, steps, agents=3), [1.5, -7 / 24], [0.25, 2.25], [13 / 12, 0])


# -- what holds for whatever was played -------------------------------------------------------------------


def all_values(settings, memory):
    """Worth of every agent's actions to it in observations (0, 1, 0), [N, A]."""
    seen = [0, 1, 0][: memory.q.shape[0]]
    return np.array([values(settings, memory, i, seen, ACTIONS) for i in range(memory.q.shape[0])])


@given(play=plays(), bracket=st.sampled_from(["inside", "outside"]), order=st.sampled_from(["simultaneous", "in turn"]))
def test_ivq_no_influence(play, bracket, order):
    """Without influence IVQ is IQ."""
    swayed = IVQ(discount=0.9, influence=0.0, bracket=bracket, order=order)
    assert learned(swayed, play).q.tobytes() == learned(IQ(discount=0.9, order=order), play).q.tobytes()


@given(play=plays())
def test_jaq_same_rewards(play):
    """JAQ agents that receive the same learn the same."""
    alike = [(s * 0, a, np.full(AGENTS, r[0]), *rest[:1], rest[1] * 0) for s, a, r, *rest in play]
    q = learned(JAQ(discount=0.9), alike).q
    assert q[1].tobytes() == q[0].tobytes()
    assert q[2].tobytes() == q[0].tobytes()


def close(actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("rule", PAPER)
@given(play=plays(), to=st.permutations(range(ACTIONS)))
def test_relabelled_actions(rule, play, to):
    """Relabelling actions relabels what is learned."""
    to, settings = np.array(to), rule(discount=0.9)  # action a is now called to[a]
    plain, other = learned(settings, play), learned(settings, [(s, to[a], *rest) for s, a, *rest in play])
    axes = plain.q.ndim + (AGENTS - 1 if settings.JOINT else 0)
    shape = (AGENTS, OBSERVATIONS) + (ACTIONS,) * (axes - 2)
    relabelled = other.q.reshape(shape)
    for axis in range(2, axes):
        relabelled = relabelled.take(to, axis)
    assert relabelled.tobytes() == plain.q.tobytes()
    assert other.occurrence[:, :, to].tobytes() == plain.occurrence.tobytes()
    close(all_values(settings, other)[:, to], all_values(settings, plain))


@pytest.mark.slow
@pytest.mark.parametrize("rule", PAPER)
@given(play=plays(), order=st.permutations(range(AGENTS)))
def test_relabelled_agents(rule, play, order):
    """Relabelling agents relabels what is learned."""
    order, settings = np.array(order), rule(discount=0.9)  # the i-th agent is now the one that was order[i]
    renamed = [(s[order], a[order], r[order], continues, s_t[order]) for s, a, r, continues, s_t in play]
    plain, other = learned(settings, play), learned(settings, renamed)
    expected = plain.q[order]
    if settings.JOINT:
        joint = expected.reshape((AGENTS, OBSERVATIONS) + (ACTIONS,) * AGENTS)
        expected = joint.transpose(0, 1, *(2 + order)).reshape(expected.shape)
    close(other.q, expected)  # influences are summed up in another order
    assert other.occurrence.tobytes() == plain.occurrence[order].tobytes()
    for i in range(AGENTS):
        seen = ints(0, 1, 0)
        close(values(settings, other, i, seen[order].tolist(), ACTIONS),
              values(settings, plain, order[i], seen.tolist(), ACTIONS))


@pytest.mark.parametrize("rule", [JAQ, IVQ])
@given(play=plays())
def test_occurrence(rule, play):
    """An action's occurrence is its share of the visits."""
    memory = learned(rule(), play)
    for i, s in np.ndindex(AGENTS, OBSERVATIONS):
        done = [int(a[i]) for seen, a, *_ in play if seen[i] == s]
        share = [done.count(a) / len(done) for a in range(ACTIONS)] if done else [1 / ACTIONS] * ACTIONS
        assert memory.visits[i, s] == len(done)
        close(memory.occurrence[i, s], share)


@pytest.mark.parametrize("rule", [JAQ, IVQ])
@given(play=plays(), recency=st.floats(0.01, 0.99))
def test_recency(rule, play, recency):
    """Recent choices count more by a constant factor."""
    memory = learned(rule(recency=recency), play)
    for i, s in np.ndindex(AGENTS, OBSERVATIONS):
        done = [int(a[i]) for seen, a, *_ in play if seen[i] == s]
        share = np.full(ACTIONS, (1 - recency) ** len(done) / ACTIONS)
        for age, a in enumerate(reversed(done)):
            share[a] += recency * (1 - recency) ** age
        close(memory.occurrence[i, s], share)


@given(play=plays(), q=vectors(st.floats(-30, 30), np.float64, ACTIONS**AGENTS))
def test_jaq_bounds(play, q):
    """JAQ's expected value lies between the least and the greatest joint value."""
    settings = JAQ()
    memory: Memory = learned(settings, play)
    memory.q[:] = q
    joint = q.reshape((ACTIONS,) * AGENTS)
    for i, expected in enumerate(all_values(settings, memory)):
        of_own = np.moveaxis(joint, i, 0).reshape(ACTIONS, -1)
        assert (of_own.min(axis=1) - 1e-9 <= expected).all()
        assert (expected <= of_own.max(axis=1) + 1e-9).all()
