"""V: features of moments, the fit of a league's models, and trees beside scikit-learn's own prediction."""

from functools import cache

import numpy as np
import polars as pl
import pytest
from sklearn.ensemble import HistGradientBoostingClassifier
from support.recordings import RSIM, bodies_of, imported
from threadpoolctl import threadpool_limits

from pitchlore.pipeline.numbers import trees
from pitchlore.pipeline.settings import ModelSettings, MomentSettings
from pitchlore.pipeline.stages.values.fitting import fit, grow
from pitchlore.pipeline.stages.values.moments import moments

ASKED = 100_000
SETTINGS = ModelSettings()


@cache
def looked():
    """Bodies, referee and pitch of the sample, and its moments."""
    log = imported(RSIM)
    bodies = bodies_of(RSIM)
    return bodies, log.referee, log.info.pitch, moments(bodies, log.referee, log.info.pitch, MomentSettings())


@cache
def table():
    """Features and outcomes of the sample's moments, often enough."""
    known = looked()[3].filter(pl.col("scores").is_not_null())
    often = -(-ASKED // known.height)
    features = known["features"].to_numpy().astype(np.float32)
    return np.tile(features, (often, 1))[:ASKED], np.tile(known["scores"].to_numpy(), often)[:ASKED]


@pytest.mark.benchmark(group="look at moments of play")
def test_moments_ours(timed):
    bodies, referee, pitch, found = looked()
    timed(found.height, "moments", moments, (bodies, referee, pitch, MomentSettings()), rounds=5)


@pytest.mark.benchmark(group="fit the models of V to 16 matches of ten minutes, cross-fitted")
def test_fit_ours(benchmark):
    found = looked()[3]
    every = pl.concat(found.with_columns(match_id=pl.lit(f"m{i}")) for i in range(16))
    _, report = benchmark.pedantic(fit, (every, SETTINGS), rounds=1)
    assert {"boosting", "logistic"} <= report.keys()


@pytest.mark.benchmark(group="ask boosted trees, one thread")
def test_trees_ours(timed):
    features, scores = table()
    grown = grow(features[:20_000], scores[:20_000], SETTINGS)
    trees.logits(grown, features[:10])
    timed(ASKED, "moments", trees.logits, (grown, features), rounds=5)


@pytest.mark.benchmark(group="ask boosted trees, one thread")
def test_trees_scikit_learn(timed):
    features, scores = table()
    builder = HistGradientBoostingClassifier(
        max_iter=SETTINGS.trees, learning_rate=SETTINGS.learning_rate, max_leaf_nodes=SETTINGS.leaves,
        min_samples_leaf=SETTINGS.leaf_samples, l2_regularization=SETTINGS.tree_penalty / SETTINGS.evidence,
        early_stopping=False, random_state=SETTINGS.seed,
    )
    with threadpool_limits(1):
        model = builder.fit(features[:20_000], scores[:20_000])
        theirs = timed(ASKED, "moments", model.decision_function, (features,), rounds=5)
    grown = grow(features[:20_000], scores[:20_000], SETTINGS)
    np.testing.assert_allclose(trees.logits(grown, features), theirs, atol=1e-9)
