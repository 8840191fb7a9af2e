"""Typical grams of a team: those that it shows more often than the other teams of its league."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.numbers.statistics import Z


def typical(own: pl.DataFrame, others: pl.DataFrame, support_at_least: int) -> pl.DataFrame:
    """How many times as often a team shows each of its grams as the others do.

    The share of a gram is its count over those of all listed grams of its role and length. Of another team
    that does not list it, ``support_at_least - 1`` instances are counted, the most that there can be, so that
    a gram nobody else shows is not made too much of. The interval is that of a ratio of two Poisson counts
    (on the scale of logarithms), as if instances were independent.

    Args:
        own: rows of schema Grams of the team.
        others: rows of the other teams of its league.
        support_at_least: least count of a listed gram.

    Returns:
        Columns role, codes, times and at_least (the lower end of the 95 % interval of times), a row a gram of
        own; none without other teams.
    """
    keys = ["n", "role", "codes"]
    own = own.with_columns(share=pl.col("count") / pl.col("count").sum().over("n", "role"))
    teams = others["team"].n_unique()
    totals = others.group_by("n", "role").agg(total=pl.col("count").sum())
    shown = others.group_by(keys).agg(elsewhere=pl.col("count").sum(), listed=pl.len())
    unseen = (teams - pl.col("listed").fill_null(0)) * (support_at_least - 1)
    both = (
        own.join(totals, on=["n", "role"]).join(shown, on=keys, how="left")
        .with_columns(elsewhere=pl.max_horizontal(pl.col("elsewhere").fill_null(0) + unseen, 1))
        .with_columns(times=pl.col("share") * pl.col("total") / pl.col("elsewhere"))
        .with_columns(at_least=pl.col("times") * (
            -Z * (1 / pl.col("count") + 1 / pl.col("elsewhere")).sqrt()).exp())
    )
    return both.select("role", "codes", "times", "at_least").sort("role", "codes")
