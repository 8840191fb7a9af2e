"""The neurons of a trained map as a table."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.pipeline.stages.behaviours.som import SelfOrganisingMap
from pitchlore.schemas import Neurons


def neurons(som: SelfOrganisingMap, neuron: I64, grams: pl.DataFrame, kept: Bools) -> pl.DataFrame:
    """One row a neuron of a map, in order.

    Args:
        som: the map, of K neurons.
        neuron: best-matching unit of each gram, int64 [D].
        grams: columns count and value_sum of the distinct grams [D], of one length.
        kept: bool [K], the neurons whose grams may be behaviours.

    Returns:
        Rows of schema Neurons, team and kind null.
    """
    size, n = som.weights.shape
    count, distinct = (np.bincount(neuron, each, size) for each in (grams["count"].to_numpy(), None))
    total = np.bincount(neuron, grams["value_sum"].to_numpy(), size)
    gap = pl.Series(distances(som)).fill_nan(None)
    return pl.DataFrame({
        "neuron": np.arange(size), "grid_row": np.arange(size) // som.columns,
        "grid_column": np.arange(size) % som.columns, "prototype": som.weights.tolist(),
        "grams": distinct, "count": count, "kept": kept, "distance": gap,
        "value": pl.Series(total / np.maximum(count, 1)).set(pl.Series(count == 0), None),
    }).with_columns(
        n=pl.lit(n), quantisation_error=som.quantisation_error, topographic_error=som.topographic_error,
        team=pl.lit(None), kind=pl.lit(None),
    ).select(list(Neurons.dtypes())).cast(pl.Schema(Neurons.dtypes()))


def distances(som: SelfOrganisingMap) -> F64:
    """Mean distance of each neuron's weights to those of the neurons that touch it, corners too, [K].

    NaN in a map of one neuron. Source: Ultsch, Self-organizing neural networks for visualisation and
    classification (1993). MiniSom's ``distance_map`` divides it by its greatest, and so compares no maps.
    """
    place = np.stack(np.divmod(np.arange(len(som.weights)), som.columns), axis=1)
    touch = np.abs(place[:, None] - place).max(axis=2) == 1
    apart = np.sqrt(((som.weights[:, None] - som.weights) ** 2).sum(axis=2))
    count = touch.sum(axis=1)
    found: F64 = np.where(count > 0, (apart * touch).sum(axis=1) / np.maximum(count, 1), np.nan)
    return found
