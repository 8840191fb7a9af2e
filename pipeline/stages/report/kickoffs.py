"""How much of Table 3 is kick-offs: learned decisions in the first second of an episode, and the rest.

A kick-off puts the ball and robots near the same places each time. Its states are therefore known long before
others, and each goal brings one more. So a share of learned actions can count goals instead of learning.
"""

from __future__ import annotations

import math

import polars as pl

from pitchlore.pipeline.stages.report import table3
from pitchlore.pipeline.stages.report.claims import PAPER, WITHOUT_SCORE
from pitchlore.pipeline.stages.report.measures import OTHER, Pooling, pooled, seasons_of

_KICK_OFFS = pl.col("goals_for").cast(pl.Int64) + pl.col("goals_against") + 1
_OTHER, _ALL = pl.col("other_actions").sum(), pl.col("actions").sum()
_FIRST_OTHER, _FIRST = pl.col("first_other_actions").sum(), pl.col("first_actions").sum()

#: Settings whose learned actions are taken apart: the paper's, and those whose key has no score.
SETTINGS = (PAPER, WITHOUT_SCORE)

_KEY = ("settings", "opponent")
#: Columns of :func:`kick_offs`: the value over the games of one season, and how seasons are pooled.
MEASURES: dict[str, tuple[pl.Expr, Pooling]] = {
    "other": (100 * _OTHER / _ALL, "percent"),
    "later": (100 * (_OTHER - _FIRST_OTHER) / (_ALL - _FIRST), "percent"),
    "in_first": (100 * _FIRST_OTHER / _OTHER, "percent"),
    "states": (pl.col("other_states").mean(), "count"),
    "kick_offs": (_KICK_OFFS.mean(), "count"),
    "each": (_OTHER / _KICK_OFFS.sum(), "count"),
    "r": (pl.corr(OTHER, _KICK_OFFS), "correlation"),
}


def begins(opponent: str) -> int:
    """First game that counts: that of the new score against static, else the first that has a policy."""
    return table3.CHANGE if opponent == "static" else 2


def kick_offs(games: pl.DataFrame) -> pl.DataFrame:
    """Learned actions of seasons, and how many of them are kick-offs.

    Args:
        games: schema Games.

    Returns:
        One row for each of :data:`SETTINGS` and each opponent of the paper that was played: settings,
        opponent, first and last (game, of the shortest season), seasons, and for each of :data:`MEASURES` its
        mean over the seasons with the ends of its 95 % interval (``_low``, ``_high``); null where it is not
        defined. ``r`` is the correlation of the share of learned actions with goals + 1, game by game.
    """
    rows = []
    for (name, opponent), seasons in seasons_of(games).items():
        first = begins(opponent)
        played = [season.games.filter(pl.col("game") >= first) for season in seasons]
        if name not in SETTINGS or table3.column_of(opponent) is None or not all(map(len, played)):
            continue
        row: dict[str, object] = {
            "settings": name, "opponent": opponent, "first": first, "seasons": len(played),
            "last": min(own["game"][-1] for own in played)}
        for column, (value, pooling) in MEASURES.items():
            estimate, _ = pooled((_of(own, value) for own in played), pooling)
            row |= dict(zip((column, f"{column}_low", f"{column}_high"), estimate, strict=True))
        rows.append(row)
    names = [f"{column}{end}" for column in MEASURES for end in ("", "_low", "_high")]
    types = {**dict.fromkeys(_KEY, pl.String()), **dict.fromkeys(("first", "last", "seasons"), pl.Int64()),
             **dict.fromkeys(names, pl.Float64())}
    return pl.DataFrame(rows, schema=types).with_columns(pl.col(names).fill_nan(None)).sort(_KEY)


def _of(games: pl.DataFrame, value: pl.Expr) -> float:
    """The value over the games of a season; NaN if it is not defined, or if a column for it is null."""
    if games.select(set(value.meta.root_names())).null_count().sum_horizontal().item():
        return math.nan
    found = games.select(value).item()
    return math.nan if found is None else float(found)
