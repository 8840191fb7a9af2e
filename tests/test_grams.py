"""Grams: what follows a situation values it, windows never bridge anything, and sums add up in any order."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from support.rows import SIDES, consecutive, goals, patterns, situations

from pipeline.errors import SchemaMismatch
from pipeline.grams.count import cover, grams, merge, value
from pipeline.sequences import codes_of, exact, keys_of, lengths_of, role_of, windows
from pipeline.settings import GramSettings
from schemas import Grams

HALF = GramSettings(alpha=0.5, tick_s=1.0)

codes = st.sampled_from([1, 11, 21, 46, 184, 194])
sequence = st.lists(st.one_of(codes, st.none()), min_size=0, max_size=25)
matches = st.tuples(sequence, sequence, st.lists(st.tuples(st.integers(0, 12), st.sampled_from(SIDES)), max_size=3,
                                                 unique_by=lambda goal: goal[0]))


def table_of(match, n):
    home, away, scored = match
    table = situations(consecutive(home), consecutive(away, team="away", role="s"))
    return grams(value(table, goals(*scored), HALF), n, None, HALF)


class TestValue:
    def test_of_each_side_is_alpha_to_the_ticks_until_the_next_goal(self):
        table = situations(consecutive([1, 11, 21, 46], each=1.0), consecutive([1, 11], team="away", each=1.0))
        valued = value(table, goals((2.0, "home"), (4.0, "away")), HALF)
        # home starts at 0, 1 (goal for at 2), 2 (after that goal: against at 4), 3
        assert valued["value"].to_list() == [0.25, 0.5, -0.25, -0.5, -0.25, -0.5]

    def test_is_zero_when_no_goal_follows(self):
        table = situations(consecutive([1, 11, 21], each=1.0))
        assert value(table, goals((1.0, "home")), HALF)["value"].to_list() == [0.5, 0.0, 0.0]
        assert value(table, goals(), HALF)["value"].to_list() == [0.0, 0.0, 0.0]

    def test_only_the_next_goal_counts_in_whatever_order_they_are_given(self):
        table = situations(consecutive([1], each=1.0))
        assert value(table, goals((3.0, "away"), (1.0, "home")), HALF)["value"].item() == 0.5

    def test_is_zero_before_a_goal_of_unknown_team_and_never_reaches_over_it(self):
        table = situations(consecutive([1, 11, 21, 46], each=1.0), consecutive([1, 11, 21], team="away", each=1.0))
        valued = value(table, goals((1.0, "away"), (2.0, None), (4.0, "home")), HALF)
        # the goals that follow: away's at 1; nobody knows whose at 2; home's at 4
        assert valued["value"].to_list() == [-0.5, 0.0, 0.25, 0.5, 0.5, 0.0, -0.25]

    def test_takes_parts_of_a_tick_as_they_are(self):
        table = situations(consecutive([1], each=1.0))
        assert value(table, goals((0.5, "home")), HALF)["value"].item() == pytest.approx(0.5**0.5, abs=1e-12)

    @given(matches)
    @settings(max_examples=50, deadline=None)
    def test_changes_its_sign_when_the_teams_are_swapped(self, match):
        home, away, scored = match
        other = {"home": "away", "away": "home"}
        one = value(situations(consecutive(home), consecutive(away, team="away")), goals(*scored), HALF)
        two = value(situations(consecutive(home, team="away"), consecutive(away)),
                    goals(*((t, other[team]) for t, team in scored)), HALF)
        for team in SIDES:
            assert_frame_equal(one.filter(team=team).drop("team"), two.filter(team=other[team]).drop("team"))
        against = value(situations(consecutive(home), consecutive(away, team="away")),
                        goals(*((t, other[team]) for t, team in scored)), HALF)
        assert (one["value"] == -against["value"]).all()


class TestWindows:
    def test_are_all_runs_in_order(self):
        found = windows(situations(consecutive([1, 11, 21, 46, 184])), 4, None, 0.2)
        assert found.first.tolist() == [0, 1]
        assert codes_of(found.key, 4).tolist() == [[1, 11, 21, 46], [11, 21, 46, 184]]

    def test_never_bridge_a_hole_a_robot_a_team_or_a_segment(self):
        table = situations(
            consecutive([1, 11, None, 21]), consecutive([44], robot=2), consecutive([45], team="away"),
            consecutive([46], start=2.0, segment=1),
        )
        assert table["code"].to_list() == [1, 11, 21, 46, 44, 45]
        assert codes_of(windows(table, 2, None, 0.2).key, 2).tolist() == [[1, 11]]

    def test_reach_over_a_hole_that_is_shorter_than_the_gap(self):
        table = situations(consecutive([1], each=1.0), consecutive([11], start=1.19, each=1.0))
        assert len(windows(table, 2, None, 0.2).first) == 1
        assert len(windows(table, 2, None, 0.19).first) == 0

    def test_never_use_what_is_taken_nor_reach_over_it(self):
        table = situations(consecutive([1, 11, 21, 46]))
        taken = np.array([False, True, False, False])
        assert codes_of(windows(table, 2, taken, 0.2).key, 2).tolist() == [[21, 46]]

    @given(st.lists(st.integers(0, 30), min_size=1, max_size=5), st.integers(1, 4))
    @settings(max_examples=50, deadline=None)
    def test_of_a_run_of_m_are_m_less_n_plus_one(self, lengths, n):
        table = situations(*(consecutive([1] * m, start=100.0 * i, segment=i) for i, m in enumerate(lengths)))
        assert len(windows(table, n, None, 0.2).first) == sum(max(0, m - n + 1) for m in lengths)

    def test_of_situations_out_of_order_are_refused(self):
        table = situations(consecutive([1, 11, 21])).reverse()
        with pytest.raises(SchemaMismatch, match="out of order"):
            windows(table, 2, None, 0.2)

    @given(st.integers(0, 2), st.lists(st.integers(1, 194), min_size=1, max_size=4))
    def test_keys_keep_role_and_codes(self, role, gram):
        key = keys_of(np.array([role]), np.array([gram], dtype=np.int16))
        assert (role_of(key).item(), lengths_of(key).item(), codes_of(key, len(gram)).tolist()) == (
            role, len(gram), [gram])


class TestGrams:
    def test_count_and_value_the_distinct_runs_by_team_and_role(self):
        table = situations(consecutive([1, 11, 1, 11], each=1.0), consecutive([1, 11], team="away", role="s", each=1.0))
        found = grams(value(table, goals((4.0, "home")), HALF), 2, None, HALF)
        Grams.validate(found)
        # values at 0, 1, 2, 3 s are 1/16, 1/8, 1/4, 1/2; means of (1, 11) 3/32 and 3/8
        assert found.select("team", "role", "codes", "count", "value_sum", "value_square_sum").rows() == [
            ("home", "midfield", [1, 11], 2, 3 / 32 + 3 / 8, (3 / 32) ** 2 + (3 / 8) ** 2),
            ("home", "midfield", [11, 1], 1, 3 / 16, (3 / 16) ** 2),
            ("away", "striker", [1, 11], 1, -3 / 32, (3 / 32) ** 2),
        ]

    def test_have_the_role_that_is_held_when_they_start(self):
        table = situations(consecutive([1, 11, 21], role="gms"))
        assert grams(value(table, goals(), HALF), 2, None, HALF)["role"].to_list() == ["goalkeeper", "midfield"]

    def test_of_no_situations_are_none(self):
        assert grams(value(situations(), goals(), HALF), 4, None, HALF).is_empty()
        assert Grams.is_valid(grams(value(situations(), goals(), HALF), 4, None, HALF))

    @pytest.mark.slow
    @given(matches, st.integers(1, 4))
    @settings(max_examples=50, deadline=None)
    def test_hold_every_window_once(self, match, n):
        home, away, scored = match
        table = situations(consecutive(home), consecutive(away, team="away", role="s"))
        valued = value(table, goals(*scored), HALF)
        found = grams(valued, n, None, HALF)
        runs = windows(table, n, None, HALF.gap_s)
        assert Grams.is_valid(found)
        assert found["count"].sum() == len(runs.first)
        means = exact(valued["value"].to_numpy()[runs.first[:, None] + np.arange(n)].mean(axis=1))
        assert found["value_sum"].sum() == means.sum()


class TestMerge:
    @pytest.mark.slow
    @given(st.lists(matches, max_size=4), st.integers(1, 4), st.randoms(use_true_random=False))
    @settings(max_examples=40, deadline=None)
    def test_gives_the_same_in_any_order_and_for_any_split(self, found, n, random):
        tables = [table_of(match, n) for match in found]
        whole = merge(tables)
        rows = [table[i : i + 1] for table in tables for i in range(table.height)]
        random.shuffle(rows)
        cut = random.randint(0, len(rows))
        assert_frame_equal(merge(rows), whole, check_exact=True)
        assert_frame_equal(merge([merge(rows[cut:]), merge(rows[:cut])]), whole, check_exact=True)
        assert whole["count"].sum() == sum(table["count"].sum() for table in tables)

    def test_adds_over_teams_and_matches_and_sorts(self):
        table = situations(consecutive([21, 1, 21]), consecutive([1, 21], team="away"))
        one = grams(value(table, goals((8.0, "home")), HALF), 1, None, HALF)
        total = merge(iter([one, one]))
        assert total.select("role", "codes", "n", "count").rows() == [
            ("midfield", [1], 1, 4), ("midfield", [21], 1, 6)]

    def test_takes_grams_of_several_lengths(self):
        valued = value(situations(consecutive([21, 1, 21], role="gms")), goals(), HALF)
        total = merge([grams(valued, n, None, HALF) for n in (3, 1, 2)])
        assert total["n"].to_list() == [1, 1, 1, 2, 2, 3]
        assert total.filter(n=2)["codes"].to_list() == [[21, 1], [1, 21]]

    def test_adds_up_what_it_holds_back_when_it_is_much(self, monkeypatch):
        tables = [table_of(([1, 11, 21], [1], [(3, "home")]), 1) for _ in range(9)]
        whole = merge(tables)
        monkeypatch.setattr("pipeline.grams.count._BUFFERED_ROWS", 2)
        assert_frame_equal(merge(iter(tables)), whole, check_exact=True)

    def test_of_nothing_is_empty(self):
        assert merge([]).is_empty()


class TestCover:
    def test_takes_all_members_of_all_instances_overlapping_or_not(self):
        table = situations(consecutive([1, 11, 1, 11, 1, 194]))
        taken = cover(table, patterns(("m", [1, 11, 1])), HALF)
        assert taken.tolist() == [True] * 5 + [False]

    def test_needs_the_role_at_the_start(self):
        table = situations(consecutive([1, 11, 1, 11], role="mmss"))
        assert cover(table, patterns(("s", [1, 11])), HALF).tolist() == [False, False, True, True]

    def test_applies_the_longest_first_and_shorter_ones_to_the_rest(self):
        table = situations(consecutive([1, 11, 21, 46, 11, 21]))
        both = patterns(("m", [11, 21]), ("m", [1, 11, 21, 46]))
        assert cover(table, both, HALF).all()
        # 46 was used up, so 46-11 no longer occurs
        assert cover(table, patterns(("m", [46, 11]), ("m", [1, 11, 21, 46])), HALF).sum() == 4

    def test_of_no_patterns_is_nothing(self):
        assert not cover(situations(consecutive([1, 11])), patterns(), HALF).any()

    @given(sequence, st.lists(st.lists(codes, min_size=1, max_size=4), max_size=6, unique_by=tuple))
    @settings(max_examples=60, deadline=None)
    def test_of_all_rounds_at_once_is_that_of_one_round_after_the_other(self, codes_, found):
        table = situations(consecutive(codes_))
        step = np.zeros(table.height, dtype=bool)
        for n in (4, 3, 2, 1):
            wanted = {tuple(gram) for gram in found if len(gram) == n}
            runs = windows(table, n, step, HALF.gap_s)
            for first, gram in zip(runs.first, codes_of(runs.key, n).tolist(), strict=True):
                if tuple(gram) in wanted:
                    step[first : first + n] = True
        assert cover(table, patterns(*(("m", gram) for gram in found)), HALF).tolist() == step.tolist()


def test_a_tick_is_thirty_a_second_by_default_and_half_a_value_lasts_eleven_and_a_half_seconds():
    table = situations(consecutive([1], each=1.0))
    assert value(table, goals((11.54, "home")), GramSettings())["value"].item() == pytest.approx(0.5, abs=1e-3)
