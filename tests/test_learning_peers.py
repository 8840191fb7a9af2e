"""The five peers of the paper's rules: each as published, and Q-learning where there is nobody else."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from support.steps import ACTIONS, AGENTS, OBSERVATIONS, floats, ints, learn, learned, plays, values, vectors

from pitchlore.pipeline.stages.paradigms.rules import rules
from pitchlore.pipeline.stages.paradigms.rules.distributed import Distributed
from pitchlore.pipeline.stages.paradigms.rules.fmq import FMQ
from pitchlore.pipeline.stages.paradigms.rules.hysteretic import Hysteretic
from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.lenient import Lenient
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
