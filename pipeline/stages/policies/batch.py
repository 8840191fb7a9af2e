"""Decisions as a batch to learn from, and the state-behaviour pair of each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.settings import PolicySettings
from pitchlore.pipeline.stages.policies.sarsa import CONTINUES, TERMINAL, TRUNCATED, UNKNOWN
from pitchlore.pipeline.state import project
from pitchlore.schemas import Decisions
from pitchlore.schemas.behaviours import moves_randomly
from pitchlore.schemas.table import Key

PAIR = ["role", "key", "state", "behaviour_id"]


class DecisionBatch(NamedTuple):
    """Decisions to learn from, in order and in few bytes each [T].

    Attributes:
        matches: number of their matches.
        rows: columns role, state, behaviour_id (null if it has no value), elapsed, reward, ends, and
            team_episode, which packs the match's number, episode, team and, in its last bit, whether a player
            chose the decision. For influence values also robot and t_ns.
        pairs: by key, the pair of each decision, int64 [T]: its place among those of the key, or UNKNOWN.
    """

    matches: int
    rows: pl.DataFrame
    pairs: Mapping[Key, I64]


def batch_of(
    decisions: Iterable[pl.DataFrame], valued: pl.DataFrame, settings: PolicySettings
) -> DecisionBatch:
    """The decisions of matches to learn from, and the pairs that have a value.

    Args:
        decisions: tables of schema Decisions, of one or more whole matches each. They are consumed one at a
            time. About 38 bytes a decision are kept, 48 with influence values, and 8 for each key.
        valued: columns role, key, state and behaviour_id: the pairs.
        settings: choice of the decisions to learn from.
    """
    known = pl.Enum(valued["behaviour_id"].unique().sort())
    parts, matches = [_rows(Decisions.empty(), 0, known, settings)], 0
    for table in decisions:
        parts.append(_rows(table, matches, known, settings))
        matches += max(table["match_id"].rle().len(), 1)
    rows = pl.concat(parts)
    return DecisionBatch(matches, rows, {
        key: _pairs(rows, valued.filter(pl.col("key") == key).sort(PAIR), key)
        for key in valued["key"].unique().sort()})


def _rows(table: pl.DataFrame, before: int, known: pl.Enum, settings: PolicySettings) -> pl.DataFrame:
    """The rows of a batch from a table of schema Decisions; matches count on from a number."""
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


def _pairs(rows: pl.DataFrame, own: pl.DataFrame, key: Key) -> I64:
    """Index of each decision's pair in ``own``, the pairs of one key, int64 [T]; UNKNOWN without one."""
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
