"""Boosted trees as arrays: what a version of the models keeps of scikit-learn's."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier
from threadpoolctl import threadpool_limits

from pipeline.arrays import F32, F64, I32, Bools
from pipeline.settings import ModelSettings


class Trees(NamedTuple):
    """Trees one after another; node i is a leaf if ``left[i]`` is -1.

    Attributes:
        start: int32 [trees], the root of each.
        feature: int32 [nodes], the feature that a node splits by.
        threshold: float64 [nodes]; a value at most this goes left.
        missing_left: bool [nodes], whether NaN goes left.
        left, right: int32 [nodes], children.
        value: float64 [nodes], what a leaf adds to the logit.
        base: float64 [1], the logit before any tree.
    """

    start: I32
    feature: I32
    threshold: F64
    missing_left: Bools
    left: I32
    right: I32
    value: F64
    base: F64


def grow(features: F32, scores: Bools, settings: ModelSettings) -> Trees:
    """Boosted trees for the probability to score (Friedman 2001; scikit-learn's histogram boosting).

    Args:
        features: float32 [T, F], NaN where unknown.
        scores: bool [T]; both values must occur.
        settings: evidence of a moment, number, size and regularisation of the trees, and the seed of the
            bins.
    """
    # weights that are all the same only divide the penalty, and with weights the bins take four times as long
    penalty = settings.tree_penalty / settings.evidence
    builder = HistGradientBoostingClassifier(  # type: ignore[no-untyped-call]
        max_iter=settings.trees, learning_rate=settings.learning_rate, max_leaf_nodes=settings.leaves,
        min_samples_leaf=settings.leaf_samples, l2_regularization=penalty,
        early_stopping=False, random_state=settings.seed,
    )
    # its threads wait for each other longer than they work on a few thousand moments
    with threadpool_limits(1):  # type: ignore[no-untyped-call]
        model = builder.fit(features, scores)
    # the fitted trees have no public form; the test compares these arrays with the model's own predictions
    nodes = [stage[0].nodes for stage in model._predictors]
    start = np.cumsum([0, *(len(tree) for tree in nodes)])
    joined = np.concatenate(nodes)
    offset = np.repeat(start[:-1], [len(tree) for tree in nodes])
    leaf = joined["is_leaf"].astype(bool)
    return Trees(
        start=start[:-1].astype(np.int32),
        feature=joined["feature_idx"].astype(np.int32),
        threshold=joined["num_threshold"].astype(np.float64),
        missing_left=joined["missing_go_to_left"].astype(bool),
        left=np.where(leaf, -1, joined["left"] + offset).astype(np.int32),
        right=np.where(leaf, -1, joined["right"] + offset).astype(np.int32),
        value=joined["value"].astype(np.float64),
        base=np.asarray(model._baseline_prediction, dtype=np.float64).reshape(1),
    )


@numba.njit(cache=True, nogil=True)
def logits(trees: Trees, features: F32) -> F64:
    """Logit of each moment, float64 [T]; features as for :func:`grow`."""
    out = np.empty(len(features))
    for k in range(len(features)):
        total = trees.base[0]
        for root in trees.start:
            node = root
            while trees.left[node] >= 0:
                x = features[k, trees.feature[node]]
                goes_left = trees.missing_left[node] if np.isnan(x) else x <= trees.threshold[node]
                node = trees.left[node] if goes_left else trees.right[node]
            total += trees.value[node]
        out[k] = total
    return out
