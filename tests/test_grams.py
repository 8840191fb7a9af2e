"""Grams: what follows a situation values it, windows never bridge anything, and sums add up in any order."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal
from support.rows import SIDES, changed, consecutive, goals, patterns, sequences_of, situations

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.numbers.sums import exact
from pitchlore.pipeline.settings import GramSettings
from pitchlore.pipeline.stages.behaviours.grams import cover, grams, merge, spelt
from pitchlore.pipeline.stages.sequences.derive import value
from pitchlore.pipeline.stages.sequences.follows import followed
from pitchlore.pipeline.stages.sequences.windows import (
    codes_of,
    keys_of,
    owner_of,
    role_of,
    windows,
)
from pitchlore.schemas import Sequences

HALF = GramSettings(alpha=0.5, tick_s=1.0, outcome="paper")

codes = st.sampled_from([1, 11, 21, 46, 184, 194])
sequence = st.lists(st.one_of(codes, st.none()), min_size=0, max_size=25)
matches = st.tuples(sequence, sequence, st.lists(st.tuples(st.integers(0, 12), st.sampled_from(SIDES)), max_size=3,
                                                 unique_by=lambda goal: goal[0]))


def sequence_of(table, scored=None, *changes, settings=HALF, x=0.0, y=0.0):
    """The situations as sequences, each side by itself; they change nothing of V, unless that is given."""
    worths = changed(table, *changes, x=x, y=y).select("change", "x", "y")
    found = sequences_of(table, goals() if scored is None else scored, worths, settings)
    Sequences.validate(found)
    return found.with_columns(who=pl.col("team").to_physical().cast(pl.Int64))


def counted(sequence, n, taken=None):
    """The grams of a sequence, spelt, in order."""
    return spelt(merge([grams(sequence, n, taken)]), n)


def table_of(match, n):
    home, away, scored = match
    table = situations(consecutive(home), consecutive(away, team="away", role="s"))
    return grams(sequence_of(table, goals(*scored)), n)


class TestValue:
    def test_alpha_to_the_ticks(self):
        """A value is alpha to the ticks until the next goal, negative if it is against."""
        table = situations(consecutive([1, 11, 21, 46], each=1.0), consecutive([1, 11], team="away", each=1.0))
        valued = value(table, goals((2.0, "home"), (4.0, "away")), HALF)
        # home starts at 0, 1 (goal for at 2), 2 (after that goal: against at 4), 3
        assert valued["value"].to_list() == [0.25, 0.5, -0.25, -0.5, -0.25, -0.5]

    def test_no_goal_follows(self):
        """A value is zero if no goal follows."""
        table = situations(consecutive([1, 11, 21], each=1.0))
        assert value(table, goals((1.0, "home")), HALF)["value"].to_list() == [0.5, 0.0, 0.0]
        assert value(table, goals(), HALF)["value"].to_list() == [0.0, 0.0, 0.0]

    def test_goal_of_unknown_team(self):
        """A value is zero before a goal of unknown team and never reaches over it."""
        table = situations(consecutive([1, 11, 21, 46], each=1.0), consecutive([1, 11, 21], team="away", each=1.0))
        valued = value(table, goals((1.0, "away"), (2.0, None), (4.0, "home")), HALF)
        # the goals that follow: away's at 1; nobody knows whose at 2; home's at 4
        assert valued["value"].to_list() == [-0.5, 0.0, 0.25, 0.5, 0.5, 0.0, -0.25]

    @given(matches)
    @settings(max_examples=50)
    def test_teams_swapped(self, match):
        """A value changes its sign if the goals' teams are swapped, and none if all teams are."""
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
    def test_all_runs(self):
        """Windows are all runs of n situations in order."""
        found = windows(followed(situations(consecutive([1, 11, 21, 46, 184])), 0.2), 4)
        assert found.first.tolist() == [0, 1]
        assert codes_of(found.key, 4).tolist() == [[1, 11, 21, 46], [11, 21, 46, 184]]

    def test_no_bridges(self):
        """Windows never bridge a hole, a robot, a team or a segment."""
        table = situations(
            consecutive([1, 11, None, 21]), consecutive([44], robot=2), consecutive([45], team="away"),
            consecutive([46], start=2.0, segment=1),
        )
        assert table["code"].to_list() == [1, 11, 21, 46, 44, 45]
        assert codes_of(windows(followed(table, 0.2), 2).key, 2).tolist() == [[1, 11]]

    def test_short_hole(self):
        """Windows reach over a hole that is shorter than the gap."""
        table = situations(consecutive([1], each=1.0), consecutive([11], start=1.19, each=1.0))
        assert len(windows(followed(table, 0.2), 2).first) == 1
        assert len(windows(followed(table, 0.19), 2).first) == 0

    def test_taken(self):
        """Windows never use what is taken, nor reach over it."""
        table = situations(consecutive([1, 11, 21, 46]))
        taken = np.array([False, True, False, False])
        assert codes_of(windows(followed(table, 0.2), 2, taken).key, 2).tolist() == [[21, 46]]

    def test_out_of_order(self):
        """Situations out of order are refused."""
        table = situations(consecutive([1, 11, 21])).reverse()
        with pytest.raises(SchemaMismatch, match="out of order"):
            followed(table, 0.2)

    @given(st.integers(0, 2), st.lists(st.integers(1, 194), min_size=1, max_size=4), st.integers(0, 1 << 20))
    def test_keys(self, role, gram, who):
        """Keys keep the owner, the role and the codes."""
        key = keys_of(np.array([role]), np.array([gram], dtype=np.int16), np.array([who]))
        assert (owner_of(key).item(), role_of(key).item(), codes_of(key, len(gram)).tolist()) == (who, role, [gram])


