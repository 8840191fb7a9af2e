"""Estimates of values that lean on their families."""

from __future__ import annotations

import polars as pl

#: Standard deviations of a normal distribution on either side of which 5 % lie in all.
_Z = 1.959964
#: Least variance, so that quotients are finite.
_LEAST = 1e-12

#: Greatest expected share of false ones among values that are called sure.
FALSE_AT_MOST = 0.05


def estimated(table: pl.DataFrame) -> pl.DataFrame:
    """Add value, low and high: the estimate of a value, and its 95 % interval.

    The estimate lies between ``mean`` and ``family``, by the share of the variance that is error; its
    variance has a part for what is not known of the family (parametric empirical Bayes: Morris 1983,
    "Parametric empirical Bayes inference: theory and applications", JASA 78). Without a family, or in one
    of three or fewer, it is ``mean``. The interval is null without an error.

    Args:
        table: columns mean, error, family, family_spread and family_size; all but the first may be null.
    """
    size = pl.col("family_size").fill_null(0)
    variance = pl.max_horizontal(pl.col("error") ** 2, _LEAST)
    between = (pl.col("family_spread") ** 2).fill_null(0.0)
    share = pl.when(size > 3).then((size - 3) / (size - 1) * variance / (variance + between)).otherwise(0.0)
    away = pl.col("mean") - pl.col("family").fill_null(pl.col("mean"))
    rest = variance * (1 - (size - 1) / size.clip(lower_bound=1) * share)
    widened = pl.when(size > 3).then(2 / (size - 3) * share**2 * away**2).otherwise(0.0)
    value = pl.when(pl.col("error").is_null()).then("mean").otherwise(pl.col("mean") - share * away)
    half = pl.when(pl.col("error").is_not_null()).then(_Z * (rest + widened).sqrt())
    return table.with_columns(value=value, low=value - half, high=value + half)


def sides_of_zero() -> pl.Expr:
    """Column pays of schema Behaviours, from its columns q, low and high."""
    sure = pl.col("q") <= FALSE_AT_MOST
    return pl.when(pl.col("q").is_null() | (sure & (pl.col("low") > 0))).then(pl.lit("+")).when(
        sure & (pl.col("high") < 0)).then(pl.lit("-")).otherwise(pl.lit("?"))
