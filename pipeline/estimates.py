"""Estimates of values: a mean and its family's, each weighed by its precision."""

from __future__ import annotations

import polars as pl

#: Standard deviations of a normal distribution on either side of which 5 % lie in all.
_Z = 1.959964
#: Least variance, so that precisions are finite.
_LEAST = 1e-12


def estimated(table: pl.DataFrame) -> pl.DataFrame:
    """Add value, low and high: the estimate of a value, and its 95 % interval.

    The value is the mean of ``mean`` and ``family``, weighed by the precisions of ``error`` and
    ``family_spread`` (empirical Bayes; Efron and Morris 1973, "Stein's estimation rule and its
    competitors"). Without a family it is ``mean``. The interval is null without an error.

    Args:
        table: float64 columns mean, error, family and family_spread; the last three may be null.
    """
    precision = 1 / pl.max_horizontal(pl.col("error") ** 2, _LEAST)
    prior = (1 / pl.max_horizontal(pl.col("family_spread") ** 2, _LEAST)).fill_null(0.0)
    shrunk = (pl.col("mean") * precision + pl.col("family").fill_null(0.0) * prior) / (precision + prior)
    value = pl.when(pl.col("error").is_null()).then("mean").otherwise(shrunk)
    half = pl.when(pl.col("error").is_not_null()).then(_Z / (precision + prior).sqrt())
    return table.with_columns(value=value, low=value - half, high=value + half)