class TestGrams:
    def test_count_and_value(self):
        """Grams count and value the distinct runs by team and role."""
        table = situations(consecutive([1, 11, 1, 11], each=1.0), consecutive([1, 11], team="away", role="s", each=1.0))
        found = counted(sequence_of(table, goals((4.0, "home"))), 2)
        # values at 0, 1, 2, 3 s are 1/16, 1/8, 1/4, 1/2; means of (1, 11) 3/32 and 3/8
        assert found.select("who", "role", "codes", "count", "value_sum", "value_square_sum").rows() == [
            (0, "midfield", [1, 11], 2, 3 / 32 + 3 / 8, (3 / 32) ** 2 + (3 / 8) ** 2),
            (0, "midfield", [11, 1], 1, 3 / 16, (3 / 16) ** 2),
            (1, "striker", [1, 11], 1, -3 / 32, (3 / 32) ** 2),
        ]

    def test_change(self):
        """A gram's value is the sum of what its situations change; that by the next goal stays beside it."""
        table = situations(consecutive([1, 11, 1, 11], each=1.0), consecutive([1, 11], team="away", role="s", each=1.0))
        by_change = GramSettings(alpha=0.5, tick_s=1.0)
        found = counted(
            sequence_of(table, goals((4.0, "home")), 0.25, -0.5, 0.125, 0.75, -0.25, 1.0, settings=by_change), 2)
        # (1, 11) of home: 0.25 - 0.5 and 0.125 + 0.75
        assert found.select("codes", "count", "value_sum", "value_square_sum", "paper_sum").rows() == [
            ([1, 11], 2, -0.25 + 0.875, 0.25**2 + 0.875**2, 3 / 32 + 3 / 8),
            ([11, 1], 1, -0.375, 0.375**2, 3 / 16),
            ([1, 11], 1, 0.75, 0.75**2, -3 / 32),
        ]

    def test_places(self):
        """Places at the start are summed where they are known."""
        places = sequence_of(situations(consecutive([1, 1, 1]))).with_columns(
            x=pl.Series([0.5, None, -0.25], dtype=pl.Float32), y=pl.Series([0.25, None, 0.25], dtype=pl.Float32))
        found = grams(places, 1)
        assert found.select("placed", "x_sum", "y_sum").row(0) == (2, 0.25, 0.5)
        assert grams(places, 3).select("placed", "x_sum").row(0) == (1, 0.5), "that of the first situation"

    def test_role_at_start(self):
        """A gram has the role that is held when it starts."""
        table = situations(consecutive([1, 11, 21], role="gms"))
        assert counted(sequence_of(table), 2)["role"].to_list() == ["goalkeeper", "midfield"]

    @pytest.mark.slow
    @given(st.lists(matches, min_size=1, max_size=3), st.integers(1, 4), st.booleans(), st.integers(0, 99))
    @settings(max_examples=50)
    def test_every_window_once(self, found, n, by_change, seed):
        """Counts and sums are those of every window, one by one, to the last bit; squares are of whole matches."""
        rng = np.random.default_rng(seed)
        tables = [sequence_of(situations(consecutive(home), consecutive(away, team="away", role="s")), goals(*scored))
                  .with_columns(match_id=pl.lit(str(number))) for number, (home, away, scored) in enumerate(found)]
        table = pl.concat(tables)
        value, change = rng.uniform(-1, 1, (2, table.height))
        x = np.where(rng.random(table.height) < 0.3, np.nan, value)
        table = table.with_columns(
            pl.Series("value", value), pl.Series("x", x, dtype=pl.Float32).fill_nan(None),
            pl.Series("y", x, dtype=pl.Float32).fill_nan(None), change=pl.Series(change) if by_change else None)
        taken, told = rng.random(table.height) < 0.2, {}
        for first, key in zip(*windows(table, n, taken), strict=True):
            rows = slice(first, first + n)
            worth, paper = exact(change[rows].sum()), exact(value[rows].sum() / n)
            told.setdefault((key, table["match_id"][int(first)]), []).append((worth if by_change else paper, paper, table["x"][int(first)]))
        of_keys = {}
        for (key, _), each in sorted(told.items()):
            worths, papers, places = zip(*each, strict=True)
            there, total = [exact(place, 2.0**-16) for place in places if place is not None], sum(worths)
            of_keys.setdefault(key, []).append((
                len(each), total, sum(exact(worth**2) for worth in worths), exact(total**2, 2.0**-16),
                exact(total * len(each), 2.0**-16), len(each) ** 2, sum(papers), len(there), sum(there), sum(there)))
        assert grams(table, n, taken).rows() == [(key, *map(sum, zip(*each, strict=True))) for key, each in sorted(of_keys.items())]


