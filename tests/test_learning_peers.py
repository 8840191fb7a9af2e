"""The five peers of the paper's rules: each as published, and Q-learning where there is nobody else."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from support.steps import ACTIONS, AGENTS, OBSERVATIONS, floats, ints, learn, learned, plays, values, vectors

from pitchlore.pipeline.stages.paradigms.rules import rules
from pitchlore.pipeline.stages.paradigms.rules.distributed import KEPT, Distributed
from pitchlore.pipeline.stages.paradigms.rules.fmq import FMQ, GREATEST, HITS, TAKEN
from pitchlore.pipeline.stages.paradigms.rules.hysteretic import Hysteretic
from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.lenient import TEMPERATURE, Lenient
from pitchlore.pipeline.stages.paradigms.rules.memory import Transition, memory_of
from pitchlore.pipeline.stages.paradigms.rules.rules import rule_number
from pitchlore.pipeline.stages.paradigms.rules.selection import ActionSelection, selection_weights
from pitchlore.pipeline.stages.paradigms.rules.wolf_phc import MEAN, POLICY, WoLFPHC


def played(learner, *steps, agents=2):
    """The memory after steps of a repeated team game: (actions, reward) or (actions, reward, coins) each."""
    still = ints(*[0] * agents)
    return learn(learner, [
        (still, ints(*actions), np.full(agents, float(reward)), 1.0, still, *coins) for actions, reward, *coins in steps
    ], agents=agents, actions=ACTIONS)


def chances(selection, out, temperature):
    weights = np.empty_like(out)
    selection_weights(selection, out, temperature, weights)
    return weights / weights.sum()


def greedy(learner, memory, agent):
    """Action of the agent at temperature 0, which must be one."""
    [done] = np.flatnonzero(chances(ActionSelection.BOLTZMANN, np.array(values(learner, memory, agent)), 0.0))
    return int(done)


# -- three steps on paper ---------------------------------------------------------------------------------


def test_hysteretic_by_hand():
    """The hysteretic learner learns from three steps what was worked by hand."""
    learner = Hysteretic(step_size=0.5, decrease=0.1, discount=0.5)
    steps = ((0, 0), 10), ((0, 1), -30), ((0, 0), 10)
    # 1. both: 10 + .5*0 - 0 = 10;                       q1 = [5, 0], q2 = [5, 0]
    # 2. first: -30 + .5*5 - 5 = -32.5, of which .1/.5 = .2 counts: q1[0] = 5 - .5*6.5 = 1.75
    #    second: -30 + .5*5 - 0 = -27.5, so -5.5:         q2[1] = -2.75
    # 3. first: 10 + .5*1.75 - 1.75 = 9.125;              q1[0] = 1.75 + 4.5625 = 6.3125
    #    second: 10 + .5*5 - 5 = 7.5;                     q2[0] = 5 + 3.75 = 8.75
    memory = played(learner, *steps)
    np.testing.assert_allclose(memory.q[:, 0], [[6.3125, 0, 0], [8.75, -2.75, 0]], rtol=0, atol=1e-12)
    assert values(learner, memory, 1) == memory.q[1, 0].tolist()


def test_fmq_by_hand():
    """FMQ with three agents learns from three steps what was worked by hand."""
    learner = FMQ(step_size=0.5, weight=2.0)
    steps = ((0, 0, 1), 8), ((0, 1, 1), -4), ((0, 1, 0), -4)
    # q (discount 0, so the error is r - q), then the greatest reward, how often it came, how often taken:
    # 1. all: 4;  first (0): 8 1/1, second (0): 8 1/1, third (1): 8 1/1
    # 2. first q[0] = 4 + .5*(-4 - 4) = 0, 8 1/2; second q[1] = -2, -4 1/1; third q[1] = 0, 8 1/2
    # 3. first q[0] = 0 + .5*(-4 - 0) = -2, 8 1/3; second q[1] = -2 + .5*(-4 + 2) = -3, -4 2/2;
    #    third q[0] = -2, -4 1/1
    memory = played(learner, *steps, agents=3)
    assert memory.q[:, 0].tolist() == [[-2, 0, 0], [4, -3, 0], [-2, 0, 0]]
    assert memory.aux[0, 0, 0].tolist() == [8, 1, 3]
    assert memory.aux[1, 0, 1, [GREATEST, HITS, TAKEN]].tolist() == [-4, 2, 2]
    # EV = q + 2 * hits/taken * greatest, of what was never taken q:
    # the first -2 + 2*8/3; the second 4 + 2*8 and -3 - 2*4; the third -2 - 2*4 and 0 + 2*8/2
    expected = [[-2 + 16 / 3, 0, 0], [20, -11, 0], [-10, 8, 0]]
    np.testing.assert_allclose(
        [values(learner, memory, i) for i in range(3)], expected, rtol=0, atol=1e-12
    )


def test_lenient_by_hand():
    """The lenient learner learns from three steps what was worked by hand."""
    # leniency ln 2: at temperature 2, 1, .5 an error below 0 is forgiven with probability
    # 1 - 2**-2 = .75, 1 - 2**-1 = .5, 1 - 2**-.5 = .29
    learner = Lenient(step_size=0.5, leniency=math.log(2), temperature=2.0, cooling=0.5)
    steps = ((0, 0), -8, [0.7, 0.8]), ((0, 1), -8, [0.6, 0.7]), ((0, 0), -2, [0.0, 0.0])
    # 1. errors -8: first .7 < .75, forgiven; second .8 > .75, q2[0] = -4; both cool action 0 to 1
    # 2. first .6 > .5, q1[0] = -4, cools to .5; second's action 1 is still at 2: .7 < .75, forgiven, to 1
    # 3. errors -2 + 4 = 2 are not below 0, whatever the coin: q[0] = -4 + 1 = -3; they cool to .25 and .5
    memory = played(learner, *steps)
    assert memory.q[:, 0].tolist() == [[-3, 0, 0], [-3, 0, 0]]
    assert memory.aux[:, 0, :, TEMPERATURE].tolist() == [[0.25, 2, 2], [0.5, 1, 2]]
    memory = played(learner, *steps[:2])
    assert memory.q[:, 0].tolist() == [[-4, 0, 0], [-4, 0, 0]]


def test_distributed_by_hand():
    """The distributed learner learns in the penalty game what was worked by hand."""
    learner = Distributed()
    steps = ((2, 2), 10), ((0, 0), 10), ((0, 2), -100)
    # 1. q[2] = 10 is the greatest: both keep to 2. 2. q[0] = 10 ties: both still keep to 2, or one of
    # them might do 0 and the other 2. 3. -100 is below both 10s: nothing changes
    memory = played(learner, *steps)
    assert memory.q[:, 0].tolist() == [[10, 0, 10], [10, 0, 10]]
    assert memory.aux[:, 0, :, KEPT].tolist() == [[0, 0, 1], [0, 0, 1]]
    assert [greedy(learner, memory, i) for i in range(2)] == [2, 2]


def test_wolf_phc_by_hand():
    """WoLF-PHC learns from three steps what was worked by hand."""
    learner = WoLFPHC(step_size=0.5, winning=0.06, losing=0.24)
    steps = ((0, 1), 6), ((1, 1), 30), ((1, 1), -12)
    # the first agent; policy and mean start at 1/3 each
    # 1. q = [3, 0, 0]. Mean: 1/3. The policy brings no more than its mean: losing, step .24.
    #    Actions 1 and 2 give min(1/3, .12) each:          policy = [1/3 + .24, 1/3 - .12, 1/3 - .12]
    # 2. q = [3, 15, 0]. Mean: half way, 1/3 + [.12, -.06, -.06]. Policy - mean = [.12, -.06, -.06]
    #    brings .36 - .9 < 0: losing. 0 and 2 give .12:    policy = [1/3 + .12, 1/3 + .12, 1/3 - .24]
    # 3. q[1] = 15 - 13.5 = 1.5. Mean moves a third of policy - mean = [0, .18, -.18]:
    #    1/3 + [.12, 0, -.12]. Policy - mean = [0, .12, -.12] brings .18 > 0: winning, step .06.
    #    1 gives .03, and 2, which has 1/3 - .24 = .0933, too: policy = [1/3 + .18, 1/3 + .09, 1/3 - .27]
    memory = played(learner, *steps)
    assert memory.q[0, 0].tolist() == [3, 1.5, 0]
    third = 1 / 3
    np.testing.assert_allclose(
        memory.aux[0, 0, :, POLICY], [third + 0.18, third + 0.09, third - 0.27], rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(
        memory.aux[0, 0, :, MEAN], [third + 0.12, third, third - 0.12], rtol=0, atol=1e-12
    )
    # the second: q = [0, 3, 0], [0, 16.5, 0], [0, 2.25, 0]: 1 stays the best. Losing at first
    # (equal to the mean), then winning: from 1/3 + .24 by .06 to 1/3 + .30 and 1/3 + .36
    np.testing.assert_allclose(
        values(learner, memory, 1), [third - 0.18, third + 0.36, third - 0.18], rtol=0, atol=1e-12
    )


# -- what holds for whatever was played -------------------------------------------------------------------


@pytest.mark.parametrize("learner", [Hysteretic(), FMQ(), Lenient()], ids=lambda learner: learner.rule)
@given(play=plays(agents=1))
def test_one_agent_chooses(learner, play):
    """With one agent the peer chooses as Q-learning does."""
    memory = learned(learner, play, agents=1)
    for seen in range(OBSERVATIONS):
        assert values(learner, memory, 0, [seen]) == memory.q[0, seen].tolist()


@pytest.mark.slow
@pytest.mark.parametrize("neutral", [
    Hysteretic(discount=0.9, decrease=0.1), FMQ(discount=0.9, weight=0.0), Lenient(discount=0.9, leniency=0.0),
    Lenient(discount=0.9, cooling=0.0, temperature=0.0),
], ids=["patience 1", "weight 0", "leniency 0", "temperature 0"])
@given(play=plays())
def test_neutral_setting(neutral, play):
    """With the peer's own setting neutral, a team learns as IQ does."""
    memory, alone = learned(neutral, play), learned(IQ(discount=0.9), play)
    assert memory.q.tobytes() == alone.q.tobytes()
    for i in range(AGENTS):
        assert values(neutral, memory, i) == alone.q[i, 0].tolist()


