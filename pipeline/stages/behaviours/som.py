"""The self-organising map of grams (paper section 3.2.2); the door to MiniSom.

The map receives the paper's codes unscaled. Table 1 numbers the situations so that members of a family
are 1 to 3 apart and families 10 or more, so the codes are a metric. A common scale factor would change
nothing: the batch rule has no learning rate, so weights would scale with it, and best-matching units
would stay.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from minisom import MiniSom

from pitchlore.pipeline.numbers.arrays import F64, I16, I64
from pitchlore.pipeline.numbers.kernels import njit

Label = TypeVar("Label", bound=tuple[str, ...])


@dataclass(frozen=True, slots=True, eq=False)
class SelfOrganisingMap:
    """A trained map. Neuron k lies in row ``k // columns`` and column ``k % columns``.

    Attributes:
        grid: the MiniSom that holds the weights.
        quantisation_error: mean distance of the samples to their best-matching unit.
        topographic_error: share of the samples whose best and second best units do not touch.
    """

    grid: MiniSom
    quantisation_error: float
    topographic_error: float

    @property
    def weights(self) -> F64:
        """The MiniSom's own weights, a prototype gram each, float64 [rows * columns, n]."""
        held = self.grid.get_weights()  # type: ignore[no-untyped-call]
        prototypes: F64 = held.reshape(-1, held.shape[2])
        return prototypes

    @property
    def rows(self) -> int:
        """Number of rows of the grid."""
        return len(self.grid.get_weights())  # type: ignore[no-untyped-call]

    @property
    def columns(self) -> int:
        """Number of columns of the grid."""
        return len(self.weights) // self.rows


def map_of(weights: F64, errors: tuple[float, float] = (0.0, 0.0)) -> SelfOrganisingMap:
    """A map of weights, float64 [rows, columns, n], with its two errors."""
    rows, columns, length = weights.shape
    grid = MiniSom(rows, columns, length, random_seed=0)  # type: ignore[no-untyped-call]
    grid.get_weights()[:] = weights  # type: ignore[no-untyped-call]
    return SelfOrganisingMap(grid, *errors)


def train_map(
    codes: I16, counts: I64, rows: int, columns: int, *,
    epochs: int, seed: int, sigma_end: float,
) -> SelfOrganisingMap:
    """Train a map with Kohonen's batch rule, each distinct gram weighted by its count.

    The result equals that of training on every single sample; the cost grows with the distinct grams
    only. It depends neither on the order of the rows nor on a split of a gram's count over rows. The
    neighbourhood is MiniSom's Gaussian; sigma falls geometrically from half the longer side to
    ``sigma_end``. Rule: Kohonen, Essentials of the self-organizing map (2013), equation 8.

    Args:
        codes: [D, n], D at least 1, n 1 to 4; none is negative.
        counts: int64 [D], at least 1 each.
        rows: number of rows of the grid.
        columns: number of columns of the grid.
        epochs: passes over the distinct grams.
        seed: seed of the first weights, which are drawn from the samples.
        sigma_end: spread of the last neighbourhood in neurons; with small values the rule approaches
            k-means.
    """
    # sorted as one number each, a fifth of the time of rows
    wide = np.zeros((len(codes), 4), dtype=">i2")
    wide[:, 4 - codes.shape[1]:] = codes
    number = wide.view(">i8").ravel().astype(np.int64)
    _, row, which = np.unique(number, return_index=True, return_inverse=True)
    samples = codes[row].astype(np.float64)
    weight: F64 = np.zeros(len(samples))
    np.add.at(weight, which.ravel(), counts)
    som = map_of(_first_weights(samples, weight, rows * columns, seed).reshape(rows, columns, -1))
    neurons = som.weights
    sigma_start = max(rows, columns, 2 * sigma_end) / 2
    for epoch in range(epochs):
        sigma = sigma_start * (sigma_end / sigma_start) ** (epoch / max(epochs - 1, 1))
        near = np.stack([
            som.grid.neighborhood(at, sigma).ravel() for at in np.ndindex(rows, columns)])  # type: ignore[no-untyped-call]
        best, count = _nearest(samples, neurons)[0], len(neurons)
        sums = np.stack([np.bincount(best, weight * column, count) for column in samples.T], axis=1)
        _move(neurons, near, sums.astype(np.float64), np.bincount(best, weight, count).astype(np.float64))
    first, second, distance = _nearest(samples, neurons)
    gap = np.maximum(abs(first // columns - second // columns), abs(first % columns - second % columns))
    return SelfOrganisingMap(
        som.grid,
        quantisation_error=float((weight * distance).sum() / weight.sum()),
        topographic_error=float((weight * (gap > 1)).sum() / weight.sum()),
    )


def best_matching_units(som: SelfOrganisingMap, codes: I16) -> I64:
    """The neuron nearest to each gram [D, n], the lowest on a tie; int64 [D]."""
    return _nearest(np.ascontiguousarray(codes, dtype=np.float64), som.weights)[0]


def maps_to_bytes(maps: Mapping[Label, SelfOrganisingMap]) -> bytes:
    """The maps of grams of length n as an .npz file; the same maps give the same bytes.

    ``labels`` are bytes of JSON, a list for each map that tells it apart (team and league). For map m,
    ``weights_m`` are [rows, columns, n], ``errors_m`` the quantisation error and the topographic error.
    """
    labels = np.frombuffer(json.dumps(list(maps)).encode(), dtype=np.uint8)
    arrays: dict[str, npt.NDArray[np.generic]] = {"labels": labels}
    for m, som in enumerate(maps.values()):
        arrays[f"weights_{m}"] = som.weights.reshape(som.rows, som.columns, -1)
        arrays[f"errors_{m}"] = np.array([som.quantisation_error, som.topographic_error])
    out = io.BytesIO()
    np.savez(out, allow_pickle=False, **arrays)
    return out.getvalue()


def _first_weights(samples: F64, weight: F64, neurons: int, seed: int) -> F64:
    """Samples drawn in proportion to their weight, distinct ones while there are enough."""
    rng = np.random.default_rng(seed)
    drawn = rng.choice(
        len(samples), size=neurons, replace=len(samples) < neurons, p=weight / weight.sum()
    )
    return samples[drawn]


@njit(cache=True, nogil=True)
def _move(neurons: F64, near: F64, sums: F64, hits: F64) -> None:
    """Put each neuron [K, n] in place at the mean of the samples near it, by ``near`` [best, neuron].

    Plain loops, because the last bits of a BLAS product differ between processors.
    """
    for k in range(len(neurons)):
        reached = 0.0
        for best in range(len(neurons)):
            reached += near[best, k] * hits[best]
        if reached > 0:
            for i in range(neurons.shape[1]):
                total = 0.0
                for best in range(len(neurons)):
                    total += near[best, k] * sums[best, i]
                neurons[k, i] = total / reached


@njit(cache=True, nogil=True)
def _nearest(samples: F64, neurons: F64) -> tuple[I64, I64, F64]:
    """Best and second best unit of each sample, int64 [D], and the distance to the best, [D]."""
    first = np.zeros(len(samples), dtype=np.int64)
    second = np.zeros(len(samples), dtype=np.int64)
    distance = np.empty(len(samples))
    for d in range(len(samples)):
        least, next_least = np.inf, np.inf
        for k in range(len(neurons)):
            square = 0.0
            for i in range(samples.shape[1]):
                step = samples[d, i] - neurons[k, i]
                square += step * step
            if square < least:
                second[d], next_least = first[d], least
                first[d], least = k, square
            elif square < next_least:
                second[d], next_least = k, square
        distance[d] = np.sqrt(least)
    return first, second, distance
