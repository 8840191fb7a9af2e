"""Behaviours: the grams on busy neurons beyond the threshold, role by role; those above it are kept."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from polars.testing import assert_frame_equal
from scipy.stats import false_discovery_control, norm
from support.rows import changed, consecutive, goals, sequences_of, situations

from pitchlore.pipeline.numbers.statistics import false_discovery_rates
from pitchlore.pipeline.settings import BehaviourSettings, GramSettings, RoundSettings
from pitchlore.pipeline.stages.behaviours.grams import cover, grams, merge, spelt
from pitchlore.pipeline.stages.behaviours.select import select
from pitchlore.schemas import ROLES, Grams, Patterns

#: The paper's selection: the mean value by the next goal.
ANY = BehaviourSettings(
    share_of="situations", select_by="value", shrink=False, support_at_least=1, value_over=0.0, sigma_end=0.1)
BY_GOALS = GramSettings(outcome="paper")
ONE = RoundSettings(n=2, rows=1, columns=2, activation=0.10)


def table(*rows):
    """(role, codes, count, value_sum, value_square_sum) each; each instance is of a match of its own."""
    return pl.DataFrame(
        [{"role": role, "codes": list(codes), "n": len(codes), "count": count, "value_sum": total,
          "value_square_sum": squares, "match_square_sum": squares, "match_product_sum": total,
          "match_count_square_sum": count, "paper_sum": total / 2, "placed": count, "x_sum": count / 4,
          "y_sum": -count / 8} for role, codes, count, total, squares in rows],
        schema={name: dtype for name, dtype in Grams.dtypes().items() if name not in ("team", "kind")},
    )


BUSY = table(
    ("goalkeeper", [1, 11], 20, 10.0, 6.0),
    ("midfield", [1, 11], 10, -1.0, 1.0),
    ("midfield", [3, 11], 2, 0.5, 0.125),
    ("striker", [194, 194], 9, 4.0, 2.0),
)


def test_busy_and_valuable():
    """A behaviour has a busy neuron and a value over the threshold, or under its negative: that is not kept."""
    chosen = select(BUSY, 100, ANY, ONE)
    Patterns.validate(chosen.patterns)
    columns = ("behaviour_id", "codes", "n", "support", "value", "spread", "pays", "kept")
    assert chosen.patterns.select(columns).rows() == [
        ("goalkeeper-001-011", [1, 11], 2, 20, 0.5, pytest.approx((0.3 - 0.25) ** 0.5), "+", True),
        ("midfield-001-011", [1, 11], 2, 10, -0.1, 0.3, "?", False),
        ("midfield-003-011", [3, 11], 2, 2, 0.25, 0.0, "?", True),
    ]
    others = chosen.patterns.filter("kept").select("mean", "family", "family_spread", "paper", "x", "y")
    assert others.rows() == [(0.5, None, None, 0.25, 0.25, -0.125), (0.25, None, None, 0.125, 0.25, -0.125)]
    assert chosen.report._replace(activations=()) == (2, 4, 41, 10.0, (), 1, 3, 2, 22, 1)
    assert sorted(chosen.report.activations) == [9, 32]


@pytest.mark.parametrize(("recognised", "kept"), [(320, 1), (321, 0)])
def test_share_of_situations(recognised, kept):
    """A neuron is busy if it has at least the wanted share of all recognised situations."""
    report = select(BUSY, recognised, ANY, ONE).report
    assert (report.neurons_kept, report.groups_kept > 0) == (kept, kept == 1)


@pytest.mark.parametrize(("activation", "kept"), [(0.2, 2), (0.22, 1), (0.78, 1), (0.79, 0)])
def test_share_of_groups(activation, kept):
    """By groups, a neuron needs its share of the groups, however many situations there were."""
    by_groups = ANY.model_copy(update={"share_of": "groups"})
    report = select(BUSY, 1_000_000, by_groups, ONE.model_copy(update={"activation": activation})).report
    assert report.threshold == pytest.approx(41 * activation)
    assert report.neurons_kept == kept


def test_least_support():
    """A behaviour was seen at least as often as the settings ask."""
    chosen = select(BUSY, 100, ANY.model_copy(update={"support_at_least": 3}), ONE)
    assert chosen.patterns["behaviour_id"].to_list() == ["goalkeeper-001-011", "midfield-001-011"]


def test_value_threshold_is_exclusive():
    """A value equal to the threshold is not enough."""
    chosen = select(BUSY, 100, ANY.model_copy(update={"value_over": 0.25}), ONE)
    assert chosen.patterns["behaviour_id"].to_list() == ["goalkeeper-001-011"]


def test_unknown_places():
    """A behaviour whose places are not known begins nowhere."""
    nowhere = BUSY.with_columns(placed=pl.lit(0, pl.Int64), x_sum=pl.lit(0.0), y_sum=pl.lit(0.0))
    assert select(nowhere, 100, ANY, ONE).patterns.select("x", "y").null_count().row(0) == (3, 3)


def test_lower_end():
    """By default the whole interval of the value must lie above the threshold."""
    found = table(("striker", [1, 11], 50, 25.0, 25.0), ("striker", [3, 11], 3, 1.5, 1.5))  # alike, but for the support
    by_value, by_low = (ANY.model_copy(update={"select_by": column}) for column in ("value", "low"))
    assert select(found, 10, by_value, ONE).patterns["behaviour_id"].to_list() == ["striker-001-011", "striker-003-011"]
    chosen = select(found, 10, by_low, ONE).patterns
    assert chosen["behaviour_id"].to_list() == ["striker-001-011"]
    assert chosen["low"].item() > 0


@pytest.mark.parametrize(("paying", "kept"), [
    ([], ["goalkeeper-001-011", "midfield-001-011", "midfield-003-011", "striker-001-011"]),
    (["striker"], ["goalkeeper-001-011", "midfield-001-011", "midfield-003-011"]),
    (ROLES, ["goalkeeper-001-011"]),
])
def test_what_a_role_usually_does(paying, kept):
    """A role that nothing pays, of this round or earlier ones, keeps what it did often enough, on busy neurons."""
    found = pl.concat([BUSY, table(("striker", [1, 11], 30, -9.0, 4.0), ("striker", [3, 11], 1, 0.1, 0.1))])
    settings = ANY.model_copy(update={"value_over": 0.3, "support_at_least": 2})
    chosen = select(found, 100, settings, ONE, paying).patterns
    assert chosen.filter("kept")["behaviour_id"].to_list() == kept


def test_costs():
    """A behaviour whose interval lies below 0 stays beside those that pay, is not kept, and is sure by the rates."""
    found = table(("striker", [1, 11], 50, 25.0, 25.0), ("striker", [3, 11], 50, -25.0, 25.0), ("striker", [3, 1], 9, -1.5, 1.0))
    chosen = select(found, 10, ANY.model_copy(update={"select_by": "low"}), ONE)
    assert chosen.patterns.select("codes", "pays", "kept").rows() == [([1, 11], "+", True), ([3, 11], "-", False)]
    assert (chosen.report.groups_kept, chosen.report.groups_cost, chosen.report.instances_kept) == (1, 1, 50)
    value, error = np.array([3.0, -2.0, 2.3, 0.4, 0.0]), np.ones(5)
    rates = false_discovery_control(2 * norm.sf(np.abs(value)))
    assert_allclose(false_discovery_rates(value, error), rates)


def test_only_random():
    """Moving randomly all the time is no behaviour, unless the settings ask for it."""
    assert "striker-194-194" not in select(BUSY, 50, ANY, ONE).patterns["behaviour_id"]
    asked = select(BUSY, 50, ANY.model_copy(update={"keep_random": True}), ONE)
    assert "striker-194-194" in asked.patterns["behaviour_id"]


def test_no_grams():
    """No grams give no behaviours."""
    chosen = select(table(), 100, ANY, ONE)
    assert chosen.patterns.is_empty()
    assert chosen.map is None
    assert chosen.report.windows == 0


rows = st.lists(
    st.tuples(st.sampled_from(ROLES), st.tuples(*[st.sampled_from([1, 11, 46, 184, 194])] * 2), st.integers(1, 30),
              st.integers(-8, 8)),
    min_size=1, max_size=15, unique_by=lambda row: row[:2],
)


@given(rows, st.randoms(use_true_random=False), st.integers(10, 300))
@settings(max_examples=40)
def test_order_of_grams(found, random, recognised):
    """Behaviours and their report do not depend on the order of the grams."""
    listed = [(role, codes, count, eighths * count / 8, (eighths / 8) ** 2 * count)
              for role, codes, count, eighths in found]
    one = select(table(*listed), recognised, ANY, ONE)
    random.shuffle(listed)
    two = select(table(*listed), recognised, ANY, ONE)
    assert_frame_equal(one.patterns, two.patterns, check_exact=True)
    assert one.report == two.report
    assert sum(one.report.activations) == one.report.windows == sum(row[2] for row in listed)


@given(rows)
@settings(max_examples=40)
def test_default_rounds(found):
    """With the default settings the busiest neuron of a round always passes."""
    listed = [(role, codes, count, 0.0, 0.0) for role, codes, count, _ in found]
    default = BehaviourSettings()
    for round_ in default.rounds:
        assert round_.rows * round_.columns * round_.activation <= 1
    assert select(table(*listed), 10**9, default, default.rounds[2]).report.neurons_kept >= 1


def test_rounds_long_to_short():
    """A gram that recurs before goals is kept whole; what lies between is left for the shorter rounds."""
    words = [44, 1, 11, 21]
    table_ = situations(*(consecutive([*words, 194, 46], start=10.0 * i, segment=i) for i in range(10)))
    scored = goals(*((10.0 * i + 5, "home") for i in range(10)))
    valued = sequences_of(table_, scored, changed(table_), BY_GOALS)
    known = Patterns.empty()
    for n in (4, 3, 2, 1):
        round_ = RoundSettings(n=n, rows=2, columns=2, activation=0.10)
        found = spelt(merge([grams(valued, n, cover(valued, known))]), n)
        chosen = select(found, table_.height, ANY, round_)
        known = pl.concat([known, chosen.patterns])
        if n == 4:
            assert [44, 1, 11, 21] in chosen.patterns["codes"].to_list()
        assert not spelt(grams(valued, n, cover(valued, known)), n).join(
            chosen.patterns, on=("role", "codes"), how="semi").height
    assert known["n"].is_sorted(descending=True)
