"""Knowledge: counts of behaviours in states add up in any order, and versions can be compared."""

import polars as pl
from hypothesis import given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from rows import MATCH, patterns

from pipeline.knowledge import behaviours, diff, occasions
from pipeline.settings import KnowledgeSettings
from schemas import Behaviours, Decisions, Occasions

NAMES = ["striker-001-011", "striker-046", None]


def decisions(*rows):
    """(state, behaviour, value) each."""
    return pl.DataFrame(
        [(MATCH, "home", 1, "striker", i, i + 1, state, name, False, False, 0.0, 0, None, value)
         for i, (state, name, value) in enumerate(rows)],
        schema=Decisions.dtypes(), orient="row",
    )


rows = st.lists(st.tuples(st.integers(0, 3), st.sampled_from(NAMES), st.floats(-0.99, 0.99)), max_size=30)


class TestOccasions:
    def test_count_behaviours_by_state_and_moves_randomly_as_code_194(self):
        found = occasions([
            decisions((5, "striker-046", 0.5), (5, None, 0.75), (2, "striker-046", -0.25)),
            decisions((5, "striker-046", 0.25), (5, "striker-001-011", 0.5)),
        ], version=3)
        Occasions.validate(found)
        assert found.select("version", "role", "state", "behaviour_id", "count", "value").rows() == [
            (3, "striker", 2, "striker-046", 1, -0.25),
            (3, "striker", 5, "striker-001-011", 1, 0.5),
            (3, "striker", 5, "striker-046", 2, 0.375),
            (3, "striker", 5, "striker-194", 1, 0.75),
        ]

    @given(rows, st.randoms(use_true_random=False))
    @settings(max_examples=40, deadline=None)
    def test_are_the_same_in_any_order_and_for_any_split(self, found, random):
        whole = occasions([decisions(*found)], 1)
        random.shuffle(found)
        cut = random.randint(0, len(found))
        assert_frame_equal(occasions(iter([decisions(*found[:cut]), decisions(*found[cut:])]), 1), whole,
                           check_exact=True)

    def test_add_up_what_they_hold_back_when_it_is_much(self, monkeypatch):
        tables = [decisions((i % 3, "striker-046", 0.1)) for i in range(20)]
        whole = occasions(tables, 1)
        monkeypatch.setattr("pipeline.knowledge._BUFFERED_ROWS", 2)
        assert_frame_equal(occasions(tables, 1), whole, check_exact=True)

    def test_begin_with_the_greatest_value_of_their_state_and_role(self):
        seen = decisions((5, "striker-046", 0.5), (5, "striker-001-011", -0.25), (2, "striker-046", -0.5))
        initial = ["state", "behaviour_id", "initial"]
        assert occasions([seen], 1).select(initial).rows() == [
            (2, "striker-046", 0.0), (5, "striker-001-011", 0.5), (5, "striker-046", 0.5)]
        hopeful = occasions([seen], 1, KnowledgeSettings(optimistic=0.75))
        assert hopeful["initial"].to_list() == [0.75, 0.75, 0.75]

    def test_of_nothing_are_none(self):
        assert Occasions.is_valid(occasions([], 1))


class TestBehaviours:
    def test_are_the_patterns_of_all_rounds_longest_first(self):
        found = behaviours([patterns(("m", [46]), ("g", [1])), patterns(("s", [1, 11]))], version=2)
        Behaviours.validate(found)
        assert found["behaviour_id"].to_list() == ["striker-001-011", "goalkeeper-001", "midfield-046"]
        assert found["version"].unique().to_list() == [2]

    def test_of_no_patterns_are_none(self):
        assert Behaviours.is_valid(behaviours([], 1))


class TestDiff:
    BEFORE = behaviours([patterns(("s", [1, 11], 0.5), ("s", [46], 0.2), ("m", [46], 0.2))], 1)
    AFTER = behaviours([patterns(("s", [1, 11], 0.6), ("m", [46], 0.2), ("g", [1], 0.3))], 2)
    SEEN_BEFORE = occasions([decisions((1, "striker-046", 0.1), (1, "striker-001-011", 0.1))], 1)
    SEEN_AFTER = occasions([decisions((1, "striker-001-011", 0.1), (2, "striker-001-011", 0.1))], 2)

    def test_tells_what_was_added_removed_and_changed(self):
        found = diff(self.BEFORE, self.AFTER, self.SEEN_BEFORE, self.SEEN_AFTER).behaviours
        assert found.rows() == [
            ("goalkeeper-001", "added", "goalkeeper", 1, None, 3, None, 0.3, None, 0),
            ("striker-001-011", "changed", "striker", 2, 3, 3, 0.5, 0.6, 1, 2),
            ("striker-046", "removed", "striker", 1, 3, None, 0.2, None, 1, None),
        ]

    def test_counts_behaviours_states_and_pairs_of_each_role(self):
        found = diff(self.BEFORE, self.AFTER, self.SEEN_BEFORE, self.SEEN_AFTER).roles
        assert found.rows(named=True) == [
            {"role": role, "behaviours_before": b0, "states_before": s0, "pairs_before": p0,
             "behaviours_after": b1, "states_after": s1, "pairs_after": p1}
            for role, b0, s0, p0, b1, s1, p1 in [
                ("goalkeeper", 0, 0, 0, 1, 0, 0), ("midfield", 1, 0, 0, 1, 0, 0), ("striker", 2, 1, 2, 1, 2, 2)]
        ]

    def test_of_a_version_and_itself_is_nothing(self):
        found = diff(self.BEFORE, self.BEFORE, self.SEEN_BEFORE, self.SEEN_BEFORE)
        assert found.behaviours.is_empty()
