"""Training that goes on until a team settles: what a look sees, when it ends, and what JAQ comes to."""

import numpy as np
import pytest
from pydantic import ValidationError

from pitchlore.pipeline.stages.paradigms import runner
from pitchlore.pipeline.stages.paradigms.curves import Curve
from pitchlore.pipeline.stages.paradigms.games import matrix
from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.jaq import JAQ
from pitchlore.pipeline.stages.paradigms.rules.memory import memory_of
from pitchlore.pipeline.stages.paradigms.rules.rules import rule_number
from pitchlore.pipeline.stages.paradigms.runner import (
    Training,
    dynamics_of,
    learner_of,
    play_runs,
    stream,
    trained,
)
from pitchlore.pipeline.stages.paradigms.settling import Settling, greedy_joint_action
from pitchlore.schemas import Paradigms

RULE, PARAMS = rule_number(JAQ()), JAQ().params(2)


def team(beliefs):
    """Two JAQ learners who know the climbing game's payoffs; ``beliefs`` about each one's actions."""
    memory = memory_of(JAQ(), 2, 1, 3)
    memory.q[:, 0] = np.ravel(matrix.CLIMBING)
    memory.occurrence[:, 0] = beliefs
    return memory


@pytest.mark.parametrize(("beliefs", "joint", "stays"), [
    ([[0, 1, 0], [0, 1, 0]], (1, 1), True),  # an equilibrium, for certain
    ([[1, 0, 0], [1, 0, 0]], (0, 0), True),
    ([[0.2, 0.4, 0.4], [0.2, 0.4, 0.4]], (2, 2), False),  # 5 * .4 beats -6 + 5.2; certain of 2, the first takes 1
    ([[1, 0, 0], [0, 1, 0]], (1, 0), False),
])
def test_look(beliefs, joint, stays):
    """A look sees the greedy joint action, and whether it is an answer to itself; it changes no belief."""
    memory = team(beliefs)
    now, is_answer = greedy_joint_action(RULE, memory, PARAMS)
    assert (tuple(now), is_answer) == (joint, stays)
    np.testing.assert_array_equal(memory.occurrence[:, 0], beliefs)


def test_nothing_changes_any_more():
    """Whatever settled stays as it is, however long it goes on: beliefs move to what is played."""
    game, settings = matrix.climbing(), JAQ()
    dynamics, learner = dynamics_of(game, settings), learner_of(settings, 2)
    for run in range(20):
        rng = stream((4,), run)
        memory, _ = trained(rng, dynamics, learner, settings, Training(16 * 0.99 ** np.arange(735)))
        bounded, settled, steps = runner._settle(rng, dynamics, learner, memory, 0, 0.01, 735, 1_000, 1_000)
        assert bounded
        assert settled
        assert steps > 735
        there = tuple(greedy_joint_action(learner.rule, memory, learner.params)[0])
        for _ in range(4):
            runner._train(rng, dynamics, learner, memory, 0, np.full(20 * steps, 0.01), False, 1)
            assert tuple(greedy_joint_action(learner.rule, memory, learner.params)[0]) == there


def settled(beliefs, step_size=0.1, **more):
    """State of a team that knows the game, after 100 steps of training: bounded, settled, steps."""
    settings = JAQ(step_size=step_size)
    dynamics, learner = dynamics_of(matrix.climbing(), settings), learner_of(settings, 2)
    memory = team(beliefs)
    memory.visits[:] = 10**9  # beliefs stand still
    settling = Settling(**more)
    return runner._settle(stream((1,), 0), dynamics, learner, memory, 0, 0.01, 100, settling.still, settling.most)


def test_bound():
    """A team that never settles ends at the bound, and says so."""
    never = [[0.2, 0.4, 0.4]] * 2
    assert settled(never, still=10, most=5) == (True, False, 500)
    assert settled(never, still=150, most=5) == (True, False, 550)
    assert settled(never, most=1) == (True, False, 100)


def test_least_training():
    """A team that stands as it should is looked at twice: it trains one stretch more, late a hundredth."""
    assert settled([[0, 1, 0]] * 2) == (True, True, 1_100)
    assert settled([[0, 1, 0]] * 2, still=1) == (True, True, 101)
    assert settled([[0.2, 0.4, 0.4]] * 2, still=1, most=2) == (True, False, 200)


def test_printed_jaq_settles():
    """Printed JAQ ends in no equilibrium at .999 when the temperature ends; settled it is in (a1, b1) and no other."""
    game = matrix.climbing()
    temperatures = 16 * 0.999 ** np.arange(7375)
    ended, settled = (
        play_runs(game, JAQ(), Training(temperatures, settling=settling), runner.Testing(), runs=range(60), seeds=(1,))
        for settling in (None, Settling()))
    equilibrium = matrix.pure_equilibria(game)
    assert not equilibrium[ended.last].any()
    assert not ended.settled.any()
    assert not ended.settle_steps.any()
    assert settled.settled.all()
    assert set(settled.last) == {4}
    assert (settled.settle_steps > 7375).all()


def test_point():
    """A point says how many teams settled, and after how many steps; other points leave both null."""
    common = {"figure": 5, "game": "climbing", "learner": "JAQ", "reading": "x", "decays": (0.99,), "rule": JAQ()}
    row, other = (Paradigms.validate(Curve(settle=settle, **common).play(None, 0.99, runs=8, seed=1)).row(0, named=True)
                  for settle in (True, False))
    assert row["settled"] == 1.0
    assert row["settle_steps"] > row["steps"] == 735
    assert (other["settled"], other["settle_steps"]) == (None, None)


@pytest.mark.parametrize("game", ["grid", "fully stochastic climbing"])
def test_games(game):
    """Only in games of one state and certain rewards can a team settle."""
    with pytest.raises(ValidationError, match="one state and certain rewards: penalty, climbing"):
        Curve(figure=5, game=game, learner="IQ", reading="x", rule=IQ(), decays=(0.99,), settle=True)
