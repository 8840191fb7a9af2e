"""Neurons: what lies on each neuron of a map, and how far it is from the others."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from minisom import MiniSom
from test_behaviours import ANY, BUSY, table
from test_rounds import league_of, leagues

from pitchlore.pipeline.settings import BehaviourSettings, RoundSettings
from pitchlore.pipeline.stages.behaviours.neurons import distances, neurons
from pitchlore.pipeline.stages.behaviours.rounds import learn
from pitchlore.pipeline.stages.behaviours.select import select
from pitchlore.pipeline.stages.behaviours.som import map_of
from pitchlore.pipeline.stages.sides.teams import Team
from pitchlore.schemas import Neurons


def test_by_hand():
    """Counts, means and distances of four neurons in two rows, one of them without grams."""
    som = map_of(np.array([[[0.0], [3.0]], [[4.0], [10.0]]]), (0.5, 0.25))
    grams = pl.DataFrame({"count": [2, 3, 5], "value_sum": [1.0, 0.5, -2.0]})
    found = neurons(som, np.array([0, 0, 3]), grams, np.array([True, False, False, True]))
    assert Neurons.validate(found.with_columns(team=pl.lit("x"), kind=pl.lit("vsss"))).height == 4
    columns = ("neuron", "grid_row", "grid_column", "prototype", "grams", "count", "value", "kept", "distance")
    assert found.select(columns).rows() == [
        (0, 0, 0, [0.0], 2, 5, 0.3, True, pytest.approx(17 / 3)), (1, 0, 1, [3.0], 0, 0, None, False, pytest.approx(11 / 3)),
        (2, 1, 0, [4.0], 0, 0, None, False, pytest.approx(11 / 3)), (3, 1, 1, [10.0], 1, 5, -0.4, True, pytest.approx(23 / 3))]
    assert found.select("quantisation_error", "topographic_error").unique().rows() == [(0.5, 0.25)]


def test_one_neuron_has_no_distance():
    """A map of one neuron has none to be far from."""
    found = neurons(map_of(np.array([[[5.0]]])), np.array([0]), pl.DataFrame({"count": [1], "value_sum": [0.0]}), np.array([True]))
    assert found["distance"].to_list() == [None]


@given(st.integers(1, 4), st.integers(1, 5), st.integers(0, 10**6))
def test_distances_are_minisoms(rows, columns, seed):
    """The distances are MiniSom's U-matrix, which divides by the greatest."""
    if rows * columns == 1:
        return
    weights = np.random.default_rng(seed).uniform(1, 194, (rows * columns, 3))
    theirs = MiniSom(rows, columns, 3, random_seed=0)
    theirs._weights = weights.reshape(rows, columns, 3)
    ours = distances(map_of(np.reshape(weights, (rows, columns, -1))))
    assert ours / ours.max() == pytest.approx(theirs.distance_map("mean").ravel())


def test_as_selected():
    """The neurons that are kept, and their activations, are those of the selection."""
    chosen = select(BUSY, 100, ANY, RoundSettings(n=2, rows=1, columns=2, activation=0.10))
    assert chosen.neurons["count"].to_list() == list(chosen.report.activations)
    assert chosen.neurons["kept"].sum() == chosen.report.neurons_kept
    assert chosen.neurons["grams"].sum() == BUSY.height
    on = dict(zip(BUSY.select("role", "codes").map_rows(lambda row: str((row[0], list(row[1])))).to_series(), chosen.neuron, strict=True))
    for row in chosen.patterns.iter_rows(named=True):
        assert on[str((row["role"], row["codes"]))] == row["neuron"]
    assert select(table(), 100, ANY, RoundSettings(n=2, rows=1, columns=2, activation=0.1)).neurons.is_empty()


@pytest.mark.slow
@given(leagues)
def test_each_gram_lies_on_a_neuron(found):
    """Each gram's neuron is one of its team's map of its length; sums of grams are the neuron's if none is left out."""
    tables, sides = league_of(found)
    settings = BehaviourSettings(
        select_by="value", value_over=-9.0, shrink=False, support_at_least=1, epochs=3,
        rounds=tuple(RoundSettings(n=n, rows=1, columns=2, activation=0.3) for n in (2, 1)))
    learned = learn(tables.values, sides, settings)
    place = (*Team._fields, "n", "neuron")
    summed = learned.grams.group_by(place).agg(
        grams=pl.len().cast(pl.Int64), count=pl.col("count").sum(), value_sum=pl.col("value_sum").sum())
    both = learned.neurons.join(summed, on=place, how="full", suffix="_", coalesce=True)
    assert both["grid_row"].null_count() == 0
    assert both.filter(pl.col("count").ne_missing(pl.col("count_").fill_null(0))).is_empty()
    assert both.filter(pl.col("grams").ne_missing(pl.col("grams_").fill_null(0))).is_empty()
    means = both.filter(pl.col("count") > 0)
    assert means["value"].to_list() == pytest.approx((means["value_sum"] / means["count"]).to_list())
