"""Points that the paper leaves open: key numbers of its table and figures under other settings.

The names of variations begin with ``paper-vary-``.
"""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.stages.report.measures import (
    DIFFERENCE,
    EFFECTIVE,
    OTHER,
    Pooling,
    SeasonMeasure,
    known,
    mean_in_games,
    pooled,
    seasons_of,
)
from pitchlore.pipeline.stages.report.table3 import CHANGE

#: First part of the names of variations of the paper's settings.
PREFIX = "paper-vary-"
#: Last games that the goal difference is of.
LAST = 4


def varied_settings() -> pl.Expr:
    """True for rows of a variation, by their column settings."""
    return pl.col("settings").str.starts_with(PREFIX)


def sensitivity(games: pl.DataFrame, growth: pl.DataFrame, base: str) -> pl.DataFrame:
    """The key numbers of each variation beside those of the settings that they vary.

    All are over the games that every season of them has, so that lengths do not matter.

    Args:
        games: schema Games.
        growth: schema Growth.
        base: settings that are varied.

    Returns:
        One row for each opponent and settings, the base's first: opponent, settings, seasons, games, and
        means over the seasons with 95 % intervals: states and behaviours after the last game, all roles;
        early and late (learned actions before game 11 and from it on, mean %; null if there is no such
        game); effective (goals by direct or
        indirect action a game); difference (goals, mean of the last four games). None without variations.
    """
    found = {key: seasons for key, seasons in seasons_of(games, growth).items()
             if key[0] == base or key[0].startswith(PREFIX)}
    if all(settings == base for settings, _ in found):
        found.clear()
    last = min((season.games["game"][-1] for own in found.values() for season in own), default=0)
    measures = _measures(last)
    rows = []
    for (settings, opponent), seasons in found.items():
        row: dict[str, object] = {
            "opponent": opponent, "settings": settings, "seasons": len(seasons), "games": last}
        for name, (measure, pooling) in measures.items():
            estimate, _ = pooled(map(measure, seasons), pooling)
            row |= dict(zip((name, f"{name}_low", f"{name}_high"), estimate, strict=True))
        rows.append(row)
    ends = [f"{name}{end}" for name in measures for end in ("", "_low", "_high")]
    types = {"opponent": pl.String(), "settings": pl.String(), "seasons": pl.Int64(), "games": pl.Int64(),
             **dict.fromkeys(ends, pl.Float64())}
    return pl.DataFrame(rows, schema=types).with_columns(pl.col(ends).fill_nan(None)).sort(
        "opponent", pl.col("settings") != base, "settings")


def _measures(last: int) -> dict[str, tuple[SeasonMeasure, Pooling]]:
    return {
        "states": (known("states", last), "count"),
        "behaviours": (known("behaviours", last), "count"),
        "early": (mean_in_games(OTHER, 1, min(last, CHANGE - 1)), "percent"),
        "late": (mean_in_games(OTHER, CHANGE, last), "percent"),
        "effective": (mean_in_games(EFFECTIVE, 1, last), "count"),
        "difference": (mean_in_games(DIFFERENCE, max(1, last - LAST + 1), last), "mean"),
    }
