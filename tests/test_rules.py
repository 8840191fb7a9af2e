"""Laws of every learning rule in the table: a new entry is tested here without another line."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from support import literal_learning as literal
from support.grid import state_of
from support.planning import index_of
from support.training import learn

from pitchlore import pipeline
from pitchlore.pipeline import _kernels
from pitchlore.pipeline.stages.paradigms.games import matrix
from pitchlore.pipeline.stages.paradigms.games.grid import grid_world
from pitchlore.pipeline.stages.paradigms.rules.distributed import KEPT, Distributed
from pitchlore.pipeline.stages.paradigms.rules.fmq import FMQ
from pitchlore.pipeline.stages.paradigms.rules.hysteretic import Hysteretic
from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.ivq import IVQ
from pitchlore.pipeline.stages.paradigms.rules.jaq import JAQ
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel, switch
from pitchlore.pipeline.stages.paradigms.rules.lenient import Lenient
from pitchlore.pipeline.stages.paradigms.rules.memory import Transition, memory_of
from pitchlore.pipeline.stages.paradigms.rules.rules import RULES, AnyLearner, adapt, error, rule_number
from pitchlore.pipeline.stages.paradigms.rules.selection import ActionSelection
from pitchlore.pipeline.stages.paradigms.rules.team import TeamQ
from pitchlore.pipeline.stages.paradigms.rules.wolf_phc import WoLFPHC
from pitchlore.pipeline.stages.paradigms.runner import Testing as Trial
from pitchlore.pipeline.stages.paradigms.runner import Training, play_runs, stream

SEEDS = (7, 11)
CLIMBING = [[11, -30, 0], [-30, 7, 6], [0, 0, 5]]
STOCHASTIC = [[[10, 12], [5, -65], [8, -8]], [[5, -65], [14, 0], [12, 0]], [[5, -5], [5, -5], [7, 3]]]

#: Three agents: 11, 7, 5 for all alike; -30 where anybody does 0 and anybody 1; 6 for the first doing 1 and
#: others 1 or 2; else nothing.
THREE = [
    [[11, -30, 0], [-30, -30, -30], [0, -30, 0]],
    [[-30, -30, -30], [-30, 7, 6], [-30, 6, 6]],
    [[0, -30, 0], [-30, 0, 0], [0, 0, 5]],
]

GAMES = {
    "penalty": (matrix.penalty(-10), literal.MatrixGame([[10, 0, -10], [0, 2, 0], [-10, 0, 10]], 2)),
    "climbing": (matrix.climbing(), literal.MatrixGame(CLIMBING, 2)),
    "stochastic climbing": (matrix.fully_stochastic_climbing(), literal.MatrixGame(STOCHASTIC, 2)),
    "three-agent climbing": (matrix.matrix_game("three-agent climbing", THREE), literal.MatrixGame(THREE, 3)),
    "grid": (grid_world(10.0), literal.GridWorld(10.0)),
}

LEARNERS = {
    "IQ from 5, discounting": (IQ(initial=5.0, discount=0.9), ActionSelection.EPSILON_GREEDY),
    "IQ on what is its own": (IQ(observes="own", discount=1.0), ActionSelection.BOLTZMANN),
    "JAQ by recency, own": (JAQ(recency=0.1, discount=0.9, observes="own"), ActionSelection.BOLTZMANN),
    "IVQ outside": (IVQ(bracket="outside", discount=0.9, opinion_discount=None), ActionSelection.BOLTZMANN),
    "IVQ whose opinions are of the reward": (IVQ(opinion_discount=0.0, discount=0.5), ActionSelection.BOLTZMANN),
    "IVQ present not counted": (IVQ(present=False, discount=0.5), ActionSelection.BOLTZMANN),
    "IVQ by recency, own": (IVQ(recency=0.1, present=False, observes="own"), ActionSelection.BOLTZMANN),
    "FMQ": (FMQ(weight=2.0), ActionSelection.BOLTZMANN),
    "lenient": (Lenient(cooling=0.9, discount=0.9), ActionSelection.BOLTZMANN),
    "distributed, greedy at times": (Distributed(step_size=0.5), ActionSelection.EPSILON_GREEDY),
    "WoLF-PHC": (WoLFPHC(winning=0.01, losing=0.04, discount=0.5), ActionSelection.MIXED),
}
#: And each rule as it is by default, so that a new entry is compared, too.
LEARNERS |= {
    f"{rule.settings.__name__}, {selection.name}": (rule.settings(discount=0.9), selection)
    for rule in RULES for selection in (ActionSelection.BOLTZMANN, ActionSelection.EPSILON_GREEDY)
}

every_rule = pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.settings.__name__)


@every_rule
def test_settings_round_trip(rule):
    """Settings in JSON come back as settings of the same rule."""
    settings = rule.settings(discount=0.5)
    again = TypeAdapter(AnyLearner).validate_json(settings.model_dump_json())
    assert type(again) is rule.settings
    assert again == settings


def test_names():
    """No two rules share a name or a class of settings."""
    assert len({rule.settings().rule for rule in RULES}) == len({rule.settings for rule in RULES}) == len(RULES)


def taught(settings, agents, steps):
    """The memory of agents after steps: seen and done by each, reward, whether it goes on, and seen next."""
    number, params, memory = rule_number(settings), settings.params(agents), memory_of(settings, agents, 2, 3)
    for seen, done, r, continues, after in steps:
        step = Transition(np.array(seen), np.array(done), np.full(agents, r), continues, np.array(after))
        for i in range(agents):
            memory.q[i, seen[i], done[i]] += params.step_size * error(number, memory, params, i, step, 0.5)
        for i in range(agents):
            adapt(number, memory, params, i, step)
    return memory


@pytest.mark.slow
@every_rule
@given(play=st.lists(st.tuples(
    st.integers(0, 1), st.integers(0, 2), st.floats(-30, 30), st.sampled_from([0.0, 1.0]), st.integers(0, 1)), max_size=20))
def test_one_agent(rule, play):
    """With one agent every rule is Q-learning, bit by bit."""
    q = np.zeros((2, 3))
    for s, a, r, continues, s_next in play:
        q[s, a] += 0.1 * (r + 0.9 * continues * q[s_next].max() - q[s, a])
    memory = taught(rule.settings(step_size=0.1, discount=0.9), 1, [([s], [a], r, *rest, [s_next]) for s, a, r, *rest, s_next in play])
    assert memory.q[0].tobytes() == q.tobytes()


def test_distributed_rounding():
    """The distributed learner does not take rounding for news."""
    # .2 + (.9 - .2) falls short of .9: when another action then brings .9 from 0, nothing rose
    memory = taught(Distributed(), 2, [([0, 0], done, r, 1.0, [0, 0]) for done, r in (([0, 0], 0.2), ([0, 1], 0.9), ([2, 2], 0.9))])
    assert memory.aux[:, 0, :, KEPT].argmax(axis=1).tolist() == [0, 1]


def literal_of(settings):
    """Class of the same rule in plain Python."""
    name = type(settings).__name__
    if name not in literal.KINDS:
        pytest.fail(f"{name} has no literal: write class {name} in tests/support/literal_learning.py")
    return literal.KINDS[name]


def falling(selection, ticks):
    """Temperatures from hot to nearly greedy."""
    start, end = (16.0, 0.05) if selection is ActionSelection.BOLTZMANN else (1.0, 0.01)
    return np.geomspace(start, end, ticks)


def literal_memory(played, game, settings):
    """Knowledge of the literal team, as Memory's q and occurrence (the latter None where none is kept)."""
    game = game.as_one_agent() if settings.ONE_FOR_ALL else game
    observed = game.observed(settings.observes)
    shape = (game.agents, int(observed.max()) + 1)
    joint = game.actions**game.agents
    q = np.full((*shape, joint if settings.JOINT else game.actions), settings.initial)
    occurrence = np.full((*shape, game.actions), 1 / game.actions)

    def number(agent, seen):
        if seen == "again":
            return 0
        return state_of(*seen) if isinstance(seen[0], tuple) else state_of((1, 1), seen)

    for i, agent in enumerate(played.team):
        for (seen, done), value in agent.q.items():
            q[i, number(i, seen), index_of(game, done) if settings.JOINT else done] = value
        share = agent.occurrence if isinstance(agent, literal.IVQ) else None
        if isinstance(agent, literal.JAQ):
            share = played.team[i - 1].beliefs[i]  # what another believes of it
        for seen in share.been if share else ():
            occurrence[i, number(i, seen)] = [share(seen, a, None) for a in range(game.actions)]
    return q, occurrence