@given(
    game=st.lists(st.sampled_from([-1.7, 0.0, 0.2, 0.4, 0.9, 1.7]), min_size=27, max_size=27),
    play=st.lists(vectors(st.integers(0, ACTIONS - 1), np.int64), max_size=40),
)
def test_distributed_agreement(game, play):
    """Distributed agents agree on the joint action that was best first."""
    # whatever ties with it later, and however x + (r - x) was rounded: all saw the greatest value rise at once
    payoff = np.array(game).reshape((ACTIONS,) * AGENTS)
    won = [payoff[tuple(joint)] for joint in play]
    memory = played(learner := Distributed(), *zip(play, won, strict=True), agents=AGENTS)
    if max(won, default=0.0) > 0.0:
        best_first = play[int(np.argmax(won))].tolist()
        assert [greedy(learner, memory, i) for i in range(AGENTS)] == best_first


def test_distributed_rounding():
    """The distributed learner does not take rounding for news."""
    # .2 + (.9 - .2) falls short of .9: when another action then brings .9 from 0, nothing rose
    assert 0.2 + (0.9 - 0.2) < 0.9
    steps = ((0, 0), 0.2), ((0, 1), 0.9), ((2, 2), 0.9)
    memory = played(Distributed(), *steps)
    assert [greedy(Distributed(), memory, i) for i in range(2)] == [0, 1]


