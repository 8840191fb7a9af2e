"""Seasons of apprentices that watch an adversary, in two ways, beside those of apprentices that only try.

``study.py DATA`` (three hours on 2 cores; what is in the data folder is not played again).

An apprentice learns how its actions change the chance to score. There are two ways to watch an adversary
besides. In ``looking-imitates`` it also appraises actions that it has not tried, by what it saw the
adversary's robots do. In ``looking`` it is offered only the actions that it saw them do. In ``looking-all``
it watches nothing but itself, and all 31 actions are offered, as in ``looking-imitates``. The gain is the
difference of the areas under their learning curves: the mean goal difference over the 14 counted matches of a
season. Each is the first match of a game of ten: that of game n is played by what was learned from 10 (n - 1)
matches. The seasons are paired by seed, and the interval is Student's over the ten pairs. The aim, written
before these seeds were played: a lower bound above 0. The settings were chosen on other seeds (2101 to 2103
and 901 to 914).

``games.csv`` has a row for each season and counted game; ``gain.csv`` the areas and their differences.
"""

from __future__ import annotations

import sys
from pathlib import Path

import polars as pl
from harness import seasons

from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.stages.report.measures import DIFFERENCE
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Games

SEEDS = range(2301, 2311)
WATCHING, TRIES = ("looking-imitates", "looking"), "looking-all"
#: Games of an area, the first and the last: all; those in which there is least of an apprentice's own to
#: learn from; and the last ones, by which it plays afterwards.
PARTS = {"all games": (1, 14), "games 1 to 7": (1, 7), "games 11 to 14": (11, 14)}


def games(data: Path) -> pl.DataFrame:
    """The counted games of all seasons: settings, seed, game, difference; missing seasons are played."""
    for first in range(0, len(SEEDS), 2):
        for settings in (*WATCHING, TRIES):
            seasons(settings, SEEDS[first:first + 2], data, "--opponent", "static")
    store = Store(data)
    rows = pl.concat([store.read_table(receipt, "games", Games) for receipt in store.receipts("seasons")])
    return rows.filter(pl.col("settings").is_in((*WATCHING, TRIES)), pl.col("seed").is_in(SEEDS)).select(
        "settings", "seed", "game", difference=DIFFERENCE,
    ).sort("settings", "seed", "game")


def gain(played: pl.DataFrame) -> pl.DataFrame:
    """The areas and what watching adds to them, a row for each way to watch and part.

    Columns: settings, part, seasons, watches, tries, gain, low, high.
    """
    rows = []
    for watching in WATCHING:
        for part, (first, last) in PARTS.items():
            areas = played.filter(pl.col("game").is_between(first, last)).pivot(
                "settings", index="seed", values="difference", aggregate_function="mean")
            gains = (areas[watching] - areas[TRIES]).drop_nulls()
            low, high = mean_interval(gains.to_numpy()) or (None, None)
            rows.append({
                "settings": watching, "part": part, "seasons": gains.len(), "watches": areas[watching].mean(),
                "tries": areas[TRIES].mean(), "gain": gains.mean(), "low": low, "high": high})
    return pl.DataFrame(rows)


def main(out: Path, data: Path) -> None:
    """Play what is missing, and write the tables."""
    played = games(data)
    played.write_csv(out / "games.csv")
    gain(played).write_csv(out / "gain.csv", float_precision=2)


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1]))
