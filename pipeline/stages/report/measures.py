"""Quantities of seasons: one number for each season, and its estimate over several seasons.

A measure takes a season and gives a number; NaN if the season lacks a game that the number needs. Seasons are
independent; the games of one season are not, because they share one apprentice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import reduce
from operator import sub
from typing import Literal, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.arena.teams.constant import BEST
from pitchlore.pipeline.numbers.claims import Evidence
from pitchlore.pipeline.numbers.statistics import UNDEFINED, Estimate, difference, mean_interval, wilson
from pitchlore.pipeline.stages.report import table3
from pitchlore.schemas import ROLES, Evaluations, Growth

#: How numbers of seasons become one estimate. ``mean``: mean with Student's interval; ``count``, ``percent``,
#: ``share`` and ``correlation``: the same, cut off at the values that are possible; ``seasons``: share of
#: seasons whose number is 1 (else 0), with Wilson's interval; ``rate``: mean of shares of games or matches,
#: with the wider of both.
Pooling = Literal["mean", "count", "percent", "share", "correlation", "seasons", "rate"]
_BOUNDS: dict[Pooling, tuple[float, float]] = {
    "count": (0.0, math.inf), "percent": (0.0, 100.0), "share": (0.0, 1.0), "correlation": (-1.0, 1.0),
    "rate": (0.0, 1.0),
}

#: Decisions of another behaviour than 194, % of the game's (Table 3, column %). Null in a game without
#: decisions; means leave it out.
OTHER = 100 * pl.col("other_actions") / pl.when(pl.col("actions") > 0).then(pl.col("actions"))
#: Time in another behaviour than 194, % of the time of all decisions. Null where times are not known.
OTHER_TIME = 100 * pl.col("other_s") / pl.when(pl.col("played_s") > 0).then(pl.col("played_s"))
#: Decisions that lasted two frames or fewer, % of all. Null where they were not counted.
BRIEF = 100 * pl.col("brief_actions") / pl.when(pl.col("actions") > 0).then(pl.col("actions"))
DIFFERENCE = pl.col("goals_for").cast(pl.Int64) - pl.col("goals_against")
#: Goals by direct or indirect action (paper, Figure 10: goals effectively made).
EFFECTIVE = pl.col("direct").cast(pl.Int64) + pl.col("indirect")
WON = (pl.col("goals_for") > pl.col("goals_against")).cast(pl.Float64)
LOST = (pl.col("goals_for") < pl.col("goals_against")).cast(pl.Float64)

#: Constant teams that stand beside the apprentices: each role always takes the same behaviour
#: (:mod:`pipeline.arena.teams.constant`). Whatever an apprentice has learned, it must do better.
CONTROLS = ("constant:044", "constant:021", BEST)
#: What a control was trained against.
NOTHING = "–"

_NO_GROWTH, _NO_EVALUATIONS = Growth.empty(), Evaluations.empty()


class SeasonTables(NamedTuple):
    """Tables of one season, or of one pair of matches of a control.

    Attributes:
        games: schema Games, by game. The paper's own apprentices have the columns of game and actions only; a
            control has no rows.
        growth: schema Growth, by game and role.
        evaluations: schema Evaluations, matches that measured its apprentice after the last game.
    """

    games: pl.DataFrame
    growth: pl.DataFrame = _NO_GROWTH
    evaluations: pl.DataFrame = _NO_EVALUATIONS


SeasonMeasure = Callable[[SeasonTables], float]

#: Seasons by names of their settings and their opponent.
Seasons = Mapping[tuple[str, str], Sequence[SeasonTables]]


def distinct(games: pl.DataFrame) -> pl.DataFrame:
    """Seasons of schema Games that count: the longest of those with the same settings, opponent and seed.

    Columns settings, opponent, seed, season, sorted. Among equally long seasons the first name counts.
    """
    key = ["settings", "opponent", "seed"]
    lengths = games.group_by(*key, "season").agg(pl.len()).sort("len", "season", descending=[True, False])
    return lengths.unique(key, keep="first", maintain_order=True).drop("len").sort(key)


def seasons_of(
    games: pl.DataFrame, growth: pl.DataFrame = _NO_GROWTH, evaluations: pl.DataFrame = _NO_EVALUATIONS
) -> dict[tuple[str, str], list[SeasonTables]]:
    """Seasons by settings and opponent: those that are :func:`distinct`, in order of their seeds.

    A team's name in schema Evaluations is the id of its season. Each pair of matches of one of
    :data:`CONTROLS` stands for a season of the control against :data:`NOTHING`: its matches have no
    apprentice in common, so pairs are independent.
    """
    found: dict[tuple[str, str], list[SeasonTables]] = {}
    for row in distinct(games).iter_rows(named=True):
        mine = pl.col("season") == row["season"]
        found.setdefault((row["settings"], row["opponent"]), []).append(
            SeasonTables(games.filter(mine).sort("game"), growth.filter(mine).sort("game", "role"),
                   evaluations.filter(pl.col("team") == row["season"])))
    for control in CONTROLS:
        rows = evaluations.filter(pl.col("team") == control)
        matches = rows.partition_by("opponent", "seed", maintain_order=True)
        if matches:
            found[control, NOTHING] = [SeasonTables(games.clear(), growth.clear(), pair) for pair in matches]
    return found


def pooled(values: Iterable[float], pooling: Pooling, trials: int = 1) -> tuple[Estimate, int]:
    """Estimate of the seasons' common number, and the number of seasons that have one.

    Equal numbers give a mean's interval without width. That suits facts that must hold and is too narrow for
    others. A rate is uncertain for two reasons: apprentices differ, and each was seen in few trials.
    Student's interval over the seasons covers both, but it has no width if few shares near 0 or 1 are equal.
    Wilson's over all trials covers the second reason alone. The interval of a rate reaches to the farther
    end of both.

    Args:
        values: one number for each season; NaN if it has none.
        pooling: see :data:`Pooling`.
        trials: least number of trials behind a season's share, independent but for the apprentice: games, or
            pairs of matches. Only a rate needs it.
    """
    seen = [value for value in values if not math.isnan(value)]
    if not seen:
        return UNDEFINED, 0
    mean = math.fsum(seen) / len(seen)
    if pooling == "seasons":
        return Estimate(mean, *wilson(mean * len(seen), len(seen))), len(seen)
    ends = mean_interval(seen)
    if ends is None:
        return Estimate(mean, math.nan, math.nan), len(seen)
    if pooling == "rate":
        low, high = wilson(mean * len(seen) * trials, len(seen) * trials)
        ends = min(ends[0], low), max(ends[1], high)
    least, most = _BOUNDS.get(pooling, (-math.inf, math.inf))
    return Estimate(mean, max(ends[0], least), min(ends[1], most)), len(seen)


def phase(games: pl.DataFrame, first: int, last: int) -> pl.DataFrame | None:
    """Rows of the games from ``first`` to ``last``, both included; None if a game is missing."""
    rows = games.filter(pl.col("game").is_between(first, last))
    return rows if rows["game"].n_unique() == last - first + 1 else None


def mean_in_games(value: pl.Expr, first: int, last: int) -> SeasonMeasure:
    """Measure: the mean of a value over games ``first`` to ``last``; of a condition, the share."""
    return _of_phase(first, last, lambda rows: rows.select(value.mean()).item())


def total(value: pl.Expr, first: int, last: int) -> SeasonMeasure:
    """Measure: the sum of a value over games ``first`` to ``last``."""
    return _of_phase(first, last, lambda rows: rows.select(value.sum()).item())


def greatest_in_games(value: pl.Expr, first: int, last: int) -> SeasonMeasure:
    """Measure: the greatest value in games ``first`` to ``last``."""
    return _of_phase(first, last, lambda rows: rows.select(value.max()).item())


def evaluated(value: pl.Expr, opponent: str, games: int) -> SeasonMeasure:
    """Measure: the mean of a value over an apprentice's evaluations against an opponent.

    NaN if the season is not of so many games. A control has no games, so any number is its own.
    """
    def measure(season: SeasonTables) -> float:
        matches = season.evaluations.filter(pl.col("opponent") == opponent)
        shorter = season.games["game"].max() not in (None, games)
        seen = None if shorter else matches.select(value.mean()).item()
        return math.nan if seen is None else float(seen)

    return measure


def pairs(opponent: str) -> Callable[[SeasonTables], int]:
    """Number of pairs of evaluation matches against an opponent, as a function of the season."""
    return lambda season: season.evaluations.filter(pl.col("opponent") == opponent)["seed"].n_unique()


def slope(value: pl.Expr, first: int, last: int) -> SeasonMeasure:
    """Measure: the slope of the least-squares line through games ``first`` to ``last``, value per game."""
    def fitted(rows: pl.DataFrame) -> float | None:
        x, y = rows.select(pl.col("game").cast(pl.Float64), value.alias("y")).drop_nulls().get_columns()
        return float(np.polyfit(x.to_numpy(), y.to_numpy(), 1)[0]) if len(x) > 1 else None

    return _of_phase(first, last, fitted)


def overall_other(first: int, last: int) -> SeasonMeasure:
    """Measure: other actions of all actions in games ``first`` to ``last``, %."""
    others = total(pl.col("other_actions"), first, last)
    return both(others, total(pl.col("actions"), first, last), lambda a, b: 100 * a / b if b else math.nan)


def both(one: SeasonMeasure, other: SeasonMeasure, joined: Callable[[float, float], float]) -> SeasonMeasure:
    """Measure made of two others; NaN if one of them is."""
    def measure(season: SeasonTables) -> float:
        a, b = one(season), other(season)
        return math.nan if math.isnan(a) or math.isnan(b) else float(joined(a, b))

    return measure


def less(one: SeasonMeasure, other: SeasonMeasure) -> SeasonMeasure:
    """Measure: the first minus the second."""
    return both(one, other, lambda a, b: a - b)


def known(column: str, game: int, roles: Sequence[str] = ROLES) -> SeasonMeasure:
    """Measure: a column of schema Growth after a game, added up over the roles."""
    def measure(season: SeasonTables) -> float:
        rows = season.growth.filter((pl.col("game") == game) & pl.col("role").is_in(roles))
        return float(rows[column].sum()) if rows.height == len(roles) else math.nan

    return measure


def least_step(column: str, first: int, last: int) -> SeasonMeasure:
    """Measure: the least change of a column of schema Growth from game to game, over the roles."""
    def measure(season: SeasonTables) -> float:
        steps = _steps(season, column, first, last)
        return math.nan if steps is None else float(steps["step"].min())  # type: ignore[arg-type]

    return measure


def grown_without_training(column: str, first: int, last: int) -> SeasonMeasure:
    """Measure: the rise of a column of schema Growth over games after which no new knowledge was made."""
    def measure(season: SeasonTables) -> float:
        steps = _steps(season, column, first, last)
        if steps is None:
            return math.nan
        untrained = season.games.select("game", same=pl.col("knowledge_version").eq_missing(
            pl.col("knowledge_version").shift(1))).filter("same")
        return float(steps.join(untrained, on="game", how="semi")["step"].clip(0).sum())

    return measure


def paper_value(measure: SeasonMeasure, column: str) -> float:
    """Number of the paper's own season in a column of Table 3."""
    return measure(SeasonTables(table3.games(column)))


