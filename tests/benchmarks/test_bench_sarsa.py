"""Sarsa(lambda): the kernel on 10^6 transitions beside the same rule on dicts, on fewer."""

import numpy as np
import pytest

from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.policies.sarsa import (
    CONTINUES,
    TERMINAL,
    TRACE_FLOOR,
    Transitions,
    sarsa_lambda,
)

PAIRS = 60_000
RULE = {"step_size": 0.1, "discount": 0.95, "trace_decay": 0.9}


def made_up(transitions):
    """Decisions of 0.2-0.6 s in episodes of about 75 (half a minute), a few pairs seen very often."""
    rng = np.random.default_rng(1)
    ends = np.where(rng.random(transitions) < 1 / 75, TERMINAL, CONTINUES).astype(np.int8)
    ends[-1] = TERMINAL
    return Transitions(
        pair=(PAIRS * rng.random(transitions) ** 3).astype(np.int64),
        elapsed=rng.uniform(0.2, 0.6, transitions),
        reward=np.where(ends == TERMINAL, rng.choice([-1.0, 0.0, 1.0], transitions), 0.0),
        ends=ends,
    )


def on_dicts(batch, step_size, discount, trace_decay):
    """Sarsa as a user would write it: dicts, replacing traces, the same floor."""
    q, trace = {}, {}
    columns = (batch.pair, batch.elapsed, batch.reward, batch.ends)
    rows = list(zip(*(column.tolist() for column in columns), strict=True))
    for t, (pair, elapsed, reward, ends) in enumerate(rows):
        gamma = discount**elapsed
        q_next = q.get(rows[t + 1][0], 0.0) if ends == CONTINUES else 0.0
        step = step_size * (gamma * (reward + q_next) - q.get(pair, 0.0))
        decay = gamma * trace_decay
        trace[pair] = 1.0
        for traced, e in list(trace.items()):
            q[traced] = q.get(traced, 0.0) + step * e
            if e * decay < TRACE_FLOOR:
                del trace[traced]
            else:
                trace[traced] = e * decay
        if ends != CONTINUES:
            trace.clear()
    return q


@pytest.mark.benchmark(group="learn action values by Sarsa(λ)")
def test_ours(timed):
    batch, q, rule = made_up(1_000_000), np.zeros(PAIRS), PolicySettings(**RULE, sweeps=1)
    sarsa_lambda(q, q, made_up(10), rule)
    timed(len(batch.pair), "transitions", sarsa_lambda, (q, q, batch, rule), rounds=5)


@pytest.mark.benchmark(group="learn action values by Sarsa(λ)")
def test_python_dicts(timed):
    batch = made_up(20_000)
    q = timed(len(batch.pair), "transitions", on_dicts, (batch,), RULE, rounds=3)
    learned = sarsa_lambda(np.zeros(PAIRS), np.zeros(PAIRS), batch, PolicySettings(**RULE, sweeps=1)).q
    np.testing.assert_allclose([learned[pair] for pair in q], list(q.values()), rtol=0, atol=1e-12)
