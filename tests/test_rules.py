"""Laws of every learning rule in the table: a new entry is tested here without another line.

Other settings of the paper's rules and their peers are compared with the literals in test_paradigms.
"""

import shutil
from pathlib import Path

import numpy as np
import pytest
from _pytest.outcomes import Failed
from hypothesis import given
from pydantic import TypeAdapter
from support import literal_learning as literal
from support.planning import index_of
from support.steps import ACTIONS, OBSERVATIONS, learned, plays
from support.training import learn

from pitchlore import pipeline
from pitchlore.pipeline import _kernels
from pitchlore.pipeline.stages.paradigms.games import matrix
from pitchlore.pipeline.stages.paradigms.games.grid import grid_world
from pitchlore.pipeline.stages.paradigms.rules.kernel import kernel, switch
from pitchlore.pipeline.stages.paradigms.rules.rules import RULES, AnyLearner
from pitchlore.pipeline.stages.paradigms.rules.selection import ActionSelection
from pitchlore.pipeline.stages.paradigms.runner import Testing as Trial
from pitchlore.pipeline.stages.paradigms.runner import Training, play_runs, stream

SEEDS = (5,)
GAMES = {
    "climbing": (matrix.climbing(), literal.MatrixGame(matrix.CLIMBING, 2)),
    "grid": (grid_world(10.0), literal.GridWorld(10.0)),
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


@pytest.mark.slow
@every_rule
@given(play=plays(agents=1))
def test_one_agent(rule, play):
    """With one agent every rule is Q-learning, bit by bit."""
    q = np.zeros((OBSERVATIONS, ACTIONS))
    for [s], [a], [r], continues, [s_next] in play:
        q[s, a] += 0.1 * (r + 0.9 * continues * q[s_next].max() - q[s, a])
    memory = learned(rule.settings(step_size=0.1, discount=0.9), play, agents=1)
    assert memory.q[0].tobytes() == q.tobytes()


def literal_of(rule):
    """Class of the same rule in plain Python."""
    name = rule.settings.__name__
    if name not in literal.KINDS:
        pytest.fail(f"{name} has no literal: write class {name} in tests/support/literal_learning.py")
    return literal.KINDS[name]


@every_rule
@pytest.mark.parametrize("selection", [ActionSelection.BOLTZMANN, ActionSelection.EPSILON_GREEDY])
@pytest.mark.parametrize("game", GAMES)
def test_literal(rule, selection, game):
    """Runs with default settings equal those of the literal rule, one by one."""
    literal_of(rule)
    (compiled, plain), settings = GAMES[game], rule.settings(discount=0.5)
    start = 16.0 if selection is ActionSelection.BOLTZMANN else 1.0
    training, testing = Training(np.geomspace(start, 0.05, 300), selection), Trial(tests=3, steps=25)
    played = play_runs(compiled, settings, training, testing, runs=range(3), seeds=SEEDS)
    for run in range(3):
        expected = literal.play(stream(SEEDS, run), plain, settings, training, testing)
        assert played.last[run] == index_of(compiled, expected.last)
        assert played.success[run] == expected.success
        q = learn(compiled, settings, training, run=run, seeds=SEEDS).q
        known = sorted(value for agent in expected.team for value in agent.q.values())
        np.testing.assert_allclose(np.sort(q[q != settings.initial]), [v for v in known if v], rtol=1e-9)


def test_a_missing_literal(monkeypatch):
    """A rule without a literal fails the law, and the message names the file."""
    monkeypatch.delitem(literal.KINDS, "FMQ")
    (fmq,) = [rule for rule in RULES if rule.settings.__name__ == "FMQ"]
    with pytest.raises(Failed, match=r"class FMQ in tests/support/literal_learning\.py"):
        literal_of(fmq)


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
