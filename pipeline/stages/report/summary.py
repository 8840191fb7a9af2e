"""Summaries of seasons: curves over the games, Table 3 beside the paper's, settings beside each other.

``games`` is of schema Games, ``evaluations`` of schema Evaluations, where a team's name is its season's id.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import polars as pl

from pitchlore.pipeline.numbers.statistics import Estimate, welch
from pitchlore.pipeline.stages.report import table3
from pitchlore.pipeline.stages.report.measures import (
    BRIEF,
    DIFFERENCE,
    LOST,
    OTHER,
    OTHER_TIME,
    WON,
    Pooling,
    SeasonMeasure,
    SeasonTables,
    distinct,
    evaluated,
    mean_in_games,
    pairs,
    pooled,
    seasons_of,
)

#: Last games of a season over which settings are compared.
LAST = 10

_SIDES = ("settings", "opponent")
_ENDS = ("", "_low", "_high")
_KINDS = ("direct", "indirect", "error")
_COMPARED: dict[str, tuple[pl.Expr, Pooling]] = {
    "difference": (DIFFERENCE, "mean"), "other": (OTHER_TIME, "percent"), "brief": (BRIEF, "percent"),
    "won": (WON, "rate"), "lost": (LOST, "rate"),
}


def mean_curves(
    table: pl.DataFrame, values: Mapping[str, pl.Expr], by: Sequence[str] = (), *,
    poolings: Mapping[str, Pooling] = MappingProxyType({}),
) -> pl.DataFrame:
    """Means over the seasons, game by game.

    Args:
        table: schema Games or Growth.
        values: expression for a row, by name; it may look at the season's earlier games, which stand above.
        by: columns that identify a row besides the game (the role of schema Growth).
        poolings: pooling of the seasons' numbers, by name (default: mean).

    Returns:
        Columns what (a name of ``values``), settings, opponent, those of ``by``, game, seasons, mean, low
        and high (Student's 95 % interval; null below two seasons), sorted in this order. The column ``what``
        keeps the order of ``values``.
    """
    key = [*_SIDES, *by, "game"]
    kept = table.join(distinct(table), on=[*_SIDES, "seed", "season"], how="semi").sort("season", *by, "game")
    rows, ends = [], ("mean", "low", "high")
    for what, value in values.items():
        read = kept.select(*key, value.over("season", *by).cast(pl.Float64).alias("value"))
        groups = read.drop_nulls("value").group_by(*key).agg("value").sort(key)
        for group in groups.iter_rows(named=True):
            estimate, seasons = pooled(group.pop("value"), poolings.get(what, "mean"))
            rows.append({"what": what, **group, "seasons": seasons, **dict(zip(ends, estimate, strict=True))})
    types = {"what": pl.String(), **{name: table.schema[name] for name in key}, "seasons": pl.Int64(),
             **dict.fromkeys(ends, pl.Float64())}
    return pl.DataFrame(rows, schema=types).with_columns(pl.col(ends).fill_nan(None))


def beside_table_3(games: pl.DataFrame, settings: str) -> pl.DataFrame:
    """The paper's Table 3 and that of our seasons with these settings, game by game.

    Seasons against a person stand beside the human column. If there are none, those against a second script
    do.

    Returns:
        One row for each opponent and game, sorted. Ours: opponent, game, seasons, total, random, other, pct
        (means over the seasons), low, high (interval of pct), and time_pct (mean share of time, %); null if
        there are no seasons. The paper's:
        paper_total, paper_random, paper_other, paper_pct as printed; null after game 35.
    """
    mine = games.filter(pl.col("settings") == settings)
    played = set(mine["opponent"].unique())
    columns = {column: table3.beside(column, played) for column in table3.COLUMNS}
    ours = mean_curves(mine, {
        "total": pl.col("actions"), "random": pl.col("random_actions"), "other": pl.col("other_actions"),
        "pct": OTHER, "time_pct": OTHER_TIME,
    }, poolings={"pct": "percent"}).with_columns(pl.col("opponent").cast(pl.String))
    wide = ours.filter(pl.col("what") == "total").select("opponent", "game", pl.col("mean").alias("total"))
    shares = ours.filter(pl.col("what") == "pct").select(
        "opponent", "game", "seasons", pl.col("mean").alias("pct"), "low", "high")
    others = (ours.filter(pl.col("what") == what).select("opponent", "game", pl.col("mean").alias(what))
              for what in ("random", "other", "time_pct"))
    for means in (shares, *others):
        wide = wide.join(means, on=["opponent", "game"], how="left")
    printed = pl.concat(
        table3.printed().select(
            pl.lit(kind).alias("opponent"), pl.col("game").cast(pl.Int16),
            *(pl.col(f"{column}_{name}").alias(f"paper_{name}")
              for name in ("total", "random", "other", "pct")),
        ) for column, kind in columns.items()
    )
    both = printed.join(wide, on=["opponent", "game"], how="full", coalesce=True)
    return both.filter(pl.col("opponent").is_in(list(columns.values()))).select(
        "opponent", "game", pl.col("seasons").fill_null(0), "total", "random", "other", "pct", "low", "high",
        "time_pct", "paper_total", "paper_random", "paper_other", "paper_pct",
    ).sort("opponent", "game")


def settings_compared(games: pl.DataFrame) -> pl.DataFrame:
    """Settings beside each other: the last ten games of their seasons, or all if there are fewer.

    Returns:
        One row for each settings and opponent: settings, opponent, seasons, games (of the shortest season),
        and means over the seasons with 95 % intervals: difference (goals a game), other (% of time), brief
        (% of decisions), won and lost (shares of games).
    """
    rows = []
    for (settings, opponent), seasons in seasons_of(games).items():
        lengths = [_games(season) for season in seasons]
        row: dict[str, object] = {
            "settings": settings, "opponent": opponent, "seasons": len(seasons), "games": min(lengths)}
        for name, (value, pooling) in _COMPARED.items():
            numbers = [_last(value, length)(season) for season, length in zip(seasons, lengths, strict=True)]
            estimate, _ = pooled(numbers, pooling, min(LAST, *lengths))
            row |= _ends(name, estimate)
        rows.append(row)
    return _table(rows, _SIDES, ("seasons", "games"), tuple(_COMPARED))


def ablated(games: pl.DataFrame, bases: Sequence[str]) -> pl.DataFrame:
    """Effect of each ablation: the last ten games of its seasons minus those of its base.

    The interval is Welch's. Seasons of the same seed share the random numbers of their first game only, so
    pairing them would halve the degrees of freedom and gain almost nothing.

    Args:
        games: schema Games.
        bases: names of settings; the names of their ablations are ``BASE-…``.

    Returns:
        One row for each ablation and opponent that its base has played, too, by base, settings, opponent:
        settings, base, opponent, seasons and seasons_base (counts), first and last (the last ten games that
        all these seasons have), and with 95 % intervals difference (goals a game) and other (% of time),
        the ablation's minus the base's.
    """
    found = seasons_of(games)
    rows: list[dict[str, object]] = []
    for base in bases:
        for (settings, opponent), seasons in found.items():
            others = found.get((base, opponent), [])
            if not settings.startswith(f"{base}-") or not others:
                continue
            last = min(map(_games, (*seasons, *others)))
            row: dict[str, object] = {
                "settings": settings, "base": base, "opponent": opponent, "seasons": len(seasons),
                "seasons_base": len(others), "first": max(1, last - LAST + 1), "last": last,
            }
            for name, value in (("difference", DIFFERENCE), ("other", OTHER_TIME)):
                mine, theirs = ([_last(value, last)(season) for season in side] for side in (seasons, others))
                apart = Estimate(pooled(mine, "mean")[0].value - pooled(theirs, "mean")[0].value,
                                 *(welch(mine, theirs) or (math.nan, math.nan)))
                row |= _ends(name, apart)
            rows.append(row)
    return _table(rows, ("settings", "base", "opponent"), ("seasons", "seasons_base", "first", "last"),
                  ("difference", "other"))


def measured(games: pl.DataFrame, evaluations: pl.DataFrame) -> pl.DataFrame:
    """Evaluations of the apprentices after the last game of their season, and of the controls.

    Returns:
        One row for each settings, opponent and length of seasons, and opponent of the evaluation: settings,
        opponent, games, against, seasons, matches (of all seasons), and means over the seasons with 95 %
        intervals: difference (goals a match), other (% of time), brief (% of decisions), won and lost
        (shares of matches). A control's name is in settings; it has no games and no seasons, and its means
        are over pairs of matches.
    """
    rows: list[dict[str, object]] = []
    for (settings, opponent), seasons in seasons_of(games, evaluations=evaluations).items():
        taught = [season for season in seasons if season.evaluations.height]
        for length in sorted(set(map(_games, taught))):
            mine = [season for season in taught if _games(season) == length]
            for against in sorted({name for season in mine for name in season.evaluations["opponent"]}):
                seen = [season for season in mine if pairs(against)(season)]
                row: dict[str, object] = {
                    "settings": settings, "opponent": opponent, "games": length or None, "against": against,
                    "seasons": len(seen) if length else None,
                    "matches": sum(season.evaluations.filter(pl.col("opponent") == against).height
                                   for season in seen),
                }
                for name, (value, pooling) in _COMPARED.items():
                    estimate, _ = pooled(map(evaluated(value, against, length), seen), pooling,
                                         min(map(pairs(against), seen)))
                    row |= _ends(name, estimate)
                rows.append(row)
    return _table(rows, (*_SIDES, "against"), ("games", "seasons", "matches"), tuple(_COMPARED))


def _games(season: SeasonTables) -> int:
    """Number of games of a season; 0 of a control."""
    return int(season.games["game"][-1]) if season.games.height else 0


def _last(value: pl.Expr, last: int) -> SeasonMeasure:
    """Measure: the mean of a value over the ten games up to ``last``, or over all if there are fewer."""
    return mean_in_games(value, max(1, last - LAST + 1), last)


def attributed(games: pl.DataFrame) -> pl.DataFrame:
    """Goals a game by kind, means over the seasons.

    Returns:
        One row for each settings and opponent: settings, opponent, seasons, and the apprentice's goals a
        game: all, by direct action, by indirect action, by error of the opponent, of unknown kind; then the
        same of the opponent (``_against``).
    """
    kept = games.join(distinct(games), on=[*_SIDES, "seed", "season"], how="semi")
    sums = {f"unknown{side}": pl.col("goals_against" if side else "goals_for") - pl.sum_horizontal(
        f"{kind}{side}" for kind in _KINDS) for side in ("", "_against")}
    means = [pl.col(name).mean() for name in ("goals_for", *_KINDS, "unknown", "goals_against",
                                              *(f"{kind}_against" for kind in _KINDS), "unknown_against")]
    by_season = kept.with_columns(**sums).group_by(*_SIDES, "season", maintain_order=True).agg(means)
    seasons = pl.len().cast(pl.Int64).alias("seasons")
    return by_season.group_by(_SIDES, maintain_order=True).agg(seasons, *means).sort(_SIDES)


def seasons_played(games: pl.DataFrame) -> pl.DataFrame:
    """Overview of the seasons, one row for each settings and opponent.

    Returns:
        Columns settings, opponent, seasons, seeds (as text), games, lead (goals that the apprentice started
        ahead by, as ``0; from game 11: 5``), minutes a game, situations a game, and the newest versions of
        knowledge and policy at the seasons' ends (least to greatest).
    """
    kept = games.join(distinct(games), on=[*_SIDES, "seed", "season"], how="semi").sort("season", "game")
    rows = []
    for (settings, opponent), mine in kept.partition_by(_SIDES, as_dict=True).items():
        seasons = mine.group_by("season", "seed").agg(
            pl.col("game").max(), pl.col("knowledge_version", "policy_version").max()).sort("seed")
        rows.append({
            "settings": settings, "opponent": opponent, "seasons": seasons.height,
            "seeds": ", ".join(map(str, seasons["seed"])), "games": _span(seasons["game"]),
            "lead": _leads(mine), "minutes": mine["duration_s"].mean() / 60,  # type: ignore[operator]
            "situations": mine["situations"].mean(),
            "knowledge": _span(seasons["knowledge_version"]), "policy": _span(seasons["policy_version"]),
        })
    return pl.DataFrame(rows).sort(_SIDES)


def _leads(games: pl.DataFrame) -> str:
    """Lead of the games in words, as it changes in the longest season."""
    longest = games.sort("game", descending=True)["season"][0]
    season = games.filter(pl.col("season") == longest).sort("game")
    changes = season.filter(pl.col("lead").ne_missing(pl.col("lead").shift(1))).select("game", "lead")
    return "; ".join(f"from game {game}: {lead}" if game > 1 else str(lead)
                     for game, lead in changes.iter_rows())


def _span(values: pl.Series) -> str:
    """Range of values in words: ``35``, or ``20 to 35``; a dash if there is none."""
    known = sorted(set(values.drop_nulls().to_list()))
    if not known:
        return "–"
    return f"{known[0]} to {known[-1]}" if len(known) > 1 else str(known[0])


def _ends(name: str, estimate: Estimate) -> dict[str, float]:
    """Columns of an estimate: its name, and the same with ``_low`` and ``_high``."""
    return {f"{name}{end}": number for end, number in zip(_ENDS, estimate, strict=True)}


def _table(
    rows: list[dict[str, object]], strings: Sequence[str], integers: Sequence[str], estimates: Sequence[str]
) -> pl.DataFrame:
    """Table of the rows, with these columns in this order; null where an estimate is not defined."""
    ends = [f"{name}{end}" for name in estimates for end in _ENDS]
    types = {**dict.fromkeys(strings, pl.String()), **dict.fromkeys(integers, pl.Int64()),
             **dict.fromkeys(ends, pl.Float64())}
    return pl.DataFrame(rows, schema=types).with_columns(pl.col(ends).fill_nan(None))
