"""Values of grams with their errors, shrunk towards their families by empirical Bayes.

Most grams are seen a few times, and of many rare ones some are lucky, so the estimate leans on the family
(:mod:`pipeline.numbers.estimates`). The spread of the true values in a family is estimated by the method of
moments (DerSimonian and Laird 1986).
"""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.estimates import estimated
from pitchlore.schemas import ROLES

#: Number of instances that the variance in the family counts for, beside a gram's own.
_FAMILY = 10
#: Codes of one family of table 1 follow each other; the families are further apart.
_APART = 5
#: The columns that variances are computed from.
_COUNTED = ("count", "value_square_sum", "match_square_sum", "match_product_sum", "match_count_square_sum")


def valued(grams: pl.DataFrame, *, shrink: bool) -> pl.DataFrame:
    """Add each gram's estimated value and its interval.

    The variance of an instance is the gram's own and its family's, the latter weighed like ``_FAMILY``
    instances. It is multiplied by how much more the sums of whole matches differ than they would if their
    instances were independent, at least 1.

    Args:
        grams: columns of ``pipeline.stages.behaviours.grams.merge``, all of one length.
        shrink: whether values are shrunk; else ``value`` is the mean.

    Returns:
        The grams with columns mean, error, family, family_spread, family_size, value, low and high, as in
        schema Patterns.
    """
    if grams.is_empty():
        return grams.with_columns(
            pl.lit(None, dtype=pl.Float64).alias(name)
            for name in ("mean", "error", "family", "family_spread", "family_size", "value", "low", "high"))
    count, total = (grams[name].to_numpy().astype(np.float64) for name in ("count", "value_sum"))
    mean = total / count
    columns = {name: np.empty(len(count)) for name in ("error", "family", "family_spread", "family_size")}
    numbers = grams.select(_COUNTED)  # rows of its lists take long to pick
    for rows in _families(grams):
        error = np.sqrt(_variances(numbers[rows], mean[rows]) / count[rows])
        columns["error"][rows] = error
        columns["family"][rows], columns["family_spread"][rows] = _between(mean[rows], error)
        columns["family_size"][rows] = len(rows)
    known = pl.DataFrame({"mean": mean, **columns})
    if not shrink:
        nothing = pl.lit(None, dtype=pl.Float64)
        known = known.with_columns(family=nothing, family_spread=nothing, family_size=nothing)
    return estimated(grams.hstack(known))


def _families(grams: pl.DataFrame) -> list[I64]:
    """The rows of each family: the same role, and last codes of the same family of table 1."""
    last = grams["codes"].list.last().to_numpy()
    codes = np.unique(last)
    family = np.cumsum(np.diff(codes, prepend=codes[:1]) >= _APART)[np.searchsorted(codes, last)]
    role = grams["role"].cast(pl.Enum(ROLES)).to_physical().to_numpy().astype(np.int64)
    key = role * (len(codes) + 1) + family
    return [np.flatnonzero(key == each) for each in np.unique(key)]


def _variances(grams: pl.DataFrame, mean: F64) -> F64:
    """Variance of an instance of each gram of a family around its gram's mean, float64 [G]."""
    count = grams["count"].to_numpy().astype(np.float64)
    within = np.maximum(grams["value_square_sum"].to_numpy() - count * mean**2, 0.0)
    pooled = within.sum() / max(count.sum() - len(count), 1.0)
    # squares of what whole matches deviate by, which would be count * variance on average
    squares = grams["match_square_sum"].to_numpy() - 2 * mean * grams["match_product_sum"].to_numpy()
    squares += mean**2 * grams["match_count_square_sum"].to_numpy()
    often = count >= 2
    together = squares[often].sum() / max(count[often].sum() * pooled, 1e-12)
    found: F64 = (within + _FAMILY * pooled) / (count - 1 + _FAMILY) * max(together, 1.0)
    return found


def _between(mean: F64, error: F64) -> tuple[float, float]:
    """Mean of the family, and the standard deviation of the true values in it."""
    weight = 1 / np.maximum(error**2, 1e-12)
    centre = float((weight * mean).sum() / weight.sum())
    excess = (weight * (mean - centre) ** 2).sum() - (len(mean) - 1)
    spread = excess / max(weight.sum() - (weight**2).sum() / weight.sum(), 1e-12) if len(mean) > 1 else 0.0
    return centre, float(np.sqrt(max(spread, 0.0)))
