"""How sure a policy is: returns by episode, the choice in each state, and states in words."""

import io

import numpy as np
import polars as pl
import pyarrow.parquet
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_policies import GUIDE, KICK, PLAIN, decisions, occasions

from pitchlore.pipeline.numbers.statistics import welch, welch_of
from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.policies.batch import batch_of
from pitchlore.pipeline.stages.policies.certainty import returns_of, states_of
from pitchlore.pipeline.stages.policies.returns import by_pair, returns, together
from pitchlore.pipeline.stages.policies.sarsa import CONTINUES, TERMINAL, TRUNCATED
from pitchlore.pipeline.stages.policies.train import train
from pitchlore.pipeline.state import encode
from pitchlore.pipeline.state.keys import columns
from pitchlore.pipeline.state.table import LEVELS, TABLE
from pitchlore.pipeline.state.words import elements_of, levels_in_words, levels_of, with_elements
from pitchlore.pipeline.store.tables import SCHEMA_KEY, from_parquet
from pitchlore.schemas import KEYS, ROLES, Policies, Returns, States
from pitchlore.schemas.policies import FEW

elements36 = st.tuples(*(st.integers(0, int(n) - 1) for n in LEVELS))


@pytest.mark.parametrize("key", KEYS)
@given(st.lists(elements36, min_size=1, max_size=4), st.integers(0, 2))
@settings(max_examples=20)
def test_words_are_the_inverse(key, rows, slot):
    """The words of an encoded state name the levels that were encoded, of the elements that the key keeps."""
    found = np.array(rows, dtype=np.uint8)
    states = encode(found, key, np.full(len(rows), slot))
    kept, told = columns(key, slot), elements_of(states, key, slot)
    table = pl.DataFrame({"role": [ROLES[slot]] * len(rows), "key": [key] * len(rows), "state": states})
    assert with_elements(table)["elements"].equals(told)
    for row, said in zip(found, told.to_list(), strict=True):
        words = levels_in_words(said)
        assert list(words) == [TABLE[column.element].name for column in kept]
        for column in kept:
            level = TABLE[column.element].levels[row[column.element]]
            assert level in words[TABLE[column.element].name].split(" or ")
            assert words[TABLE[column.element].name] in levels_of(column)
    back = np.zeros_like(found)
    for row, said in enumerate(elements_of(states, key, slot).to_list()):
        words = levels_in_words(said)
        for column in kept:
            back[row, column.element] = levels_of(column).index(words[TABLE[column.element].name])
    assert encode(back, key, np.full(len(rows), slot)).tolist() == states.tolist()


@given(st.lists(st.tuples(st.floats(0, 5), st.sampled_from([0.0, 0.0, 1.0, -1.0]),
                          st.sampled_from([CONTINUES, TERMINAL, TRUNCATED])), max_size=30))
@settings(max_examples=60)
def test_returns(rows):
    """A return is the sum of the discounted rewards until the end; it is not known where the end was cut."""
    elapsed, reward, ends = (np.array(column) for column in zip(*rows, strict=True)) if rows else (np.zeros(0),) * 3
    found = returns(elapsed, reward, ends.astype(np.int8), 0.9)
    for t in range(len(rows)):
        total, discount = 0.0, 1.0
        for s in range(t, len(rows)):
            discount *= 0.9 ** elapsed[s]
            total += discount * reward[s]
            if ends[s] != CONTINUES:
                break
        else:
            total = np.nan  # the last row of a batch ends its episode; one that does not was cut
        if ends[s] == TRUNCATED:
            total = np.nan
        assert found[t] == pytest.approx(total, nan_ok=True)


def test_episodes_count_once():
    """Visits of one episode count once, with their mean; unknown pairs and returns do not count."""
    found = by_pair(np.array([0, 0, 0, 1, -1, 1]), np.array([7, 7, 8, 7, 7, 8]), np.array([1.0, 0.5, -1.0, 0.25, 9.0, np.nan]))
    assert found.rows() == [(0, 2, pytest.approx(-0.125), pytest.approx(np.std([0.75, -1.0], ddof=1))), (1, 1, 0.25, None)]


@given(st.lists(st.lists(st.floats(-1, 1), min_size=1, max_size=6), min_size=1, max_size=4))
@settings(max_examples=60)
def test_together(samples):
    """Counts, means and spreads put together are those of all samples in one."""
    parts = pl.DataFrame({
        "pair": [0] * len(samples), "episodes": list(map(len, samples)), "mean": [float(np.mean(s)) for s in samples],
        "spread": [float(np.std(s, ddof=1)) if len(s) > 1 else None for s in samples]},
        schema_overrides={"spread": pl.Float64})
    every = np.concatenate(samples)
    ((_, n, mean, spread),) = together(parts, ["pair"]).rows()
    assert (n, mean) == (len(every), pytest.approx(np.mean(every)))
    assert spread == (None if n == 1 else pytest.approx(np.std(every, ddof=1), abs=1e-9))


def test_welch_of():
    """Intervals from counts, means and spreads are those from the values."""
    draw = np.random.default_rng(3)
    pairs = [(draw.normal(size=draw.integers(2, 9)), draw.normal(0.5, 2, size=draw.integers(2, 9))) for _ in range(50)]
    n, mean, spread = (np.array([[f(side) for f in (of,) for side in pair] for pair in pairs], dtype=float).T
                       for of in (len, np.mean, lambda it: np.std(it, ddof=1)))
    low, high = welch_of(n, mean, spread)
    for place, (one, other) in enumerate(pairs):
        assert (low[place], high[place]) == pytest.approx(welch(one, other))
    few = welch_of(np.array([[1.0], [9.0]]), np.zeros((2, 1)), np.array([[np.nan], [1.0]]))
    assert np.isnan(few).all()
    assert welch_of(np.full((2, 1), 5.0), np.array([[1.0], [0.0]]), np.zeros((2, 1))) == (1.0, 1.0)