class TestMerge:
    @pytest.mark.slow
    @given(st.lists(matches, max_size=4), st.integers(1, 4), st.randoms(use_true_random=False))
    @settings(max_examples=15)
    def test_any_order(self, found, n, random):
        """A merge gives the same in any order and for any split."""
        none = table_of(([], [], []), n)
        tables = [table_of(match, n) for match in found]
        whole = merge([none, *tables])
        rows = [table[i : i + 1] for table in tables for i in range(table.height)]
        random.shuffle(rows)
        cut = random.randint(0, len(rows))
        assert_frame_equal(merge([none, *rows]), whole, check_exact=True)
        parts = [merge([none, *rows[cut:]]), merge([none, *rows[:cut]])]
        assert_frame_equal(merge(parts), whole, check_exact=True)
        assert whole["count"].sum() == sum(table["count"].sum() for table in tables)

class TestCover:
    def test_overlaps(self):
        """A cover takes all members of all instances, overlapping or not."""
        table = situations(consecutive([1, 11, 1, 11, 1, 194]))
        taken = cover(followed(table, HALF.gap_s), patterns(("m", [1, 11, 1])))
        assert taken.tolist() == [True] * 5 + [False]

    def test_role_at_start(self):
        """A pattern covers only what starts in its role."""
        table = situations(consecutive([1, 11, 1, 11], role="mmss"))
        assert cover(followed(table, HALF.gap_s), patterns(("s", [1, 11]))).tolist() == [False, False, True, True]

    @given(sequence, st.lists(st.lists(codes, min_size=1, max_size=4), max_size=6, unique_by=tuple))
    @settings(max_examples=60)
    def test_all_rounds(self, codes_, found):
        """The cover of all rounds at once is that of one round after the other."""
        table = situations(consecutive(codes_))
        step = np.zeros(table.height, dtype=bool)
        for n in (4, 3, 2, 1):
            wanted = {tuple(gram) for gram in found if len(gram) == n}
            runs = windows(followed(table, HALF.gap_s), n, step)
            for first, gram in zip(runs.first, codes_of(runs.key, n).tolist(), strict=True):
                if tuple(gram) in wanted:
                    step[first : first + n] = True
        assert cover(followed(table, HALF.gap_s), patterns(*(("m", gram) for gram in found))).tolist() == step.tolist()


def test_default_half_life():
    """By default a value is halved in eleven and a half seconds."""
    table = situations(consecutive([1], each=1.0))
    assert value(table, goals((11.54, "home")), GramSettings())["value"].item() == pytest.approx(0.5, abs=1e-3)
