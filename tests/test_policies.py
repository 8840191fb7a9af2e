"""Policies: only what the knowledge holds is trained, new behaviours start optimistically."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pitchlore.pipeline.base.errors import BadSettings, SchemaMismatch
from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.policies import train as training
from pitchlore.pipeline.stages.policies.batch import batch_of
from pitchlore.pipeline.stages.policies.sarsa import (
    CONTINUES,
    TERMINAL,
    TRUNCATED,
    UNKNOWN,
    Transitions,
    sarsa_lambda,
)
from pitchlore.pipeline.state import encode
from pitchlore.schemas import ROLES, Decisions, Occasions, Policies

SECOND = 1_000_000_000
#: full steps and no discount, so that values can be read off
PLAIN = PolicySettings(step_size=1.0, discount=1.0, trace_decay=1.0, sweeps=1)


def occasions(*pairs, initial=0.0, key="full36", value=0.0):
    """Occasions of (role, state, behaviour_id) in any order."""
    rows = [(1, role, key, state, behaviour, 1, value, initial, "us", "vsss") for role, state, behaviour in pairs]
    return pl.DataFrame(rows, schema=Occasions.dtypes(), orient="row").sort("role", "state", "behaviour_id")


def policy(*rows, key="full36", visits=0, evidence=0.0):
    """Policies of (role, state, behaviour_id, q)."""
    return pl.DataFrame(
        [(1, 1, role, key, *row, visits, evidence) for role, *row in rows], schema=Policies.dtypes(), orient="row"
    ).sort("role", "state", "behaviour_id")


def decisions(*rows, robot=1, match="m-1", chosen=True):
    """Decisions of one robot of one second each: (role, state, behaviour_id, reward, ends, episode)."""
    columns = ("role", "state", "behaviour_id", "reward", "ends", "episode")
    made = [
        dict(zip(columns, row, strict=True)) | {
            "match_id": match, "team": "home", "robot": robot, "t_ns": t * SECOND, "end_ns": (t + 1) * SECOND,
            "chosen": chosen, "random": False, "value": 0.0,
        }
        for t, row in enumerate(rows)
    ]
    return pl.DataFrame(made, schema=Decisions.dtypes())


def train(tables, known, parent, rule, *versions):
    """Train on the decisions of some matches."""
    return training.train(batch_of(tables, known, rule), known, parent, rule, *versions)


def total(report, name):
    """A count of a training report, over all keys and roles."""
    return sum(getattr(table, name) for roles in report.tables.values() for table in roles.values())


def values(table):
    return {(role, state, behaviour): q for role, state, behaviour, q in
            table.select("role", "state", "behaviour_id", "q").rows()}


KICK, GUIDE = "striker-021", "striker-011"
BLOCK = "goalkeeper-047"


def test_goal():
    """A goal teaches the behaviours that led to it."""
    known = occasions(("striker", 5, GUIDE), ("striker", 7, KICK), ("striker", 7, GUIDE))
    match = decisions(
        ("striker", 5, GUIDE, 0.0, None, 0),
        ("striker", 7, KICK, 1.0, "terminal", 0),
    )
    table, report = train([match], known, None, PLAIN, 3, 2)
    Policies.validate(table)
    assert values(table) == {("striker", 5, GUIDE): 1.0, ("striker", 7, GUIDE): 0.0, ("striker", 7, KICK): 1.0}
    assert table["visits"].to_list() == [1, 0, 1]
    assert table.select(pl.col("version").unique(), pl.col("knowledge_version").unique()).row(0) == (3, 2)
    striker = report.tables["full36"]["striker"]
    assert (striker.pairs, striker.new_pairs, striker.decisions, striker.transitions) == (3, 3, 2, 2)
    assert (striker.first_error, striker.last_error) == (0.5, 0.5)
    assert report.tables["full36"]["goalkeeper"].first_error is None


def test_new_behaviour():
    """A new behaviour starts with the parent's best value in its state, else with its occasion's."""
    known = occasions(
        ("striker", 7, KICK), ("striker", 7, GUIDE), ("striker", 7, "striker-046"), ("striker", 8, KICK),
        initial=0.125,
    )
    parent = policy(
        ("striker", 7, KICK, -0.25), ("striker", 7, GUIDE, -0.5),
        ("striker", 7, "striker-044", 0.75),  # no longer in the knowledge, so not usable
        ("midfield", 7, "midfield-046", 0.5),  # another role's table
    )
    table, report = train([], known, parent, PLAIN, 2, 2)
    assert values(table) == {
        ("striker", 7, GUIDE): -0.5, ("striker", 7, KICK): -0.25,
        ("striker", 7, "striker-046"): -0.25,  # the greatest in state 7
        ("striker", 8, KICK): 0.125,  # the parent knows nothing in state 8: the occasion says
    }
    assert (total(report, "pairs"), total(report, "new_pairs")) == (4, 2)


def test_random_moves():
    """A random move is the behaviour 194 where the knowledge holds it."""
    known = occasions(("striker", 5, "striker-194"), ("striker", 7, KICK))
    match = decisions(
        ("striker", 5, None, 0.0, None, 0), ("striker", 6, None, 0.0, None, 0), ("striker", 7, KICK, 1.0, "terminal", 0),
    )
    table, report = train([match], known, None, PLAIN, 1, 1)
    assert values(table) == {("striker", 5, "striker-194"): 1.0, ("striker", 7, KICK): 1.0}
    assert total(report, "transitions") == 2


def test_separate_sequences():
    """Robots, episodes and matches are separate sequences."""
    known = occasions(("striker", 5, KICK), ("striker", 6, KICK), ("striker", 7, KICK), ("striker", 8, GUIDE))
    goal = ("striker", 8, GUIDE, 1.0, "terminal", 1)
    match = pl.concat([
        decisions(("striker", 5, KICK, 0.0, None, 0), goal),  # cut without a word between episodes 0 and 1
        decisions(("striker", 6, KICK, 0.0, None, 1), robot=2),  # cut without a word at the last row
    ])
    other = decisions(("striker", 7, KICK, 0.0, "truncated", 1), goal, match="m-2")
    table, report = train([match, other], known, None, PLAIN, 1, 1)
    assert values(table) == {
        ("striker", 5, KICK): 0.0, ("striker", 6, KICK): 0.0, ("striker", 7, KICK): 0.0, ("striker", 8, GUIDE): 1.0
    }
    assert (report.matches, report.decisions, total(report, "transitions")) == (2, 5, 2)


def test_time_counts_in_seconds():
    """The discount is that of a second, and fractions of a second count."""
    known = occasions(("striker", 5, KICK))
    match = decisions(("striker", 5, KICK, 1.0, "terminal", 0)).with_columns(end_ns=pl.lit(2 * SECOND + SECOND // 2))
    table, _ = train([match], known, None, PLAIN.model_copy(update={"discount": 0.9}), 1, 1)
    assert table["q"][0] == pytest.approx(0.9**2.5, abs=1e-15)


plays = st.lists(
    st.tuples(
        st.sampled_from(["goalkeeper", "midfield", "striker"]), st.integers(0, 3), st.sampled_from([21, 46, 194]),
        st.sampled_from([0.0, 1.0, -1.0]), st.sampled_from([None, None, "terminal", "truncated"]), st.integers(0, 1),
    ),
    max_size=30,
)


@settings(max_examples=40)
@given(plays, st.randoms(use_true_random=False))
def test_row_order(rows, random):
    """Training again gives the same policy, whatever the order of rows."""
    match = decisions(*[(role, s, f"{role}-{code:03}", r, e, ep) for role, s, code, r, e, ep in rows])
    known = match.select("role", "state", "behaviour_id").unique()
    pairs = occasions(*random.sample(known.rows(), k=len(known) // 2))
    shuffled = list(range(len(match)))
    random.shuffle(shuffled)
    once, report = train([match], pairs, None, PolicySettings(), 1, 1)
    again, _ = train([match[shuffled]], pairs.sample(fraction=1.0, shuffle=True, seed=1), None, PolicySettings(), 1, 1)
    assert once.equals(again)
    assert once.select("role", "state", "behaviour_id").equals(pairs.select("role", "state", "behaviour_id"))
    held = match.join(pairs, on=["role", "state", "behaviour_id"], how="semi")
    assert once["visits"].sum() == len(held)
    assert total(report, "transitions") <= len(held)


@settings(max_examples=40)
@given(plays, st.randoms(use_true_random=False))
def test_one_key(rows, random):
    """With one key, training is one Sarsa over all roles' pairs, to the bit."""
    rows = [(role, s, f"{role}-{code:03}", r, e, ep) for role, s, code, r, e, ep in rows]
    seen = sorted({row[:3] for row in rows})
    pairs = random.sample(seen, k=len(seen) // 2 + len(seen) % 2)
    known = sorted(pairs, key=lambda pair: (ROLES.index(pair[0]), *pair[1:]))
    parent = policy(*((*pair, random.random()) for pair in random.sample(pairs, k=len(pairs) // 2)))
    start = values(parent)
    best = {}
    for (role, state, _), q in start.items():
        best[role, state] = max(q, best.get((role, state), -1.0))
    ends = [
        TERMINAL if row[4] == "terminal" else TRUNCATED if row[4] or after is None or after[5] != row[5] else CONTINUES
        for row, after in zip(rows, [*rows, None][1:], strict=True)
    ]
    batch = Transitions(
        pair=np.array([known.index(row[:3]) if row[:3] in known else UNKNOWN for row in rows], np.int64),
        elapsed=np.ones(len(rows)), reward=np.array([row[3] for row in rows], float), ends=np.array(ends, np.int8),
    )
    expected = sarsa_lambda(
        np.array([start.get(pair, best.get(pair[:2], 0.25)) for pair in known], float), np.zeros(len(known)), batch,
        PolicySettings(step_size=0.1, discount=0.95, trace_decay=0.9, sweeps=5),
    )
    table, _ = train([decisions(*rows)], occasions(*pairs, initial=0.25), parent, PolicySettings(), 2, 1)
    assert list(values(table).items()) == list(zip(known, expected.q.tolist(), strict=True))


#: two states that differ in nothing but the score, which self6 and role0 leave out
LOSING, WINNING = encode(np.array([[0] * 34 + [score, 0] for score in (0, 2)], np.uint8), "full36").tolist()


def test_separate_keys():
    """Each key is a learning problem of its own."""
    known = pl.concat([
        occasions(("striker", LOSING, GUIDE), ("striker", WINNING, KICK)),
        occasions(("striker", 0, KICK), key="role0"),
    ]).sort("role", "key", "state", "behaviour_id")
    match = decisions(
        ("striker", LOSING, KICK, 0.0, None, 0),  # that pair is in role0 only
        ("striker", LOSING, GUIDE, 0.0, None, 0),  # in full36 only
        ("striker", WINNING, KICK, 1.0, "terminal", 0),  # in both
    )
    slow = PLAIN.model_copy(update={"step_size": 0.5, "trace_decay": 0.5})
    table, report = train([match], known, None, slow, 1, 1)
    Policies.validate(table)
    assert table.select("role", "key", "state", "behaviour_id").equals(
        known.select("role", "key", "state", "behaviour_id"))
    assert table.select("key", "behaviour_id", "q", "visits").rows() == [
        ("full36", GUIDE, 0.25, 1), ("full36", KICK, 0.5, 1),
        ("role0", KICK, 0.5, 2),  # 0 + (0 - 0) / 2, then + (1 - 0) / 2
    ]
    alone, _ = train([match], known.filter(pl.col("key") == "role0"), None, slow, 1, 1)
    assert alone.equals(table.filter(pl.col("key") == "role0"))
    assert [report.tables[key]["striker"].transitions for key in ("full36", "role0")] == [2, 2]
    assert (total(report, "pairs"), report.decisions, total(report, "transitions")) == (3, 3, 4)


def test_parent_keys():
    """A parent's values stay in their key."""
    known = pl.concat([occasions(("striker", 0, KICK)), occasions(("striker", 0, KICK), key="role0")])
    parent = policy(("striker", 0, KICK, 0.5), key="role0", visits=3)
    table, report = train([], known, parent, PLAIN, 2, 2)
    assert table.select("key", "q", "visits").rows() == [("full36", 0.0, 0), ("role0", 0.5, 3)]
    assert total(report, "new_pairs") == 1


def test_visits():
    """Visits count all batches that a policy has learned from, its parent's too."""
    known = occasions(("striker", 7, KICK), ("striker", 7, GUIDE))
    match = decisions(("striker", 7, KICK, 1.0, "terminal", 0))
    first, _ = train([match, match], known, None, PLAIN, 1, 1)
    second, _ = train([match], known, first, PLAIN, 2, 1)
    anew, report = train([match], known, first, PLAIN.model_copy(update={"parent": False}), 2, 1)
    assert [table["visits"].to_list() for table in (first, second, anew)] == [[0, 2], [0, 3], [0, 1]]
    assert (total(report, "new_pairs"), total(report, "pairs")) == (2, 2)


def test_evidence():
    """The evidence of a value is the number of episodes it is the mean of, bounded by the step size."""
    known = occasions(("striker", 7, KICK), ("striker", 7, GUIDE))
    # two episodes, in the first of which it kicks twice
    match = decisions(
        ("striker", 7, KICK, 0.0, None, 0), ("striker", 7, KICK, 1.0, "terminal", 0),
        ("striker", 7, KICK, -1.0, "terminal", 1),
    )
    rule = PLAIN.model_copy(update={"steps": "average", "step_size": 0.2, "start_evidence": 1.0})
    first, _ = train([match], known, None, rule, 1, 1)
    assert first.select("behaviour_id", "visits", "evidence").rows() == [(GUIDE, 0, 1.0), (KICK, 3, 3.0)]
    second, _ = train([match], known, first, rule, 2, 1)
    assert second["evidence"].to_list() == [1.0, 5.0]
    third, _ = train([match], known, second, rule, 3, 1)
    assert third["evidence"].to_list() == [1.0, 5.0]  # a step of 0.2 is that of the mean of five
    assert third["visits"].to_list() == [0, 9]


@pytest.mark.parametrize(("rule", "starts"), [
    ({}, (0.5, 0.5)), ({"new_pairs": "outcome"}, (-0.25, 0.5)),
    ({"parent": False}, (0.75, 0.75)), ({"parent": False, "new_pairs": "outcome"}, (-0.25, -0.25)),
])
def test_first_values(rule, starts):
    """A value starts from the parent's; else optimistically, or from its own outcomes where it has some."""
    known = occasions(("striker", 7, GUIDE), ("striker", 7, KICK), initial=0.75, value=-0.25)
    parent = policy(("striker", 7, KICK, 0.5))
    assert tuple(train([], known, parent, PolicySettings(**rule), 2, 2)[0]["q"]) == starts
    unseen = known.with_columns(value=pl.lit(None, pl.Float64))
    assert train([], unseen, None, PolicySettings(**rule), 2, 2)[0]["q"].to_list() == [0.75, 0.75]


@pytest.mark.parametrize(("source", "learned"), [("chosen", (1.0, 0.0)), ("seen", (0.0, -1.0)), ("both", (1.0, -1.0))])
def test_learning_sources(source, learned):
    """Chosen decisions and seen ones are distinguished."""
    known = occasions(("striker", 5, KICK), ("striker", 7, GUIDE))
    # the same robot in the same episode: the two must not follow each other
    match = pl.concat([
        decisions(("striker", 5, KICK, 1.0, None, 0)),
        decisions(("striker", 7, GUIDE, -1.0, None, 0), chosen=False).with_columns(
            t_ns=pl.lit(SECOND // 2, pl.Int64), ends=pl.lit("terminal").cast(Decisions.dtypes()["ends"])),
        decisions(("striker", 9, KICK, 0.0, "terminal", 0)).with_columns(pl.col("t_ns", "end_ns") + SECOND),
    ])
    table, report = train([match], known, None, PLAIN.model_copy(update={"learn_from": source}), 1, 1)
    assert tuple(table["q"]) == learned
    assert report.decisions == {"chosen": 2, "seen": 1, "both": 3}[source]


def test_influence():
    """Team-mates sway each other in an episode, and nobody else."""
    known = occasions(("striker", 5, KICK), ("striker", 5, GUIDE), ("goalkeeper", 6, BLOCK), ("midfield", 8, "midfield-046"))
    keeper = decisions(("goalkeeper", 6, BLOCK, 1.0, "terminal", 0), robot=10)  # its RV is +1, under way at 0 s
    striker = decisions(("striker", 5, KICK, 0.0, None, 0), ("striker", 5, GUIDE, 0.0, "terminal", 0), robot=3)
    rule = PLAIN.model_copy(update={"rule": "influence", "influence": 0.5, "trace_decay": 0.0})
    q = values(train([pl.concat([keeper, striker])], known, None, rule, 1, 1)[0])
    # of two visits of state 5 one was a kick: praise is halved, and again by the rate
    assert q["striker", 5, KICK] == q["striker", 5, GUIDE] == 0.25
    assert q["goalkeeper", 6, BLOCK] == 1.0  # the striker's RV is 0
    for apart in (
        {"team": pl.lit("away").cast(Decisions.dtypes()["team"])},
        {"episode": pl.lit(1, pl.Int32)},
        {"chosen": pl.lit(value=False)},
    ):
        q = values(train([pl.concat([keeper.with_columns(**apart), striker])], known, None, rule, 1, 1)[0])
        assert q["striker", 5, KICK] == 0.0
    q = values(train([keeper, striker], known, None, rule, 1, 1)[0])  # in two matches
    assert q["striker", 5, KICK] == 0.0


def test_two_versions():
    """Two versions at once, of the knowledge or of the parent, are refused."""
    known = occasions(("striker", 7, KICK))
    with pytest.raises(SchemaMismatch, match=r"^occasions: names a pair .* twice"):
        train([], pl.concat([known, known]), None, PLAIN, 1, 1)
    parent = policy(("striker", 7, KICK, 0.5))
    with pytest.raises(SchemaMismatch, match=r"^parent: names a pair .* twice"):
        train([], known, pl.concat([parent, parent]), PLAIN, 1, 1)


def test_exploding_values():
    """Values that explode stop the training."""
    steps = PolicySettings(step_size=1.0, discount=1.0, trace_decay=1.0, traces="accumulating", sweeps=200)
    rows = [("striker", 7, KICK, 1.0, None, 0)] * 999 + [("striker", 7, KICK, 1.0, "terminal", 0)]
    with pytest.raises(BadSettings, match="beyond all bounds"):
        train([decisions(*rows)], occasions(("striker", 7, KICK)), None, steps, 1, 1)
