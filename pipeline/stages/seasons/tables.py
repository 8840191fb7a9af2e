"""One game of a season as rows of the tables Games and Growth."""

from __future__ import annotations

from typing import Any

import polars as pl

from pitchlore.pipeline.base.errors import SchemaMismatch
from pitchlore.pipeline.stages.seasons.settings import Season
from pitchlore.schemas import ROLES, Games, Growth, StatesPlayed
from pitchlore.schemas.behaviours import moves_randomly
from pitchlore.schemas.decisions import BRIEF_FRAMES, FIRST_S
from pitchlore.schemas.goals import KINDS
from pitchlore.schemas.table import Key

#: The apprentice plays home in every game of a season.
APPRENTICE, OPPONENT = "home", "away"


def game_row(
    season: Season,
    game: int,
    match: pl.DataFrame,
    decisions: pl.DataFrame,
    goals: pl.DataFrame,
    *,
    situations: int,
    known: pl.DataFrame | None = None,
    policy_version: int | None = None,
    knowledge_version: int | None = None,
    left: int | None = None,
) -> pl.DataFrame:
    """Row of the apprentice's game.

    Args:
        season: season of the game.
        game: number of the game, from 1.
        match: schema Matches, the row of the game.
        decisions: schema Decisions, of the game, with states by the finest key of the knowledge; the
            apprentice's own are counted (:func:`own`).
        goals: schema Goals, of the game, without those of a lead.
        situations: number of recognised situations, of all robots.
        known: schema Occasions, of the knowledge that it played with; None in its first game.
        policy_version: version of the policy that it played with; None if it had none.
        knowledge_version: newest version after the game; None if there is none.
        left: times that a person left the game before they played it to its end; None if a script plays.

    Returns:
        One row of schema Games.

    Raises:
        SchemaMismatch: if ``match`` is not one row.
    """
    if match.height != 1:
        raise SchemaMismatch(f"{match.height} matches, not one", where=f"{season.id}, game {game}",
                             next_step="Pass the row of the game's match")
    mine = own(decisions)
    other = mine.filter(~_at_random()).height
    hz = match["hz"].item()
    row = {
        **_identity(season, game), **match.select("match_id", "duration_s").row(0, named=True),
        "lead": season.lead(game), **_scored(goals),
        "actions": mine.height, "random_actions": mine.height - other, "other_actions": other,
        "known_states": _share_known(mine, known, season.settings.pipeline.knowledge.state_key),
        "situations": situations,
        "policy_version": policy_version, "knowledge_version": knowledge_version, "left": left,
        **_timed(mine, hz),
    }
    return Games.validate(pl.DataFrame([row], schema=Games.dtypes()), cast=True)


def growth_rows(
    season: Season,
    game: int,
    decisions: pl.DataFrame,
    played: pl.DataFrame,
    occasions: pl.DataFrame,
    behaviours: pl.DataFrame,
) -> pl.DataFrame:
    """Rows of what each role knows after a game.

    Args:
        season: season of the game.
        game: number of the game, from 1.
        decisions: schema Decisions, of the game.
        played: schema StatesPlayed, of the season's games up to and with this one.
        occasions: schema Occasions, of the newest version after the game; empty if there is none.
        behaviours: schema Behaviours, of the same version.

    Returns:
        Three rows of schema Growth, by role.
    """
    made = own(decisions).group_by("role").agg(actions=pl.len(), other_actions=(~_at_random()).sum())
    known = occasions.filter(pl.col("key") == season.settings.pipeline.knowledge.state_key)
    seen = known.filter(pl.col("count") > 0).select("role", "state").unique()
    parts = {
        "states": pl.concat([played, seen]).unique(),
        "behaviours": behaviours.filter(~_at_random()).select("role", "behaviour_id").unique(),
        "pairs": known.filter(~_at_random()).select("role", "state", "behaviour_id").unique(),
        "states_seen": seen,
        "states_played": played,
    }
    rows = pl.DataFrame({"role": ROLES}, schema={"role": pl.Enum(ROLES)})
    for name, table in parts.items():
        rows = rows.join(table.group_by("role").agg(pl.len().alias(name)), on="role", how="left",
                         maintain_order="left")
    rows = rows.join(made, on="role", how="left", maintain_order="left").with_columns(
        pl.exclude("role").fill_null(0),
        *(pl.lit(value).alias(name) for name, value in _identity(season, game).items()),
    )
    return Growth.validate(rows.select(list(Growth.dtypes())), cast=True)


def states_played(before: pl.DataFrame, decisions: pl.DataFrame) -> pl.DataFrame:
    """Schema StatesPlayed, after a game: the earlier games' rows and the states of the game's decisions."""
    states = own(decisions).select("role", "state")
    return StatesPlayed.validate(pl.concat([before, states]).unique().sort("role", "state"))


def own(decisions: pl.DataFrame) -> pl.DataFrame:
    """Decisions that the apprentice made itself: of its team, and chosen in play, not observed."""
    return decisions.filter((pl.col("team") == APPRENTICE) & pl.col("chosen"))


def _identity(season: Season, game: int) -> dict[str, Any]:
    """Columns that identify a game."""
    return {"season": season.id, "settings": season.name, "opponent": season.opponent, "seed": season.seed,
            "game": game}


def _at_random() -> pl.Expr:
    """True if the behaviour is moves randomly: null, or the behaviour of code 194 alone."""
    return pl.col("behaviour_id").is_null() | (pl.col("behaviour_id") == moves_randomly())


def _timed(mine: pl.DataFrame, hz: float) -> dict[str, float]:
    """How long decisions last, how many are of an episode's first second; names as in schema Games."""
    lasts = pl.col("end_ns") - pl.col("t_ns")
    first = pl.col("t_ns") - pl.col("t_ns").min().over("episode") < FIRST_S * 1e9
    other = ~_at_random()
    return mine.select(
        played_s=lasts.sum() / 1e9, other_s=lasts.filter(other).sum() / 1e9,
        first_actions=first.sum(), first_other_actions=(first & other).sum(),
        other_states=pl.struct("role", "state").filter(other).n_unique(),
        brief_actions=(lasts < round((BRIEF_FRAMES + 0.5) * 1e9 / hz)).sum(),
    ).row(0, named=True)


def _share_known(mine: pl.DataFrame, known: pl.DataFrame | None, key: Key) -> float:
    """Share of decisions in states for which the knowledge has more than moves randomly."""
    if known is None or not mine.height:
        return 0.0
    states = known.filter((pl.col("key") == key) & ~_at_random()).select("role", "state").unique()
    return mine.join(states, on=["role", "state"], how="semi").height / mine.height


def _scored(goals: pl.DataFrame) -> dict[str, int]:
    """Goals by kind, with the names of schema Games."""
    counts: dict[str, int] = {}
    for team, suffix in ((APPRENTICE, ""), (OPPONENT, "_against")):
        made = goals.filter(pl.col("team") == team)
        counts["goals_against" if suffix else "goals_for"] = made.height
        counts |= {f"{kind}{suffix}": made.filter(pl.col("kind") == kind).height for kind in KINDS}
    return counts