@pytest.mark.slow
@pytest.mark.parametrize("game", GAMES)
@pytest.mark.parametrize("learner", LEARNERS)
def test_literal_loop(learner, game):
    """Runs equal the literal loop, one by one."""
    (settings, selection), (compiled, plain) = LEARNERS[learner], GAMES[game]
    literal_of(settings)
    for order, tick in (("simultaneous", "step"), ("in turn", "episode")):
        settings = settings.model_copy(update={"order": order})
        temperatures = falling(selection, 300 if tick == "step" else 20)
        training = Training(temperatures, selection, tick, episode_steps=10_000 if tick == "step" else 15)
        testing = Trial(tests=3, steps=25, temperature=0.0 if tick == "step" else 0.3)
        runs = range(3, 6)
        played = play_runs(compiled, settings, training, testing, runs=runs, seeds=SEEDS)
        for place, run in enumerate(runs):
            expected = literal.play(stream(SEEDS, run), plain, settings, training, testing)
            assert played.last[place] == index_of(compiled, expected.last)
            assert played.success[place] == expected.success
            np.testing.assert_allclose(played.length[place], expected.length, rtol=1e-15)
            assert not played.diverged[place]
            memory = learn(compiled, settings, training, run=run, seeds=SEEDS)
            q, occurrence = literal_memory(expected, compiled, settings)
            if isinstance(settings, IVQ | Hysteretic):  # IV and beta outside, in other words
                np.testing.assert_allclose(memory.q, q, rtol=1e-12, atol=1e-12)
            else:
                np.testing.assert_array_equal(memory.q, q)
            np.testing.assert_allclose(memory.occurrence, occurrence, rtol=1e-12, atol=1e-12)


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


