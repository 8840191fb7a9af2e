"""Influence values: opinions of team-mates on a decision that began during their own."""


import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from test_sarsa import batch

from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.policies.influence import Influence
from pitchlore.pipeline.stages.policies.sarsa import (
    CONTINUES,
    TERMINAL,
    TRACE_FLOOR,
    TRUNCATED,
    UNKNOWN,
    sarsa_lambda,
)

PAIRS = 5


def among(rows, share, rate):
    """Influence among (team_episode, robot, t_ns, pair) rows."""
    columns = np.array(rows, np.int64).reshape(len(rows), 4).T
    return Influence(*(column.copy() for column in columns), share=np.array(share, float), rate=rate)


def learn(q, data, influence, **rule):
    """The values learned from a batch of pairs that were never seen."""
    return sarsa_lambda(q, np.zeros_like(q), data, PolicySettings(**rule), influence)


@st.composite
def teams(draw):
    """Decisions of up to three robots in up to two team-episodes: rows of a batch, each with (team_episode, robot, t)."""
    rows, where = [], []
    for number in range(draw(st.integers(1, 2))):
        for robot in range(draw(st.integers(1, 3))):
            times = sorted(draw(st.lists(st.integers(0, 6), max_size=6, unique=True)))
            for t, until in zip(times, [*times, 7][1:], strict=True):
                ends = CONTINUES if until < 7 else draw(st.sampled_from([TERMINAL, TRUNCATED]))
                reward = draw(st.sampled_from([0.0, 1.0, -1.0])) if until == 7 else 0.0
                rows.append((draw(st.integers(UNKNOWN, PAIRS - 1)), float(until - t), reward, ends))
                where.append((number, robot, t))
    return rows, where


def literal(q, rows, where, share, rate, step_size, discount, trace_decay, sweeps):
    """Equations 4 to 7 as they are written, robot by robot on dicts and lists."""
    robots = {}
    for row, (number, robot, _) in enumerate(where):
        robots.setdefault((number, robot), []).append(row)

    def outcomes(own):
        """Sequel of each known decision: row, its discounted reward and discount, the next known row."""
        known = [row for row in own if rows[row][0] != UNKNOWN]
        for i, row in enumerate(known):
            gain, gamma, following = 0.0, 1.0, known[i + 1] if i + 1 < len(known) else None
            for passed in own[own.index(row) : own.index(following) if following is not None else None]:
                gamma *= discount ** rows[passed][1]
                gain += gamma * rows[passed][2]
            if following is not None or rows[own[-1]][3] == TERMINAL:
                yield row, gain, gamma, following

    def error(gain, gamma, row, following):
        return gain + (gamma * q[rows[following][0]] if following is not None else 0.0) - q[rows[row][0]]

    q = list(q)
    for _ in range(sweeps):
        relative = {row: error(gain, gamma, row, following)
                    for own in robots.values() for row, gain, gamma, following in outcomes(own)}
        influence = {}
        for row, (number, robot, t) in enumerate(where):
            influence[row] = 0.0
            for (other, judge), own in robots.items():
                if other != number or judge == robot:
                    continue
                begun = [mate for mate in own if rows[mate][0] != UNKNOWN and where[mate][2] <= t]
                if begun and begun[-1] in relative:
                    rv, pe = relative[begun[-1]], share[rows[row][0]]
                    influence[row] += rate * (rv * pe if rv <= 0 else rv * (1 - pe))
        for own in robots.values():
            trace = {}
            for row, gain, gamma, following in outcomes(own):
                delta = error(gain, gamma, row, following) + influence[row]
                trace[rows[row][0]] = 1.0
                for pair in list(trace):
                    q[pair] += step_size * delta * trace[pair]
                    trace[pair] *= gamma * trace_decay
                    if trace[pair] < TRACE_FLOOR:
                        del trace[pair]
    return q


unit = st.floats(0, 1)
shares = st.lists(unit, min_size=PAIRS, max_size=PAIRS)
values = st.lists(st.floats(-2, 2), min_size=PAIRS, max_size=PAIRS).map(np.array)
rules = st.fixed_dictionaries({
    "step_size": st.floats(0.01, 0.5), "discount": st.floats(0.5, 1), "trace_decay": unit, "sweeps": st.integers(1, 3),
})


@settings(max_examples=100)
@given(values, teams(), shares, st.floats(0, 2), rules)
def test_literal_equations(q, made, share, rate, rule):
    """Learning with influence equals the equations read literally."""
    rows, where = made
    influence = among([(*place, row[0]) for place, row in zip(where, rows, strict=True)], share, rate)
    learned = learn(q, batch(rows), influence, **rule)
    np.testing.assert_allclose(learned.q, literal(q, rows, where, share, rate, **rule), rtol=0, atol=1e-11)


@given(teams(), st.randoms(use_true_random=False))
def test_order_of_rows(made, random):
    """The order of rows does not matter."""
    rows, where = made
    error = dict(zip(where, [random.uniform(-1, 1) for _ in where], strict=True))
    pair = {place: row[0] for place, row in zip(where, rows, strict=True)}
    share = [random.random() for _ in range(PAIRS)]

    def swayed(places):
        errors = np.array([error[place] for place in places])
        found = among([(*place, pair[place]) for place in places], share, 0.5)(errors)
        return dict(zip(places, found.tolist(), strict=True))

    assert swayed(random.sample(where, len(where))) == swayed(where)
