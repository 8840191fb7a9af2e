"""Preferred behaviours of apprentices."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.arena.teams.policy_table import STANDARD_ERROR
from pitchlore.pipeline.stages.situations.rules import TABLE_1
from pitchlore.schemas.table import ROLES

_WHOSE = ("settings", "opponent", "season")
_DOES: dict[str, pl.DataType] = {
    "role": pl.Enum(ROLES), "does": pl.String(), "worth": pl.Float64(), "evidence": pl.Float64(),
}
#: Table of preferences without rows.
NO_PREFERENCES = pl.DataFrame(schema={**dict.fromkeys(_WHOSE, pl.String()), **_DOES})


def preferred_by_role(policy: pl.DataFrame, lcb_weight: float) -> pl.DataFrame:
    """Preferred behaviour of each role by a policy whose key has no state but the role.

    Args:
        policy: rows of schema Policies, of one version.
        lcb_weight: ``TeamSettings.lcb_weight`` of the team that plays it.

    Returns:
        One row for each role, in their order: role, does (codes and names of the behaviour), worth (goals,
        discounted) and evidence (episodes, at most 1 / step size). No row if the policy's key has more
        states.
    """
    if set(policy["key"].unique()) != {"role0"}:
        return pl.DataFrame(schema=_DOES)
    bound = pl.col("q") - lcb_weight * STANDARD_ERROR
    best = policy.sort("role", bound, descending=[False, True], maintain_order=True)
    first = best.unique("role", keep="first", maintain_order=True)
    does = pl.Series("does", [_in_words(behaviour) for behaviour in first["behaviour_id"]], pl.String)
    return first.select("role", does, pl.col("q").alias("worth"), "evidence")


def _in_words(behaviour: str) -> str:
    """Codes and names of a behaviour's situations, in order."""
    return ", ".join(f"{code} {TABLE_1[int(code)][0]}" for code in behaviour.split("-")[1:])


def side_by_side(preferences: pl.DataFrame) -> pl.DataFrame:
    """Preferred behaviours, with the columns of NO_PREFERENCES, in one row for each apprentice.

    Columns settings, opponent, season, and one for each role: the behaviour, its value in brackets; sorted.
    """
    said = preferences.with_columns(pl.format("{} ({})", "does", pl.col("worth").round(2)))
    return said.select(*_WHOSE, *(
        pl.col("does").filter(pl.col("role") == role).first().over(*_WHOSE).alias(role) for role in ROLES
    )).unique().sort(*_WHOSE)