@pytest.mark.parametrize("agents", [2, 3, 4])
def test_cost_of_a_team(agents):
    """States and actions of a team multiply: (S * A)**N values, and A**N steps until all joint actions are tried."""
    def table(game, settings, steps):
        return learn(game, settings, Training(np.zeros(steps)), run=0, seeds=SEEDS).q

    pays, eager = np.arange(3.0**agents), TeamQ(step_size=1.0, initial=100.0)
    game = matrix.matrix_game("mean", pays.reshape(*(3,) * agents, 1) + np.arange(agents) - (agents - 1) / 2, individual=True)
    assert (table(game, eager, 3**agents - 1) == eager.initial).sum() == 1
    assert table(game, eager, 3**agents).tolist() == [[pays.tolist()]]
    assert [table(game, rule, 1).size for rule in (JAQ(), IQ())] == [agents * 3**agents, agents * 3]
    assert table(grid_world(0.0), TeamQ(), 1).size == (25 * 4)**2


@kernel
def double(x):
    return 2 * x


@kernel
def negative(x):
    return -x


def test_switch():
    """The compiled switch calls the function at the number's place; one function may stand at several."""
    call = switch("double_or_negative", [double, negative, double])
    assert [call(number, 5) for number in range(3)] == [10, -5, 10]


def test_the_cache_follows_the_table(tmp_path):
    """Another order of RULES gives numba's cache another name: compiled numbers are never mixed up."""
    own = Path("stages", "paradigms", "rules")
    shutil.copytree(Path(pipeline.__file__).parent / own, tmp_path / own, ignore=shutil.ignore_patterns("__pycache__"))
    before = _kernels(tmp_path)
    table = tmp_path / own / "rules.py"
    table.write_text(table.read_text().replace("    LearningRule(iq.IQ),\n", "").replace("RULES = (\n", "RULES = (\n    LearningRule(iq.IQ),\n"))
    assert _kernels(tmp_path) == before
    table.write_text(table.read_text().replace("    LearningRule(iq.IQ),\n", "").replace("wolf_phc.values),\n", "wolf_phc.values),\n    LearningRule(iq.IQ),\n"))
    assert _kernels(tmp_path) != before
