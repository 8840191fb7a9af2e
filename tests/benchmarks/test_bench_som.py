"""The map's training: distinct grams with their counts against every sample, and against MiniSom's own.

A unit of work is a gram of the matches, however often it occurs. The quantisation error of each is in
its ``extra_info``.
"""

import warnings

import numpy as np
import pytest
from minisom import MiniSom

from pitchlore.pipeline.stages.behaviours.som import train_map

CODES = np.array([1, 11, 21, 22, 34, 44, 46, 47, 57, 68, 78, 88, 108, 118, 138, 150, 162, 173, 184, 194])
GRAMS_A_MATCH = 7_000
EPOCHS = 20


def samples(matches, n=4):
    """Grams of a Markov chain of codes, as many as so many matches have, int16 [D, n]."""
    rng = np.random.default_rng(7)
    steps = rng.dirichlet(np.full(len(CODES), 0.15), size=len(CODES)).cumsum(axis=1)
    chain = np.zeros((n, GRAMS_A_MATCH * matches), dtype=np.int64)
    chain[0] = rng.integers(len(CODES), size=chain.shape[1])
    for i in range(1, n):
        chain[i] = (rng.random(chain.shape[1])[:, None] > steps[chain[i - 1]]).sum(axis=1).clip(max=len(CODES) - 1)
    return CODES[chain.T].astype(np.int16)


def error(weights, distinct, counts):
    """Mean distance to the best-matching unit, every sample counted."""
    gaps = np.linalg.norm(distinct[:, None].astype(float) - weights.reshape(1, -1, distinct.shape[1]), axis=2)
    return float(np.average(gaps.min(axis=1), weights=counts))


def ours(codes, counts):
    return train_map(codes, counts, 3, 3, epochs=EPOCHS, seed=0, sigma_end=0.5).weights


def minisom(decay, sigma=1.5):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return MiniSom(3, 3, 4, sigma=sigma, learning_rate=0.5, sigma_decay_function=decay, random_seed=0)


def trained(codes, decay, offline):
    som = minisom(decay)
    som.random_weights_init(codes)
    if offline:
        som.train_batch_offline(codes.astype(float), EPOCHS)
    else:
        som.train(codes.astype(float), EPOCHS, use_epochs=True, random_order=True)
    return som.get_weights()


@pytest.mark.benchmark(group="train a 3 × 3 map on the 4-grams of one match, 20 epochs")
@pytest.mark.parametrize("how", [
    "ours, distinct grams", "ours, every gram", "MiniSom.train, sigma to one", "MiniSom.train, default",
    "MiniSom.train_batch_offline, sigma to one", "MiniSom.train_batch_offline, default",
])
def test_against_minisom(benchmark, how):
    raw = samples(1)
    distinct, counts = np.unique(raw, axis=0, return_counts=True)
    decay = "linear_decay_to_one" if how.endswith("to one") else "asymptotic_decay"
    run, arguments = {
        "ours, distinct grams": (ours, (distinct, counts)),
        "ours, every gram": (ours, (raw, np.ones(len(raw), dtype=np.int64))),
    }.get(how, (trained, (raw, decay, "offline" in how)))
    rounds = 1 if how.startswith("MiniSom") else 10
    ours(distinct[:10], counts[:10])
    weights = benchmark.pedantic(run, args=arguments, rounds=rounds)
    benchmark.extra_info.update(
        units=len(raw), unit="grams", distinct=len(distinct), quantisation_error=error(weights, distinct, counts)
    )


@pytest.mark.benchmark(group="train a 3 × 3 map on the 4-grams of many matches, 20 epochs")
@pytest.mark.parametrize(("matches", "which"), [
    pytest.param(matches, which, id=f"ours, {which}, matches: {matches}")
    for which, most in (("distinct grams", (1, 10, 100)), ("every gram", (1, 10))) for matches in most
])
def test_of_many(timed, matches, which):
    raw = samples(matches)
    codes, counts = np.unique(raw, axis=0, return_counts=True) if which == "distinct grams" else (raw, np.ones(len(raw), np.int64))
    ours(codes[:10], counts[:10])
    timed(len(raw), "grams", ours, (codes, counts), rounds=5)
