"""The map: weighted distinct grams train it as all samples would, and the same input gives the same bytes."""

import io
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from minisom import MiniSom

from pitchlore.pipeline.stages.behaviours.som import (
    best_matching_units,
    map_of,
    maps_to_bytes,
    train_map,
)

CODES = np.array([1, 11, 21, 44, 46, 57, 88, 118, 184, 194])

samples = st.lists(st.tuples(st.sampled_from(CODES.tolist()), st.sampled_from(CODES.tolist()), st.integers(1, 5)),
                   min_size=1, max_size=20)


def fit(codes, counts, rows=3, columns=3, epochs=10, seed=0, sigma_end=0.5):
    return train_map(np.array(codes, dtype=np.int16), np.array(counts), rows, columns,
                     epochs=epochs, seed=seed, sigma_end=sigma_end)


def drawn(samples=3000, n=4, seed=1):
    rng = np.random.default_rng(seed)
    raw = rng.choice(CODES, size=(samples, n), p=rng.dirichlet(np.ones(len(CODES)))).astype(np.int16)
    distinct, counts = np.unique(raw, axis=0, return_counts=True)
    return raw, distinct, counts


@given(samples, st.randoms(use_true_random=False))
@settings(max_examples=40)
def test_split_counts(found, random):
    """Counts may be split and rows shuffled without a change to the map."""
    whole = fit([row[:2] for row in found], [row[2] for row in found])
    split = [row[:2] for row in found for _ in range(row[2])]
    random.shuffle(split)
    parts = fit(split, [1] * len(split))
    assert np.array_equal(whole.weights, parts.weights)
    assert whole.quantisation_error == parts.quantisation_error


def test_batch_rule():
    """One epoch at one sigma gives what MiniSom's train_batch_offline makes of every single sample."""
    raw, distinct, counts = drawn(400)
    ours = fit(distinct, counts, epochs=1, sigma_end=1.5)
    theirs = MiniSom(3, 3, 4, sigma=1.5, learning_rate=1.0, random_seed=0)
    rng = np.random.default_rng(0)
    theirs.get_weights()[:] = distinct[
        rng.choice(len(distinct), 9, replace=False, p=counts / counts.sum())].reshape(3, 3, 4)
    theirs.train_batch_offline(raw.astype(float), 1)
    assert np.allclose(ours.weights.reshape(3, 3, 4), theirs.get_weights(), atol=1e-9)


def test_errors():
    """Errors and winners are those of MiniSom on every single sample."""
    raw, distinct, counts = drawn(400)
    ours = fit(distinct, counts)
    theirs = ours.grid
    assert ours.quantisation_error == pytest.approx(theirs.quantization_error(raw.astype(float)), rel=1e-9)
    assert ours.topographic_error == pytest.approx(theirs.topographic_error(raw.astype(float)), abs=1e-9)
    winners = [int(np.ravel_multi_index(theirs.winner(row), (3, 3))) for row in distinct]
    assert best_matching_units(ours, distinct).tolist() == winners


def test_seed_decides():
    """Equal seeds give equal weights, and another seed gives others."""
    _, distinct, counts = drawn()
    assert np.array_equal(fit(distinct, counts, seed=3).weights, fit(distinct, counts, seed=3).weights)
    assert not np.array_equal(fit(distinct, counts, seed=3).weights, fit(distinct, counts, seed=4).weights)


@given(samples)
@settings(max_examples=20)
def test_bytes(found):
    """The bytes of a map are the same each time and can be read back."""
    som = fit([row[:2] for row in found], [row[2] for row in found], 2, 3)
    other = fit([[1, 2]], [1], 1, 1)
    maps = {("../us\n", "vsss"): som, ("them", "ssl"): other}
    data = maps_to_bytes(maps)
    assert maps_to_bytes(maps) == data
    with np.load(io.BytesIO(data), allow_pickle=False) as back:
        assert json.loads(back["labels"].tobytes()) == [["../us\n", "vsss"], ["them", "ssl"]]
        assert np.array_equal(back["weights_0"].reshape(6, 2), som.weights)
        assert back["weights_0"].shape == (2, 3, 2)
        assert back["errors_0"].tolist() == [som.quantisation_error, som.topographic_error]
        assert np.array_equal(back["weights_1"][0, 0], other.weights[0])


def test_bytes_hold_no_clock(monkeypatch):
    som = fit([[1], [5]], [1, 2])
    data = maps_to_bytes({("us", "vsss"): som})
    monkeypatch.setattr("time.time", lambda: 2_000_000_000.0)
    monkeypatch.setattr("time.localtime", lambda *_: (2033, 5, 18, 3, 33, 20, 2, 138, 0))
    assert maps_to_bytes({("us", "vsss"): som}) == data


def test_ties():
    """A tie goes to the lowest neuron."""
    som = map_of(np.array([[[0.0], [10.0]]]))
    assert best_matching_units(som, np.array([[5], [6]], dtype=np.int16)).tolist() == [0, 1]
