"""Boosted trees as arrays: what a version of the models keeps of scikit-learn's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import F32, F64, I32, Bools
from pitchlore.pipeline.numbers.kernels import njit


class Trees(NamedTuple):
    """Trees one after another; node i is a leaf if ``left[i]`` is -1.

    Attributes:
        start: int32 [trees], the root of each.
        feature: int32 [nodes], the feature that a node splits by.
        threshold: float64 [nodes]; a value at most this goes left.
        missing_left: bool [nodes], whether NaN goes left.
        left, right: int32 [nodes], children.
        value: float64 [nodes], what a leaf adds to the logit, or to the value.
        base: float64 [1], the logit or value before any tree.
    """

    start: I32
    feature: I32
    threshold: F64
    missing_left: Bools
    left: I32
    right: I32
    value: F64
    base: F64


def arrays_of(model: Any, output: int = 0) -> Trees:
    """The trees of one output of scikit-learn's histogram boosting, as arrays.

    They have no public form; a test compares these arrays with the model's own predictions.
    """
    nodes = [stage[output].nodes for stage in model._predictors]
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
        base=np.asarray(model._baseline_prediction, dtype=np.float64).reshape(-1)[output:output + 1],
    )


def without_trees(value: float) -> Trees:
    """No tree, only a base."""
    none = np.empty(0, dtype=np.int32)
    number = none.astype(np.float64)
    return Trees(none, none, number, none.astype(bool), none, none, number, np.array([value]))


def rows_of(trees: Trees, names: Sequence[str], version: int, code: int) -> pl.DataFrame:
    """The columns of schema Appraisals: the base as a tree of a leaf, then the trees.

    Args:
        trees: they split by features.
        names: names of the features.
        version: the same in all rows.
        code: likewise.
    """
    sizes = np.diff(trees.start, append=len(trees.left))
    first, inner = np.repeat(trees.start, sizes), pl.Series(trees.left >= 0)
    split = {
        "feature": np.array([*names, ""])[trees.feature], "threshold": trees.threshold,
        "missing_left": trees.missing_left, "left": trees.left - first, "right": trees.right - first}
    nodes = pl.DataFrame({
        "tree": np.repeat(np.arange(1, len(sizes) + 1), sizes), "node": np.arange(len(first)) - first,
        **split, "value": trees.value,
    }).with_columns(
        *(pl.when(inner).then(name) for name in split), value=pl.when(inner).then(0.0).otherwise("value"))
    base = pl.DataFrame({"tree": 0, "node": 0, **dict.fromkeys(split), "value": trees.base})
    return pl.concat([base, nodes], how="vertical_relaxed").select(
        pl.lit(version).alias("version"), pl.lit(code).alias("code"), "*")


def trees_of(rows: pl.DataFrame) -> Trees:
    """The trees of rows of schema Appraisals, in their order; their base is 0: bases are leaves, too."""
    start = np.flatnonzero((rows["node"] == 0).to_numpy()).astype(np.int32)
    offset = np.repeat(start, np.diff(np.append(start, rows.height)))

    def child(name: str) -> I32:
        own = rows[name].fill_null(-1).to_numpy()
        return np.where(own < 0, -1, own + offset).astype(np.int32)

    return Trees(
        start, rows["feature"].to_physical().fill_null(0).to_numpy().astype(np.int32),
        rows["threshold"].fill_null(0.0).to_numpy().astype(np.float64),
        rows["missing_left"].fill_null(value=False).to_numpy().astype(np.bool_),
        child("left"), child("right"), rows["value"].to_numpy().astype(np.float64), np.zeros(1),
    )


@njit(cache=True, nogil=True)
def leaf(trees: Trees, root: int, features: F32) -> float:
    """Sum that one tree adds for features float32 [F], NaN where unknown."""
    node = root
    while trees.left[node] >= 0:
        x = features[trees.feature[node]]
        goes_left = trees.missing_left[node] if np.isnan(x) else x <= trees.threshold[node]
        node = trees.left[node] if goes_left else trees.right[node]
    return float(trees.value[node])


@njit(cache=True, nogil=True)
def logits(trees: Trees, features: F32) -> F64:
    """Logit of each moment, float64 [T]; features float32 [T, F], NaN where unknown."""
    out = np.full(len(features), trees.base[0])
    for root in trees.start:  # tree by tree: one tree's nodes stay in the fastest cache
        for k in range(len(features)):
            out[k] += leaf(trees, root, features[k])
    return out
