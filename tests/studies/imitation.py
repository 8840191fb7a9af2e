"""Is watching worth anything? Ten seasons of apprentices that imitate, beside ten of those that only try.

``PYTHONPATH=tests python -m studies.imitation data/studies/imitation DATA`` (two hours on 2 cores; what is in
the data folder is not played again).

An apprentice learns how its actions change the chance to score. In ``looking-imitates`` it also appraises actions
that it has not tried, by what it saw its adversary's robots do. In ``looking-all`` it does not: it watches nothing
but itself, and all 31 actions are offered to both. The gain is the difference of the areas under their learning
curves: the mean goal difference over the 14 counted games of a season, of which each follows nine others. The
seasons are paired by seed, and the interval is Student's over the ten pairs. The aim, written before these seeds
were played: a lower bound above 0. The settings were chosen on other seeds (2101 to 2103 and 901 to 914).

``games.csv`` has a row for each season and counted game; ``gain.csv`` the areas of both and their difference, of
all games and of the first half.
"""

from __future__ import annotations

import sys
from pathlib import Path

import polars as pl
from studies.teams_apart import command

from pipeline.statistics import mean_interval
from pipeline.store import Store
from pipeline.studies.seasons.measures import DIFFERENCE
from schemas import Games

SEEDS = range(2301, 2311)
WATCHES, TRIES = "looking-imitates", "looking-all"
#: Games of an area: all, and the first half, in which there is least of an apprentice's own to learn from.
PARTS = {"all games": 14, "games 1 to 7": 7}


def games(data: Path) -> pl.DataFrame:
    """The counted games of both kinds of seasons, those that are missing played first: settings, seed, game, difference."""
    for seed in SEEDS[::2]:
        for settings in (WATCHES, TRIES):
            command("season", "--settings", settings, "--opponent", "static", "--seed", str(seed),
                    "--seasons", "2", "--discard", "--data", str(data))
    store = Store(data)
    rows = pl.concat([store.read_table(receipt, "games", Games) for receipt in store.receipts("seasons")])
    return rows.filter(pl.col("settings").is_in((WATCHES, TRIES)), pl.col("seed").is_in(SEEDS)).select(
        "settings", "seed", "game",
        difference=DIFFERENCE,
    ).sort("settings", "seed", "game")


def gain(played: pl.DataFrame) -> pl.DataFrame:
    """The areas of both and their difference, a row a part: part, seasons, watches, tries, gain, low, high."""
    rows = []
    for part, last in PARTS.items():
        areas = played.filter(pl.col("game") <= last).pivot(
            "settings", index="seed", values="difference", aggregate_function="mean")
        gains = (areas[WATCHES] - areas[TRIES]).drop_nulls()
        low, high = mean_interval(gains.to_numpy()) or (None, None)
        rows.append({"part": part, "seasons": gains.len(), "watches": areas[WATCHES].mean(),
                     "tries": areas[TRIES].mean(), "gain": gains.mean(), "low": low, "high": high})
    return pl.DataFrame(rows)


def main(out: Path, data: Path) -> None:
    """Play what is missing, and write the tables."""
    out.mkdir(parents=True, exist_ok=True)
    played = games(data)
    played.write_csv(out / "games.csv")
    gain(played).write_csv(out / "gain.csv", float_precision=2)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
