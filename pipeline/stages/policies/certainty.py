"""How sure a policy is: the returns of its pairs, and the choice in each of its states."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.statistics import welch_of
from pitchlore.pipeline.stages.policies.batch import PAIR, DecisionBatch
from pitchlore.pipeline.stages.policies.returns import by_pair, returns, together
from pitchlore.schemas import Returns, States
from pitchlore.schemas.policies import FEW

_STATE = ["role", "key", "state"]


def returns_of(
    policy: pl.DataFrame, batch: DecisionBatch, parent: pl.DataFrame | None, discount: float
) -> pl.DataFrame:
    """Rows of schema Returns: what came of the pairs of a policy.

    Args:
        policy: rows of schema Policies, of one version.
        batch: the decisions that the version learned from, with the pairs of ``policy``.
        parent: rows of schema Returns of the parent, whose decisions are others; None without one.
        discount: gamma per second.
    """
    rows = batch.rows
    elapsed, reward, ends = (rows[name].to_numpy() for name in ("elapsed", "reward", "ends"))
    found = returns(elapsed, reward, ends, discount)
    # chosen and seen decisions of one team in one episode share their outcome
    episode = rows["team_episode"].to_numpy() // 2
    counted = ("episodes", "mean", "spread")
    parts = [(Returns.empty() if parent is None else parent).select(*PAIR, *counted)]
    for key in policy["key"].unique().sort():
        own = policy.filter(pl.col("key") == key)
        each = by_pair(batch.pairs[key], episode, found)
        parts.append(own.select(PAIR)[each["pair"]].with_columns(each.select(counted)))
    schema = pl.Schema(Returns.dtypes())
    return (
        together(pl.concat(parts), PAIR)
        .join(policy.select(*PAIR, "version"), on=PAIR, how="inner", maintain_order="left")
        .select(list(schema)).cast(schema))


def states_of(policy: pl.DataFrame, returned: pl.DataFrame) -> pl.DataFrame:
    """Rows of schema States: the choice in each state of a policy.

    Args:
        policy: rows of schema Policies, of one version.
        returned: rows of schema Returns of the same version.
    """
    ranked = (
        policy.join(returned.select(*PAIR, "episodes", "mean", "spread"), on=PAIR, how="left")
        .with_columns(pl.col("episodes").fill_null(0))
        .sort(*_STATE, "q", "episodes", "behaviour_id",
              descending=[False, False, False, True, True, False])
        .group_by(_STATE, maintain_order=True)
        .agg(
            pl.col("version").first(), behaviours=pl.len(), visits=pl.col("visits").sum(),
            **{f"{name}_{place}": pl.col(name).get(place, null_on_oob=True)
               for name in ("behaviour_id", "q", "episodes", "mean", "spread") for place in (0, 1)})
    )
    n, mean, spread = (
        np.stack([ranked[f"{name}_{place}"].cast(pl.Float64).fill_null(np.nan).to_numpy()
                  for place in (0, 1)])
        for name in ("episodes", "mean", "spread"))
    low, high = welch_of(n, mean, spread)
    choices = ranked.with_columns(
        low=pl.Series(low, dtype=pl.Float64).fill_nan(None),
        high=pl.Series(high, dtype=pl.Float64).fill_nan(None),
        gap=pl.col("q_0") - pl.col("q_1"))
    rare = (pl.col("episodes_0") < FEW) | (pl.col("episodes_1") < FEW).fill_null(value=False)
    schema = pl.Schema(States.dtypes())
    return choices.with_columns(
        best="behaviour_id_0", second="behaviour_id_1",
        best_episodes="episodes_0", second_episodes="episodes_1",
        verdict=pl.when(rare).then(pl.lit("few")).when(pl.col("behaviours") == 1).then(pl.lit("alone"))
        .when(pl.col("low") > 0).then(pl.lit("sure")).otherwise(pl.lit("close")),
    ).select(list(schema)).cast(schema)
