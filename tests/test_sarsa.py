"""Batch Sarsa(lambda): equal to the textbook's algorithm, in seconds instead of steps."""

import math
from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.policies.sarsa import (
    CONTINUES,
    TERMINAL,
    TRACE_FLOOR,
    TRUNCATED,
    UNKNOWN,
    Transitions,
    sarsa_lambda,
)

PAIRS = 6


def batch(rows):
    """A batch from (pair, elapsed, reward, ends) rows."""
    pair, elapsed, reward, ends = zip(*rows, strict=True) if rows else ((), (), (), ())
    return Transitions(
        pair=np.array(pair, np.int64), elapsed=np.array(elapsed, np.float64),
        reward=np.array(reward, np.float64), ends=np.array(ends, np.int8),
    )


def learn(q, data, *, seen=None, **rule):
    """The values learned from a batch: one sweep, by pairs that were never seen, unless said otherwise."""
    return sarsa_lambda(q, np.zeros_like(q) if seen is None else seen, data, PolicySettings(**{"sweeps": 1} | rule))


def reference(q, rows, step_size, discount, trace_decay, traces, sweeps, steps, seen):
    """Sarsa(lambda) as the textbook prints it, on dicts; returns values, TD errors by sweep, and how often each was seen.

    Unlike the kernel it first rewrites the batch as episodes of known decisions only, each with
    its own reward, discount and successor.
    """
    episodes, made = [], []
    for t, (pair, elapsed, reward, ends) in enumerate(rows):
        if pair != UNKNOWN:
            made.append({"t": t, "pair": pair, "seconds": 0.0, "reward": 0.0})
        if made:
            made[-1]["seconds"] += elapsed
            made[-1]["reward"] += discount ** made[-1]["seconds"] * reward
        if ends != CONTINUES:
            episodes.append((made, ends))
            made = []
    q, errors_by_sweep = dict(enumerate(q)), []
    for _ in range(sweeps):
        errors = [math.nan] * len(rows)
        visits = seen.copy()
        for episode, ends in episodes:
            trace = defaultdict(float)
            for step, successor in zip(episode, [*episode[1:], None], strict=False):
                if successor is None and ends == TRUNCATED:
                    break
                gamma = discount ** step["seconds"]
                q_next = 0.0 if successor is None else q[successor["pair"]]
                delta = step["reward"] + gamma * q_next - q[step["pair"]]
                errors[step["t"]] = delta
                if traces == "accumulating" or trace[step["pair"]] == 0:
                    visits[step["pair"]] += 1
                trace[step["pair"]] = 1.0 if traces == "replacing" else trace[step["pair"]] + 1.0
                for pair in list(trace):
                    alpha = step_size if steps == "constant" else max(step_size, 1 / visits[pair])
                    q[pair] += alpha * delta * trace[pair]
                    trace[pair] *= gamma * trace_decay
                    if trace[pair] < TRACE_FLOOR:
                        del trace[pair]
        errors_by_sweep.append(errors)
    return np.array(list(q.values())), errors_by_sweep, visits


@st.composite
def decisions(draw, least=UNKNOWN):
    """Rows of pairs from ``least`` on, the last of which ends its episode."""
    row = st.tuples(
        st.integers(least, PAIRS - 1),
        st.floats(0, 3),
        st.sampled_from([0.0, 0.0, 1.0, -1.0, 0.3]),
        st.sampled_from([CONTINUES, CONTINUES, TERMINAL, TRUNCATED]),
    )
    rows = draw(st.lists(row, max_size=40))
    if rows and rows[-1][3] == CONTINUES:
        rows[-1] = (*rows[-1][:3], TERMINAL)
    return rows


values = st.lists(st.floats(-2, 2), min_size=PAIRS, max_size=PAIRS).map(np.array)
rules = st.fixed_dictionaries({
    "step_size": st.floats(0.01, 0.5), "discount": st.floats(0.5, 1), "trace_decay": st.floats(0, 1),
    "traces": st.sampled_from(["replacing", "accumulating"]), "sweeps": st.integers(1, 3),
    "steps": st.sampled_from(["constant", "average"]),
    "seen": st.lists(st.floats(0, 9), min_size=PAIRS, max_size=PAIRS).map(np.array),
})


@settings(max_examples=150)
@given(values, decisions(), rules)
def test_textbook(q, rows, rule):
    """Values, errors and visits equal those of the textbook's algorithm."""
    learned = learn(q, batch(rows), **rule)
    expected, errors, visits = reference(q, rows, **rule)
    np.testing.assert_allclose(learned.seen, visits, rtol=0, atol=1e-12)
    np.testing.assert_allclose(learned.q, expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(learned.first_errors, errors[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(learned.last_errors, errors[-1], rtol=0, atol=1e-12)


@given(values, decisions(), rules)
def test_repeatability(q, rows, rule):
    """Learning repeats to the bit and leaves its inputs and unvisited pairs alone."""
    data, before = batch(rows), q.copy()
    once, again = learn(q, data, **rule), learn(q, data, **rule)
    assert [a.tobytes() for a in once] == [a.tobytes() for a in again]
    assert q.tobytes() == before.tobytes()
    unvisited = np.setdiff1d(np.arange(PAIRS), data.pair)
    assert once.q[unvisited].tobytes() == q[unvisited].tobytes()


def test_trace_floor():
    """A trace below the floor is dropped."""
    # after one decision of 1 s the first pair's trace is gamma: just above, just below the floor
    rows = [(0, 1, 0, CONTINUES), (1, 0, 1, TERMINAL)]
    above, below = TRACE_FLOOR * 1.01, TRACE_FLOOR * 0.99
    rule = {"step_size": 1.0, "trace_decay": 1.0}
    assert learn(np.zeros(2), batch(rows), discount=above, **rule).q[0] == pytest.approx(above)
    assert learn(np.zeros(2), batch(rows), discount=below, **rule).q[0] == 0.0


GOOD = (0, 1.0, 0.0, TERMINAL)


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ((0, math.nan, 0.0, TERMINAL), "elapsed\\[1\\] is negative or not finite"),
        ((0, math.inf, 0.0, TERMINAL), "elapsed\\[1\\] is negative or not finite"),
        ((0, -0.1, 0.0, TERMINAL), "elapsed\\[1\\] is negative or not finite"),
        ((0, 1.0, math.nan, TERMINAL), "reward\\[1\\] is not finite"),
        ((0, 1.0, -math.inf, TERMINAL), "reward\\[1\\] is not finite"),
    ],
)
def test_bad_rows(row, says):
    """A row that cannot be learned from is refused, and the error names it."""
    with pytest.raises(SchemaMismatch, match=says):
        learn(np.zeros(1), batch([GOOD, row]))


@pytest.mark.parametrize(
    "wrong",
    [{"step_size": 0.0}, {"step_size": math.nan}, {"discount": 0.0}, {"discount": 1.1}, {"trace_decay": -0.1},
     {"trace_decay": math.nan}, {"traces": "dutch"}, {"sweeps": 0}],
)
def test_bad_settings(wrong):
    """Settings out of bounds are refused by name."""
    rule = {"step_size": 0.1, "discount": 0.9, "trace_decay": 0.9} | wrong
    with pytest.raises(ValidationError, match=next(iter(wrong))):
        learn(np.zeros(1), batch([GOOD]), **rule)
