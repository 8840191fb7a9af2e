"""Decisions as a batch to learn from, and the state-behaviour pair of each."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.policies.sarsa import CONTINUES, TERMINAL, TRUNCATED, UNKNOWN
from pitchlore.pipeline.state import project
from pitchlore.schemas.behaviours import moves_randomly
from pitchlore.schemas.table import Key


def batch_of(table: pl.DataFrame, before: int, known: pl.Enum, settings: PolicySettings) -> pl.DataFrame:
    """The decisions of some matches to learn from, in order and in few bytes each.

    Args:
        table: rows of schema Decisions.
        before: number of the first match; the others count on from it.
        known: the behaviours that have a value.
        settings: choice of the decisions to learn from.

    Returns:
        Columns role, state, behaviour_id (null if not ``known``), elapsed, reward, ends, and team_episode,
        which packs the match's number, episode, team and, in its last bit, whether a player chose the
        decision. For influence values also robot and t_ns.
    """
    table = table.with_columns(match=pl.col("match_id").rle_id().cast(pl.Int64) + before)
    if settings.learn_from != "both":
        table = table.filter(pl.col("chosen") == (settings.learn_from == "chosen"))
    sequence = ("match", "team", "robot", "chosen")
    episode = pl.struct(*sequence, "episode").rle_id()
    team, kind = pl.col("team").to_physical().cast(pl.Int64), pl.col("chosen").cast(pl.Int64)
    team_episode = (pl.col("match") * 2**31 + pl.col("episode")) * 4 + team * 2 + kind
    return (
        table.sort(*sequence, "t_ns")
        .with_columns(last=(episode != episode.shift(-1)).fill_null(value=True))
        .select(
            "role",
            "state",
            pl.col("behaviour_id").fill_null(moves_randomly()).cast(known, strict=False),
            ((pl.col("end_ns") - pl.col("t_ns")) / 1e9).alias("elapsed"),
            "reward",
            # an episode whose last decision does not say how it ended was cut there
            pl.when(pl.col("ends") == "terminal").then(TERMINAL)
            .when(pl.col("ends").is_not_null() | pl.col("last")).then(TRUNCATED)
            .otherwise(CONTINUES).cast(pl.Int8).alias("ends"),
            team_episode.alias("team_episode"),
            *(("robot", "t_ns") if settings.rule == "influence" else ()),
        )
    )


def pairs_of(rows: pl.DataFrame, own: pl.DataFrame, key: Key) -> I64:
    """Index of each decision's pair in ``own``, the pairs of one key, int64 [T]; UNKNOWN without one.

    Args:
        rows: rows of :func:`batch_of`, [T].
        own: columns role, state and behaviour_id.
        key: key of the states of ``own``.
    """
    known = rows["behaviour_id"].dtype
    index = own.select(
        "role",
        "state",
        pl.col("behaviour_id").cast(known),
        pl.int_range(pl.len(), dtype=pl.Int64).alias("pair"),
    )
    states = project(rows["state"].to_numpy(), key, rows["role"].to_physical().to_numpy())
    return (
        rows.select("role", pl.Series("state", states), "behaviour_id")
        .join(index, on=["role", "state", "behaviour_id"], how="left", maintain_order="left")["pair"]
        .fill_null(UNKNOWN)
        .to_numpy()
    )
