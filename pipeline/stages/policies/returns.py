"""Returns of state-behaviour pairs, episode by episode: what evidence there is of a value, and its spread."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import F64, I8, I64
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.stages.policies.sarsa import CONTINUES, TERMINAL, UNKNOWN


@njit(cache=True, nogil=True)
def _backwards(discounts: F64, reward: F64, ends: I8, out: F64) -> None:
    following = np.nan
    for t in range(len(reward) - 1, -1, -1):
        if ends[t] != CONTINUES:
            following = 0.0 if ends[t] == TERMINAL else np.nan
        following = discounts[t] * (reward[t] + following)
        out[t] = following


def returns(elapsed: F64, reward: F64, ends: I8, discount: float) -> F64:
    """Return of each decision, float64 [T]: discounted rewards until its episode's end; NaN if it was cut.

    Args:
        elapsed: float64 [T], seconds until the next decision or the episode's end.
        reward: float64 [T], received when ``elapsed`` is over.
        ends: int8 [T], as in :class:`pipeline.stages.policies.sarsa.Transitions`.
        discount: gamma per second.
    """
    out = np.empty(len(reward))
    _backwards(np.power(discount, elapsed), reward.astype(np.float64), ends.astype(np.int8), out)
    return out


def by_pair(pair: I64, episode: I64, found: F64) -> pl.DataFrame:
    """Episodes, mean return and its spread of each pair that was seen.

    Args:
        pair: int64 [T], index of each decision's pair, or UNKNOWN.
        episode: int64 [T], equal for decisions that share their outcome.
        found: float64 [T], returns, NaN where unknown.

    Returns:
        Columns pair, episodes, mean and spread (null for one episode), sorted by pair.
    """
    seen = pl.DataFrame({"pair": pair, "episode": episode, "found": found}).filter(
        pl.col("pair") != UNKNOWN, pl.col("found").is_not_nan())
    each = seen.group_by("pair", "episode", maintain_order=True).agg(pl.col("found").mean())
    return each.sort("pair", "episode").group_by("pair", maintain_order=True).agg(
        episodes=pl.len().cast(pl.Int64), mean=pl.col("found").mean(), spread=pl.col("found").std())


def together(parts: pl.DataFrame, by: list[str]) -> pl.DataFrame:
    """Counts, means and spreads of samples put together, as if each had been one sample.

    Args:
        parts: columns ``by``, episodes, mean, spread; several rows of one group have no episode in common.
        by: the columns of a group.

    Returns:
        The same columns, a row a group, sorted by ``by``.
    """
    n, mean = pl.col("episodes"), pl.col("mean")
    # each sum of squares about the common mean: that about its own, and its mean's distance
    squares = (pl.col("spread").fill_null(0.0) ** 2 * (n - 1) + n * (mean - pl.col("common")) ** 2).sum()
    return (
        parts.with_columns(common=((n * mean).sum() / n.sum()).over(by))
        .group_by(by, maintain_order=True).agg(
            episodes=n.sum(), mean=pl.col("common").first(),
            spread=pl.when(n.sum() > 1).then((squares / (n.sum() - 1)).sqrt()))
        .sort(by))