def season_evidence(
    sides: Sequence[tuple[str, str]], measure: SeasonMeasure, pooling: Pooling = "mean",
    trials: Callable[[SeasonTables], int] = lambda _: 1, *, in_table_3: bool = False,
) -> Callable[[Seasons], Iterator[Evidence]]:
    """Evidence from seasons: the estimate of one side, or of the first side minus the second.

    Args:
        sides: settings and opponent of the seasons, one or two. A column of Table 3 stands for the opponent
            beside it (:func:`pipeline.stages.report.table3.beside`).
        measure: number of one season.
        pooling: see :data:`Pooling`.
        trials: trials behind one season's share; only a rate needs it.
        in_table_3: the paper's Table 3 has the quantity.
    """
    def estimate(seasons: Sequence[SeasonTables]) -> tuple[Estimate, int]:
        values = [measure(season) for season in seasons]
        known = [season for season, value in zip(seasons, values, strict=True) if not math.isnan(value)]
        return pooled(values, pooling, min(map(trials, known), default=1))

    def evidence(seasons: Seasons) -> Iterator[Evidence]:
        ours = [(name, table3.beside(column, {there for own, there in seasons if own == name}))
                for name, column in sides]
        estimates, counts = zip(*(estimate(seasons.get(side, ())) for side in ours), strict=True)
        paper = reduce(sub, [paper_value(measure, column) for _, column in sides]) if in_table_3 else None
        settings, opponents = (" less ".join(dict.fromkeys(words)) for words in zip(*ours, strict=True))
        about = {"settings": settings, "opponent": opponents, "seasons": min(counts), "table_3": paper}
        yield Evidence(reduce(difference, estimates), min(counts), about, paper)

    return evidence


def _of_phase(first: int, last: int, of: Callable[[pl.DataFrame], float | None]) -> SeasonMeasure:
    def measure(season: SeasonTables) -> float:
        rows = phase(season.games, first, last)
        value = None if rows is None else of(rows)
        return math.nan if value is None else float(value)

    return measure


def _steps(season: SeasonTables, column: str, first: int, last: int) -> pl.DataFrame | None:
    """Column step: change of each role from game to game; None if a game is missing."""
    rows = phase(season.growth, first, last)
    if rows is None:
        return None
    return rows.sort("role", "game").select(
        "game", step=pl.col(column).diff().over("role")).drop_nulls()
