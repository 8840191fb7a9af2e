"""Learning in the climbing game: the kernel on all cores beside the loops that a user would write."""

import math

import numpy as np
import pytest
from support.training import learn

from pitchlore.pipeline.stages.paradigms.games.matrix import CLIMBING, climbing
from pitchlore.pipeline.stages.paradigms.rules.iq import IQ
from pitchlore.pipeline.stages.paradigms.rules.ivq import IVQ
from pitchlore.pipeline.stages.paradigms.rules.jaq import JAQ
from pitchlore.pipeline.stages.paradigms.runner import Testing as Trial
from pitchlore.pipeline.stages.paradigms.runner import Training, play_runs, stream

#: The paper's best decay.
TEMPERATURES = 16 * 0.9997 ** np.arange(24_589)
RUNS = 400
SEEDS = (0,)


def softmax_draw(values, temperature, u):
    best = max(values)
    weights = [math.exp((value - best) / temperature) for value in values]
    left = u * sum(weights)
    for action, weight in enumerate(weights):
        left -= weight
        if left < 0:
            return action
    return len(values) - 1


def iq_in_python(settings, rng, temperatures):
    """Equation 1, for two agents."""
    step_size, discount, random = settings.step_size, settings.discount, rng.random
    q = first, second = [0.0] * 3, [0.0] * 3
    for temperature in temperatures:
        a = softmax_draw(first, temperature, random())
        b = softmax_draw(second, temperature, random())
        reward = CLIMBING[a][b]
        first[a] += step_size * (reward + discount * max(first) - first[a])
        second[b] += step_size * (reward + discount * max(second) - second[b])
    return q


def ivq_in_python(settings, rng, temperatures):
    """Equations 4 to 7 as printed, for two agents."""
    step_size, discount, beta, random = settings.step_size, settings.discount, settings.influence, rng.random
    q = first, second = [0.0] * 3, [0.0] * 3
    did_first, did_second = [0] * 3, [0] * 3
    for t, temperature in enumerate(temperatures, start=1):
        a = softmax_draw(first, temperature, random())
        b = softmax_draw(second, temperature, random())
        reward = CLIMBING[a][b]
        did_first[a] += 1
        did_second[b] += 1
        best_first, best_second = max(first), max(second)
        rv_first, rv_second = reward + best_first - first[a], reward + best_second - second[b]
        pe_first, pe_second = did_first[a] / t, did_second[b] / t
        of_first = rv_second * (pe_first if rv_second <= 0 else 1 - pe_first)
        of_second = rv_first * (pe_second if rv_first <= 0 else 1 - pe_second)
        first[a] += step_size * (reward + discount * best_first - first[a] + beta * of_first)
        second[b] += step_size * (reward + discount * best_second - second[b] + beta * of_second)
    return q


def jaq_in_python(settings, rng, temperatures):
    """Equations 2 and 3, for two agents; rows of joint values are the first agent's actions."""
    step_size, discount, random = settings.step_size, settings.discount, rng.random
    q = first, second = [[0.0] * 3 for _ in range(3)], [[0.0] * 3 for _ in range(3)]
    of_first, of_second = [1 / 3] * 3, [1 / 3] * 3  # believed
    did_first, did_second = [0] * 3, [0] * 3
    for t, temperature in enumerate(temperatures, start=1):
        x, y, z = of_second
        a = softmax_draw([x * i + y * j + z * k for i, j, k in first], temperature, random())
        x, y, z = of_first
        b = softmax_draw([x * i + y * j + z * k for i, j, k in zip(*second, strict=True)], temperature, random())
        reward = CLIMBING[a][b]
        first[a][b] += step_size * (reward + discount * max(map(max, first)) - first[a][b])
        second[a][b] += step_size * (reward + discount * max(map(max, second)) - second[a][b])
        did_first[a] += 1
        did_second[b] += 1
        of_first = [times / t for times in did_first]
        of_second = [times / t for times in did_second]
    return q


def iq_on_arrays(settings, rng, temperatures):
    """Equation 1 with a numpy array of every agent's values, one run at a time."""
    payoff = np.array(CLIMBING, np.float64)
    q, agents = np.zeros((2, 3)), np.arange(2)
    for temperature in temperatures:
        weights = np.exp((q - q.max(axis=1, keepdims=True)) / temperature)
        reached = weights.cumsum(axis=1)
        drawn = rng.random(2) * reached[:, -1]
        did = np.array([np.searchsorted(reached[i], drawn[i], side="right") for i in range(2)])
        reward = payoff[did[0], did[1]]
        q[agents, did] += settings.step_size * (reward + settings.discount * q.max(axis=1) - q[agents, did])
    return q


LOOPS = {"IQ": iq_in_python, "IVQ": ivq_in_python, "JAQ": jaq_in_python}
LEARNERS = {"IQ": IQ(), "IVQ": IVQ(), "JAQ": JAQ()}


def compare(timed, loop, settings, temperatures, rounds):
    """Time a loop over one run, and see that it learns what ours does."""
    q = timed(len(temperatures), "steps", loop, setup=lambda: ((settings, stream(SEEDS, 0), temperatures), {}), rounds=rounds)
    ours = learn(climbing(), settings, Training(np.asarray(temperatures)), run=0, seeds=SEEDS).q[:, 0]
    np.testing.assert_allclose(np.reshape(q, ours.shape), ours, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("rule", LEARNERS, ids="{} ours".format)
def test_ours(benchmark, timed, rule):
    benchmark.group = f"learn the climbing game by {rule}"
    training = Training(TEMPERATURES)
    play_runs(climbing(), LEARNERS[rule], Training(TEMPERATURES[:2]), Trial(), runs=range(1), seeds=SEEDS)
    timed(RUNS * len(TEMPERATURES), "steps", play_runs, (climbing(), LEARNERS[rule], training, Trial()),
          {"runs": range(RUNS), "seeds": SEEDS}, rounds=7)


@pytest.mark.parametrize("rule", LEARNERS, ids="{} in plain Python".format)
def test_plain_python(benchmark, timed, rule):
    benchmark.group = f"learn the climbing game by {rule}"
    compare(timed, LOOPS[rule], LEARNERS[rule], TEMPERATURES.tolist(), rounds=7)


def test_numpy_run_by_run(benchmark, timed):
    benchmark.group = "learn the climbing game by IQ"
    compare(timed, iq_on_arrays, IQ(), TEMPERATURES, rounds=3)
