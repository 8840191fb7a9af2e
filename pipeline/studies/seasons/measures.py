"""What a season is worth in one number, and that number over several seasons.

A measure takes a season and gives a number; NaN where the season does not have all the games that it is
about. The season is what is independent of others: its games share one apprentice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Literal, NamedTuple

import numpy as np
import polars as pl

from pipeline.studies.statistics import UNDEFINED, Estimate, mean_interval, wilson
from schemas import ROLES

#: How numbers of seasons become one: their mean with Student's interval, of which no more is left than a
#: count, a percentage or a share can be; the share of seasons that say yes (1 rather than 0) with Wilson's; a
#: rate, the mean of shares of games or matches, with the wider of both (see :func:`pooled`).
Pooling = Literal["mean", "count", "percent", "share", "seasons", "rate"]
_BOUNDS: dict[Pooling, tuple[float, float]] = {
    "count": (0.0, math.inf), "percent": (0.0, 100.0), "share": (0.0, 1.0), "rate": (0.0, 1.0),
}

#: Decisions of another behaviour than 194, per cent of the game's (Table 3, column %).
#: Null in a game without decisions, which is left out of means.
OTHER = 100 * pl.col("other_actions") / pl.when(pl.col("actions") > 0).then(pl.col("actions"))
DIFFERENCE = pl.col("goals_for").cast(pl.Int64) - pl.col("goals_against")
#: Goals effectively made, by direct or indirect action (paper, Figure 10).
EFFECTIVE = pl.col("direct").cast(pl.Int64) + pl.col("indirect")
WON = (pl.col("goals_for") > pl.col("goals_against")).cast(pl.Float64)
LOST = (pl.col("goals_for") < pl.col("goals_against")).cast(pl.Float64)


class Season(NamedTuple):
    """One season.

    Attributes:
        games: schema Games, by game. Of the paper's own apprentices only game and actions are known.
        growth: schema Growth, by game and role.
        evaluations: schema Evaluations: matches that its apprentice was measured by after the last game.
    """

    games: pl.DataFrame
    growth: pl.DataFrame
    evaluations: pl.DataFrame


Measure = Callable[[Season], float]


def distinct(games: pl.DataFrame) -> pl.DataFrame:
    """The seasons that count: of those with the same settings, opponent and seed, which are one, the longest.

    Args:
        games: schema Games.

    Returns:
        Columns settings, opponent, seed, season, sorted; of equally long ones the first by name.
    """
    key = ["settings", "opponent", "seed"]
    lengths = games.group_by(*key, "season").agg(pl.len()).sort("len", "season", descending=[True, False])
    return lengths.unique(key, keep="first", maintain_order=True).drop("len").sort(key)


def seasons_of(
    games: pl.DataFrame, growth: pl.DataFrame, evaluations: pl.DataFrame
) -> dict[tuple[str, str], list[Season]]:
    """Settings and opponent to their :func:`distinct` seasons, by seed.

    Args:
        games: schema Games.
        growth: schema Growth.
        evaluations: schema Evaluations, of teams that are called by the id of their season.
    """
    found: dict[tuple[str, str], list[Season]] = {}
    for row in distinct(games).iter_rows(named=True):
        mine = pl.col("season") == row["season"]
        found.setdefault((row["settings"], row["opponent"]), []).append(
            Season(games.filter(mine).sort("game"), growth.filter(mine).sort("game", "role"),
                   evaluations.filter(pl.col("team") == row["season"])))
    return found


def pooled(values: Iterable[float], pooling: Pooling, trials: int = 1) -> tuple[Estimate, int]:
    """One number of seasons' numbers, and how many seasons have it.

    Equal numbers have a mean's interval without width: what never varied in the seasons seen is taken
    as certain, which suits facts that must hold, and is too narrow for others. A rate is uncertain because
    apprentices differ, and because each was seen in so many trials only. Student's interval over the
    seasons holds both, but says nothing where few shares near 0 or 1 happen to be alike; Wilson's over all
    trials holds the second alone. The interval of a rate reaches to the farther end of both.

    Args:
        values: one a season, NaN where it has none.
        pooling: see :data:`Pooling`.
        trials: that each season's share is over at least and that are independent but for the
            apprentice: games, or pairs of matches; of a rate only.
    """
    seen = [value for value in values if not math.isnan(value)]
    if not seen:
        return UNDEFINED, 0
    mean = math.fsum(seen) / len(seen)
    if pooling == "seasons":
        low, high = wilson(mean * len(seen), len(seen))
        return Estimate(mean, float(low), float(high)), len(seen)
    ends = mean_interval(seen)
    if ends is None:
        return Estimate(mean, math.nan, math.nan), len(seen)
    if pooling == "rate":
        low, high = wilson(mean * len(seen) * trials, len(seen) * trials)
        ends = min(ends[0], float(low)), max(ends[1], float(high))
    least, most = _BOUNDS.get(pooling, (-math.inf, math.inf))
    return Estimate(mean, max(ends[0], least), min(ends[1], most)), len(seen)


def phase(games: pl.DataFrame, first: int, last: int) -> pl.DataFrame | None:
    """The games from ``first`` to ``last``, both included; None if one of them is missing."""
    rows = games.filter(pl.col("game").is_between(first, last))
    return rows if rows["game"].n_unique() == last - first + 1 else None


def mean(value: pl.Expr, first: int, last: int) -> Measure:
    """The mean of a value over the games of a phase."""
    return _of_phase(first, last, lambda rows: rows.select(value.mean()).item())


def total(value: pl.Expr, first: int, last: int) -> Measure:
    """The sum over the games of a phase."""
    return _of_phase(first, last, lambda rows: rows.select(value.sum()).item())


def greatest(value: pl.Expr, first: int, last: int) -> Measure:
    """The greatest over the games of a phase."""
    return _of_phase(first, last, lambda rows: rows.select(value.max()).item())


def share(condition: pl.Expr, first: int, last: int) -> Measure:
    """The share of games of a phase in which a condition holds."""
    return mean(condition.cast(pl.Float64), first, last)


def evaluated(value: pl.Expr, opponent: str, games: int) -> Measure:
    """The mean of a value over the matches that a season's apprentice was measured by.

    Args:
        value: of a row of schema Evaluations.
        opponent: of the matches.
        games: NaN of a season of another length.
    """
    def measure(season: Season) -> float:
        matches = season.evaluations.filter(pl.col("opponent") == opponent)
        seen = None if season.games["game"].max() != games else matches.select(value.mean()).item()
        return math.nan if seen is None else float(seen)

    return measure


def pairs(opponent: str) -> Callable[[Season], int]:
    """How many pairs of matches the apprentice was measured by against an opponent."""
    return lambda season: season.evaluations.filter(pl.col("opponent") == opponent)["seed"].n_unique()


def slope(value: pl.Expr, first: int, last: int) -> Measure:
    """The slope a game of the least-squares line through the games of a phase."""
    def fitted(rows: pl.DataFrame) -> float | None:
        x, y = rows.select(pl.col("game").cast(pl.Float64), value.alias("y")).drop_nulls().get_columns()
        return float(np.polyfit(x.to_numpy(), y.to_numpy(), 1)[0]) if len(x) > 1 else None

    return _of_phase(first, last, fitted)


def overall_other(first: int, last: int) -> Measure:
    """Other actions of all actions of a phase, per cent."""
    others = total(pl.col("other_actions"), first, last)
    return both(others, total(pl.col("actions"), first, last), lambda a, b: 100 * a / b if b else math.nan)


def both(one: Measure, other: Measure, joined: Callable[[float, float], float]) -> Measure:
    """A number made of two; NaN where one of them is."""
    def measure(season: Season) -> float:
        a, b = one(season), other(season)
        return math.nan if math.isnan(a) or math.isnan(b) else float(joined(a, b))

    return measure


def less(one: Measure, other: Measure) -> Measure:
    """The first less the second."""
    return both(one, other, lambda a, b: a - b)


def known(column: str, game: int, roles: Sequence[str] = ROLES) -> Measure:
    """What roles know after a game, added up: a column of schema Growth."""
    def measure(season: Season) -> float:
        rows = season.growth.filter((pl.col("game") == game) & pl.col("role").is_in(roles))
        return float(rows[column].sum()) if rows.height == len(roles) else math.nan

    return measure


def least_step(column: str, first: int, last: int) -> Measure:
    """The least change of a column of schema Growth from a game to the next, over the roles."""
    def measure(season: Season) -> float:
        steps = _steps(season, column, first, last)
        return math.nan if steps is None else float(steps["step"].min())  # type: ignore[arg-type]

    return measure


def grown_without_training(column: str, first: int, last: int) -> Measure:
    """How much a column of schema Growth rose over games that no new version of the knowledge followed."""
    def measure(season: Season) -> float:
        steps = _steps(season, column, first, last)
        if steps is None:
            return math.nan
        untrained = season.games.select("game", same=pl.col("knowledge_version").eq_missing(
            pl.col("knowledge_version").shift(1))).filter("same")
        return float(steps.join(untrained, on="game", how="semi")["step"].clip(0).sum())

    return measure


def _of_phase(first: int, last: int, of: Callable[[pl.DataFrame], float | None]) -> Measure:
    def measure(season: Season) -> float:
        rows = phase(season.games, first, last)
        value = None if rows is None else of(rows)
        return math.nan if value is None else float(value)

    return measure


def _steps(season: Season, column: str, first: int, last: int) -> pl.DataFrame | None:
    """Column step, of each role from game to game of a phase; None if a game is missing."""
    rows = phase(season.growth, first, last)
    if rows is None:
        return None
    return rows.sort("role", "game").select(
        "game", step=pl.col(column).diff().over("role")).drop_nulls()
