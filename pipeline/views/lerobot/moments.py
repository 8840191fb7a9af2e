"""Statistics of columns, by which LeRobot normalises: of an episode, and of all."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.numbers.arrays import F64

#: Quantiles by their names.
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
#: Statistics of one column by name, each [n]; ``count`` [1].
Statistics = dict[str, F64]


def of_column(column: npt.NDArray[Any]) -> Statistics | None:
    """Statistics of a column [T, n] over its rows; rows with NaN are left out. None if no row is left."""
    rows = column.astype(np.float64)
    rows = rows[~np.isnan(rows).any(axis=1)]
    if not len(rows):
        return None
    return {
        "min": rows.min(axis=0), "max": rows.max(axis=0), "mean": rows.mean(axis=0), "std": rows.std(axis=0),
        "count": np.array([float(len(rows))]),
        **dict(zip(QUANTILES, np.quantile(rows, list(QUANTILES.values()), axis=0), strict=True)),
    }


class RunningStatistics:
    """Statistics of all episodes so far.

    Least, greatest, mean and standard deviation are those of all frames together. A quantile is the mean of
    the episodes' quantiles, weighted by frames, as LeRobot itself joins them.
    """

    def __init__(self) -> None:
        self._found: dict[str, Statistics] = {}

    def add(self, columns: Mapping[str, npt.NDArray[Any]]) -> dict[str, Statistics]:
        """Count an episode's columns, each [T, n]. Returns their own statistics."""
        own = {name: found for name, column in columns.items() if (found := of_column(column)) is not None}
        for name, found in own.items():
            self._found[name] = _joined(self._found[name], found) if name in self._found else found
        return own

    def as_json(self) -> dict[str, dict[str, list[float]]]:
        """Content of the file ``meta/stats.json``."""
        return {name: as_lists(found) for name, found in self._found.items()}


def as_lists(found: Statistics) -> dict[str, list[float]]:
    """Statistics as lists; the count is whole."""
    return {name: [int(value[0])] if name == "count" else value.tolist() for name, value in found.items()}


def _joined(one: Statistics, two: Statistics) -> Statistics:
    """Statistics of both together."""
    count = one["count"] + two["count"]
    share = two["count"] / count
    apart = two["mean"] - one["mean"]
    variance = (1 - share) * one["std"]**2 + share * two["std"]**2 + share * (1 - share) * apart**2
    return {
        "min": np.minimum(one["min"], two["min"]), "max": np.maximum(one["max"], two["max"]),
        "mean": one["mean"] + share * apart, "std": np.sqrt(variance), "count": count,
        **{name: one[name] + share * (two[name] - one[name]) for name in QUANTILES},
    }
