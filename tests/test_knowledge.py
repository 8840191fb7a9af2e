"""Knowledge: counts of behaviours in states add up in any order, and versions can be compared."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from support.rows import MATCH, patterns

from pipeline.knowledge import behaviours, diff, merge_behaviours, merge_occasions, occasions
from pipeline.sequences import exact
from pipeline.settings import KnowledgeSettings
from pipeline.state import encode
from schemas import ROLES, Behaviours, Decisions, Occasions

NAMES = ["striker-001-011", "striker-046", None]


def decisions(*rows, team="home", role="striker", chosen=False):
    """(state, behaviour, value) each."""
    return pl.DataFrame(
        [(MATCH, team, 1, role, i, i + 1, state, name, chosen, False, 0.0, 0, None, value)
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

    def test_are_kept_by_every_key_from_fine_to_coarse(self):
        near, far = np.zeros((2, 36), dtype=np.uint8)
        near[0] = far[0] = 1  # the own goalkeeper's distance to the ball: another robot's, for a striker
        far[2] = 1  # the own striker's
        states = encode(np.array([np.zeros(36, dtype=np.uint8), near, far]), "full36").tolist()
        table = decisions(*((state, "striker-046", v) for state, v in zip(states, (0.5, 0.25, -0.25), strict=True)))
        found = occasions([table], 1, KnowledgeSettings(backoff=("self9", "role0")))
        Occasions.validate(found)
        own = encode(far[None], "self9", np.array([2])).item()
        assert found.select("key", "state", "count", "value").rows() == [
            ("full36", states[0], 1, 0.5), ("full36", states[1], 1, 0.25), ("full36", states[2], 1, -0.25),
            ("self9", 0, 2, 0.375), ("self9", own, 1, -0.25),
            ("role0", 0, 3, 0.5 / 3),
        ]
        goalkeeper = occasions([table.with_columns(role=pl.lit("goalkeeper", pl.Enum(ROLES)))], 1,
                               KnowledgeSettings(state_key="self9"))
        assert goalkeeper["count"].to_list() == [1, 2], "the same states, seen from another slot"

    def test_are_of_the_teams_that_are_learned_from(self):
        both = [decisions((5, "striker-046", 0.5)), decisions((5, "striker-011", 0.25), team="away")]
        away = occasions(both, 1, KnowledgeSettings(teams=("away",)))
        assert_frame_equal(away, occasions(both[1:], 1))
        assert away["behaviour_id"].to_list() == ["striker-011"]

    @pytest.mark.parametrize(("own", "expected"), [
        ("nothing", []),
        ("moves randomly", [(5, "striker-194", 1, 0.75), (6, "striker-194", 0, None)]),
        ("chosen", [(5, "striker-046", 1, 0.5), (5, "striker-194", 1, 0.75),
                    (6, "striker-046", 1, -0.25), (6, "striker-194", 0, None)]),
    ])
    def test_a_state_in_which_a_player_decided_adds_what_the_settings_say(self, own, expected):
        rows = [(5, "striker-046", 0.5), (5, None, 0.75), (6, "striker-046", -0.25), (6, "striker-011", 0.5)]
        found = occasions([decisions(*rows, chosen=True)], 1, KnowledgeSettings(own=own, teams=("away",)),
                          known=pl.Series(["striker-046"]))
        Occasions.validate(found)
        assert found.select("state", "behaviour_id", "count", "value").rows() == expected

    def test_what_nobody_was_seen_to_begin_has_no_value_and_does_not_raise_the_others(self):
        found = occasions([decisions((6, "striker-046", -0.25), chosen=True)], 1,
                          KnowledgeSettings(own="chosen", optimistic=-1.0))
        assert found.select("behaviour_id", "value", "initial").rows() == [
            ("striker-046", -0.25, -0.25), ("striker-194", None, -0.25)]


MATCHES = st.lists(st.tuples(rows, st.booleans()), min_size=1, max_size=5)


class TestMerging:
    """Knowledge that adds up, version by version, is what it would be if it were made at once."""

    @given(MATCHES, st.sampled_from(["nothing", "moves randomly", "chosen"]), st.floats(-1.0, 1.0))
    @settings(max_examples=40, deadline=None)
    def test_occasions_match_by_match_are_those_of_all_matches(self, matches, own, optimistic):
        chosen = KnowledgeSettings(own=own, optimistic=optimistic, backoff=("self6", "role0"))
        tables = [decisions(*found, chosen=by_player) for found, by_player in matches]
        whole = occasions(tables, 9, chosen)
        steps = occasions(tables[:1], 1, chosen)
        for version, table in enumerate(tables[1:], start=2):
            steps = merge_occasions([steps, occasions([table], version, chosen)], version, chosen)
        Occasions.validate(steps)
        assert_frame_equal(steps.drop("version"), whole.drop("version"), check_exact=True)
        assert_frame_equal(merge_occasions([whole], 9, chosen), whole, check_exact=True)

    @staticmethod
    def version(*found, neuron=0):
        """Behaviours by the values of their instances: (id, values) each, as the selection makes them."""
        rows = []
        for name, values in found:
            values = exact(np.array(values))
            codes = [int(code) for code in name.split("-")[1:]]
            rows.append((name, "striker", codes, len(codes), len(values), values.sum() / len(values), values.std(),
                         neuron, 1))
        table = pl.DataFrame(rows, schema=Behaviours.dtypes(), orient="row")
        return Behaviours.validate(table.sort("n", "role", "codes", descending=[True, False, False]))

    def test_behaviours_are_pooled(self):
        before = self.version(("striker-046", [0.5, 0.5]), ("striker-001-011", [0.25]))
        after = self.version(("striker-046", [-0.25, 0.25]), ("striker-011", [0.75]), neuron=4)
        found = merge_behaviours([before, after], 2)
        Behaviours.validate(found)
        assert found.select("behaviour_id", "support", "value", "neuron", "version").rows() == [
            ("striker-001-011", 1, 0.25, 0, 2), ("striker-011", 1, 0.75, 4, 2), ("striker-046", 4, 0.25, 4, 2)]
        # of 1/2, 1/2, -1/4, 1/4: the mean of the squares is 10/64, the square of the mean 4/64
        assert found["spread"].to_list() == [0.0, 0.0, pytest.approx((6 / 64) ** 0.5)]

    @pytest.mark.slow
    @given(st.lists(st.lists(st.floats(-0.99, 0.99), min_size=1, max_size=40), min_size=2, max_size=5))
    @settings(max_examples=60, deadline=None)
    def test_behaviours_in_steps_are_those_at_once(self, parts):
        whole = self.version(("striker-046", [value for part in parts for value in part]))
        versions = [self.version(("striker-046", part)) for part in parts]
        steps = versions[0]
        for later in versions[1:]:
            steps = merge_behaviours([steps, later], 1)
        for found in (steps, merge_behaviours(versions, 1)):
            assert found.drop("spread").equals(whole.drop("spread"))
            assert found["spread"].item() == pytest.approx(whole["spread"].item(), abs=1e-12)


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

    def test_counts_an_occasion_once_by_however_many_keys_it_is_kept(self):
        tables = [decisions((1, "striker-001-011", 0.1), (2, "striker-001-011", 0.1))]
        more = occasions(tables, 2, KnowledgeSettings(backoff=("self9", "role0")))
        assert more.height > self.SEEN_AFTER.height
        found, plain = (diff(self.BEFORE, self.AFTER, self.SEEN_BEFORE, seen) for seen in (more, self.SEEN_AFTER))
        assert_frame_equal(found.behaviours, plain.behaviours)
        assert_frame_equal(found.roles, plain.roles)

    def test_of_a_version_and_itself_is_nothing(self):
        found = diff(self.BEFORE, self.BEFORE, self.SEEN_BEFORE, self.SEEN_BEFORE)
        assert found.behaviours.is_empty()