@given(play=plays(), winning=st.floats(0.001, 1), ratio=st.floats(1, 4))
def test_wolf_phc_distribution(play, winning, ratio):
    """WoLF-PHC's policy and its mean stay distributions."""
    learner = WoLFPHC(winning=winning, losing=min(1.0, winning * ratio), discount=0.9)
    memory = learned(learner, play)
    for plane in (POLICY, MEAN):
        policies = memory.aux[..., plane]
        assert policies.min() >= 0.0
        np.testing.assert_allclose(policies.sum(axis=2), 1.0, rtol=0, atol=1e-12)


@given(temperature=st.floats(0, 5), leniency=st.floats(0, 3))
def test_lenient_forgiveness(temperature, leniency):
    """A lenient agent forgives as often as its settings say, and never good news."""
    learner = Lenient(temperature=temperature, leniency=leniency)
    memory, params, still = memory_of(learner, 2, 1, ACTIONS), learner.params(2), ints(0, 0)
    coins = (np.arange(500) + 0.5) / 500
    worse, better = (Transition(still, still, floats(r, r), 1.0, still) for r in (-1, 0.01))
    errors = [rules.error(rule_number(learner), memory, params, 0, worse, float(u)) for u in coins]
    assert errors.count(0.0) / 500 == pytest.approx(1 - math.exp(-leniency * temperature), abs=1 / 500)
    assert set(errors) <= {0.0, -1.0}
    # and never good news
    assert rules.error(rule_number(learner), memory, params, 0, better, 0.0) == 0.01


@pytest.mark.parametrize(
    ("settings_of", "says"),
    [(lambda: Hysteretic(step_size=0.1, decrease=0.2), "decrease 0.2 is above step_size 0.1"),
     (lambda: WoLFPHC(winning=0.2, losing=0.1), "losing 0.1 is below winning 0.2"),
     (lambda: FMQ(weight=-1.0), "greater than or equal to 0"),
     (lambda: Lenient(cooling=1.1), "less than or equal to 1"),
     (lambda: Distributed(step_size=0.0), "greater than 0")],
)
def test_bad_settings(settings_of, says):
    """Settings that contradict the rule are refused."""
    with pytest.raises(ValidationError, match=says):
        settings_of()