def policy_of(*rows):
    """Policies of (behaviour_id, q) in state 5 of key role0's neighbour self6."""
    return pl.DataFrame([(1, 1, "striker", "self6", 5, *row, 1, 1.0) for row in rows],
                        schema=Policies.dtypes(), orient="row")


def returned(*rows):
    return pl.DataFrame([(1, "striker", "self6", 5, *row) for row in rows], schema=Returns.dtypes(), orient="row")


@pytest.mark.parametrize(("evidence", "verdict"), [
    ([(KICK, FEW, 0.9, 0.1)], "few"),
    ([(KICK, FEW, 0.9, 0.1), (GUIDE, FEW - 1, 0.1, 0.1)], "few"),
    ([(KICK, FEW, 0.9, 0.1), (GUIDE, FEW, 0.1, 0.1)], "sure"),
    ([(KICK, FEW, 0.3, 0.5), (GUIDE, FEW, 0.1, 0.5)], "close"),
    ([(KICK, FEW, 0.1, 0.1), (GUIDE, FEW, 0.9, 0.1)], "close"),  # the value prefers what paid less
    ([(KICK, FEW, 0.0, 0.0), (GUIDE, FEW, 0.0, 0.0)], "close"),
])
def test_verdict(evidence, verdict):
    """The evidence of the best behaviour and the next one decides whether the policy is sure."""
    (row,) = States.validate(states_of(policy_of((KICK, 0.9), (GUIDE, 0.1)), returned(*sorted(evidence)))).rows(named=True)
    assert (row["verdict"], row["best"], row["second"], row["gap"]) == (verdict, KICK, GUIDE, pytest.approx(0.8))
    assert row["behaviours"] == row["visits"] == 2


@pytest.mark.parametrize(("episodes", "verdict"), [(FEW, "alone"), (FEW - 1, "few")])
def test_one_behaviour(episodes, verdict):
    """Where there is one behaviour there is nothing to choose; with few episodes it is unsure all the same."""
    (row,) = states_of(policy_of((KICK, 0.9)), returned((KICK, episodes, 0.9, 0.1))).rows(named=True)
    assert (row["verdict"], row["second"], row["gap"], row["low"]) == (verdict, None, None, None)


def test_by_chance():
    """Among equally good behaviours, at most 5 % of the states are called sure, although the best is chosen by
    the same returns."""
    draw, count, n = np.random.default_rng(0), 4000, 12
    values = draw.choice([-0.7, 0.0, 0.7], size=(count, 2, n))
    mean, spread = values.mean(axis=2), values.std(axis=2, ddof=1)
    rows = [(state, name, mean[state, place], spread[state, place]) for state in range(count)
            for place, name in enumerate((GUIDE, KICK))]
    policy = pl.DataFrame([(1, 1, "striker", "full36", state, name, m, n, float(n)) for state, name, m, _ in rows],
                          schema=Policies.dtypes(), orient="row")
    table = pl.DataFrame([(1, "striker", "full36", state, name, n, m, s) for state, name, m, s in rows],
                         schema=Returns.dtypes(), orient="row")
    share = (states_of(policy, table)["verdict"] == "sure").mean()
    assert 0.03 < share < 0.06


def test_from_decisions():
    """The returns of a policy come from the decisions that it learned from; those of its parent are added."""
    known = occasions(("striker", 5, GUIDE), ("striker", 7, KICK))
    match = decisions(("striker", 5, GUIDE, 0.0, None, 0), ("striker", 7, KICK, 1.0, "terminal", 0),
                      ("striker", 7, KICK, 0.0, "truncated", 1))
    rule = PLAIN.model_copy(update={"discount": 0.5})
    first_match, second_match, none = (batch_of([table], known, rule) for table in (
        match, decisions(("striker", 7, KICK, -1.0, "terminal", 0), match="m-2"), decisions()))
    policy, _ = train(first_match, known, None, rule, 1, 1)
    first = Returns.validate(returns_of(policy, first_match, None, 0.5))
    assert first.select("state", "episodes", "mean", "spread").rows() == [(5, 1, 0.25, None), (7, 1, 0.5, None)]
    both = returns_of(policy, second_match, first, 0.5)
    assert both.select("state", "episodes", "mean").rows() == [(5, 1, 0.25), (7, 2, 0.0)]
    assert returns_of(policy, none, None, 0.5).is_empty()
    States.validate(states_of(policy, first))


def test_earlier_states():
    """States of a version that had their words are read without them."""
    now = states_of(policy_of((KICK, 0.9)), returned((KICK, FEW, 0.9, 0.1)))
    pyarrow.parquet.write_table(with_elements(now).to_arrow().replace_schema_metadata({SCHEMA_KEY: "states/1"}), file := io.BytesIO())
    assert from_parquet(file.getvalue(), States, where="states").equals(now)


def test_no_policy():
    """Without a pair there are no returns and no states."""
    nothing = Policies.empty()
    assert returns_of(nothing, batch_of([decisions()], nothing, PolicySettings()), None, 1.0).equals(Returns.empty())
    assert States.validate(states_of(nothing, Returns.empty())).is_empty()
