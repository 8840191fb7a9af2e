"""Policies: only what the knowledge holds is trained, new behaviours start optimistically."""

import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import BadSettings, SchemaMismatch
from pipeline.policies import train
from pipeline.settings import PolicySettings
from schemas import Decisions, Occasions, Policies

SECOND = 1_000_000_000
#: full steps and no discount, so that values can be read off
PLAIN = PolicySettings(step_size=1.0, discount=1.0, trace_decay=1.0, sweeps=1)


def occasions(*pairs, initial=0.0, key="full36", value=0.0):
    """Occasions of (role, state, behaviour_id) in any order."""
    rows = [(1, role, key, state, behaviour, 1, value, initial) for role, state, behaviour in pairs]
    return pl.DataFrame(rows, schema=Occasions.dtypes(), orient="row").sort("role", "state", "behaviour_id")


def policy(*rows, key="full36", visits=0):
    """Policies of (role, state, behaviour_id, q)."""
    return pl.DataFrame(
        [(1, 1, role, key, *row, visits) for role, *row in rows], schema=Policies.dtypes(), orient="row"
    ).sort("role", "state", "behaviour_id")


def decisions(*rows, robot=1, match="m-1", chosen=True):
    """Decisions of one robot of one second each: (role, state, behaviour_id, reward, ends, episode)."""
    return pl.DataFrame(
        [
            (match, "home", robot, role, t * SECOND, (t + 1) * SECOND, state, behaviour, chosen, False, reward, episode, ends, 0.0)
            for t, (role, state, behaviour, reward, ends, episode) in enumerate(rows)
        ],
        schema=Decisions.dtypes(), orient="row",
    )


def values(table):
    return {(role, state, behaviour): q for role, state, behaviour, q in
            table.select("role", "state", "behaviour_id", "q").rows()}


KICK, GUIDE = "striker-021", "striker-011"
BLOCK = "goalkeeper-047"


def test_a_goal_teaches_the_behaviours_that_led_to_it():
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


def test_more_sweeps_leave_less_error_and_count_visits_once():
    known = occasions(("striker", 5, GUIDE), ("striker", 7, KICK))
    match = decisions(("striker", 5, GUIDE, 0.0, None, 0), ("striker", 7, KICK, 1.0, "terminal", 0))
    table, report = train([match], known, None, PolicySettings(sweeps=50), 1, 1)
    assert report.tables["full36"]["striker"].last_error < report.tables["full36"]["striker"].first_error
    assert table["visits"].to_list() == [1, 1]


def test_only_pairs_that_the_knowledge_holds_are_trained():
    # the same behaviour in another state, and another behaviour in the state, are not in it
    match = decisions(
        ("striker", 7, KICK, 0.0, None, 0),
        ("striker", 8, KICK, 0.0, None, 0),
        ("striker", 7, GUIDE, 1.0, "terminal", 0),
    )
    table, report = train([match], occasions(("striker", 7, KICK)), None, PLAIN, 1, 1)
    assert values(table) == {("striker", 7, KICK): 1.0}
    assert (report.decisions, report.transitions) == (3, 1)


def test_a_new_behaviour_starts_with_the_best_value_of_its_state():
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
    assert (report.pairs, report.new_pairs) == (4, 2)


def test_value_follows_a_robot_whose_role_changes():
    known = occasions(("striker", 5, KICK), ("goalkeeper", 6, BLOCK))
    match = decisions(("goalkeeper", 6, BLOCK, 0.0, None, 0), ("striker", 5, KICK, 1.0, "terminal", 0))
    table, _ = train([match], known, None, PLAIN, 1, 1)
    assert values(table) == {("goalkeeper", 6, BLOCK): 1.0, ("striker", 5, KICK): 1.0}


def test_a_random_move_is_the_behaviour_194_where_the_knowledge_holds_it():
    known = occasions(("striker", 5, "striker-194"), ("striker", 7, KICK))
    match = decisions(
        ("striker", 5, None, 0.0, None, 0), ("striker", 6, None, 0.0, None, 0), ("striker", 7, KICK, 1.0, "terminal", 0),
    )
    table, report = train([match], known, None, PLAIN, 1, 1)
    assert values(table) == {("striker", 5, "striker-194"): 1.0, ("striker", 7, KICK): 1.0}
    assert report.transitions == 2


def test_robots_episodes_and_matches_are_separate_sequences():
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
    assert (report.matches, report.decisions, report.transitions) == (2, 5, 2)


def test_time_counts_in_seconds():
    known = occasions(("striker", 5, KICK))
    match = decisions(("striker", 5, KICK, 1.0, "terminal", 0)).with_columns(end_ns=pl.lit(2 * SECOND + SECOND // 2))
    table, _ = train([match], known, None, PLAIN.model_copy(update={"discount": 0.9}), 1, 1)
    assert table["q"][0] == pytest.approx(0.9**2.5, abs=1e-15)


def test_nothing_known_nothing_played():
    table, report = train([], Occasions.empty(), None, PolicySettings(), 1, 1)
    assert table.schema == Policies.empty().schema
    assert len(table) == 0
    assert (report.matches, report.pairs, report.decisions) == (0, 0, 0)


def test_a_match_without_anything_known_changes_no_value():
    parent = policy(("striker", 7, KICK, 0.5))
    match = decisions(("striker", 9, KICK, 1.0, "terminal", 0))
    table, _ = train([match, Decisions.empty()], occasions(("striker", 7, KICK)), parent, PLAIN, 2, 1)
    assert values(table) == values(parent)


plays = st.lists(
    st.tuples(
        st.sampled_from(["goalkeeper", "midfield", "striker"]), st.integers(0, 3), st.sampled_from([21, 46, 194]),
        st.sampled_from([0.0, 1.0, -1.0]), st.sampled_from([None, None, "terminal", "truncated"]), st.integers(0, 1),
    ),
    max_size=30,
)


@settings(max_examples=40, deadline=None)
@given(plays, st.randoms(use_true_random=False))
def test_order_of_rows_does_not_matter_and_runs_repeat(rows, random):
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
    assert report.transitions <= len(held)


def test_two_versions_at_once_are_refused():
    known = occasions(("striker", 7, KICK))
    with pytest.raises(SchemaMismatch, match=r"^occasions: names a pair .* twice"):
        train([], pl.concat([known, known]), None, PLAIN, 1, 1)
    parent = policy(("striker", 7, KICK, 0.5))
    with pytest.raises(SchemaMismatch, match=r"^parent: names a pair .* twice"):
        train([], known, pl.concat([parent, parent]), PLAIN, 1, 1)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [({"end_ns": -1}, "elapsed\\[0\\] is negative"), ({"reward": float("nan")}, "reward\\[0\\] is not finite")],
)
def test_decisions_that_cannot_be_are_refused(wrong, says):
    match = decisions(("striker", 7, KICK, 0.0, "terminal", 0)).with_columns(**{k: pl.lit(v) for k, v in wrong.items()})
    with pytest.raises(SchemaMismatch, match=says):
        train([match], occasions(("striker", 7, KICK)), None, PLAIN, 1, 1)


def test_values_that_explode_stop_the_training():
    steps = PolicySettings(step_size=1.0, discount=1.0, trace_decay=1.0, traces="accumulating", sweeps=200)
    rows = [("striker", 7, KICK, 1.0, None, 0)] * 999 + [("striker", 7, KICK, 1.0, "terminal", 0)]
    with pytest.raises(BadSettings, match="beyond all bounds"):
        train([decisions(*rows)], occasions(("striker", 7, KICK)), None, steps, 1, 1)
