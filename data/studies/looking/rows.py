"""Rows of the study's tables, and the tables as files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import polars as pl
from looking.learners import ALIKE, ARMS

from pitchlore.pipeline.numbers.statistics import mean_interval


def row(word: str, arm: str, opponent: str, pairs: pl.DataFrame) -> dict[str, object]:
    """A team in an arm, with the interval over its pairs."""
    low, high = mean_interval(pairs["difference"].to_numpy()) or (None, None)
    return {"team": word, "arm": arm, "opponent": opponent, "matches": 2 * pairs.height,
            "difference": pairs["difference"].mean(), "low": low, "high": high}


def together(found: pl.DataFrame) -> pl.DataFrame:
    """The apprentices of both settings in arms that differ in nothing else.

    Args:
        found: results.csv.

    Returns:
        Columns arm, opponent, apprentices, difference, low, high.
    """
    rows = []
    for alike in ALIKE:
        own = found.filter(pl.col("arm").is_in([arm.name for arm in alike]))
        for opponent in alike[0].opponents:
            values = own.filter(opponent=opponent)["difference"]
            low, high = mean_interval(values.to_numpy()) or (None, None)
            rows.append({"arm": alike[0].name, "opponent": opponent, "apprentices": len(values),
                         "difference": values.mean(), "low": low, "high": high})
    return pl.DataFrame(rows)


def replaced(path: Path, tables: Mapping[str, pl.DataFrame], digits: int) -> None:
    """Write the tables of learners into one; rows of other learners stay.

    Args:
        path: path of the table; column season has the settings.
        tables: rows by the settings of the seasons.
        digits: decimals of its numbers.
    """
    there = pl.read_csv(path).partition_by("season", as_dict=True) if path.exists() else {}
    for season, own in tables.items():
        there[season,] = own.select(pl.lit(season).alias("season"), pl.all())
    rows = [there[season,] for season in ARMS if (season,) in there]
    pl.concat(rows, how="vertical_relaxed").write_csv(path, float_precision=digits)
