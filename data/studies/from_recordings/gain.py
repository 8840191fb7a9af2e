"""Imitation gain: apprentices that start as the imitation of a team, beside those that start from nothing.

``make imitation-gain`` (an hour on 2 cores, after ``make from-recordings``) plays ten pairs of seasons of
``looking-held`` against static: eight games of ten matches. Of each pair, one season starts as the copy of
``looking-held-static-4301`` from its 30 recordings, poses alone; the other has the same seed and starts from
nothing. Both learn after each game from what they tried.

The area is the mean goal difference over the counted matches of a season; that of game n is played by what
was learned from 10 (n - 1) matches. The gain is the difference of the areas of a pair, with Student's
interval over the ten. The matches that a season needs to beat static by five are those before the first game
from which on the mean of it and the next is at least five. Both aims were written before any of these seeds
was played: a gain whose lower bound is above 0; at most a third of the matches, in the median.

``gain.csv`` has a row for each season and counted game.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import polars as pl
from from_recordings.study import FOLDER, NAME, RECORDED, TEAMS, Study, recorded
from harness import ROOT, seasons

from pitchlore.pipeline.engine.imitations import PREFIX, imitation_of, settings_of
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.stages.report.measures import DIFFERENCE
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Games

SETTINGS, TEACHER = "looking-held", TEAMS[0]
SEEDS, GAMES = range(4721, 4731), 8
#: A season beats static from this mean difference on.
AHEAD = 5.0
MATCHES_A_GAME = 10


def taught(study: Study, data: Path, teacher: str = TEACHER) -> None:
    """Rebuild the teacher from its recordings, in a data folder of its own."""
    recordings = study.recordings(teacher, noisy=False)
    for job, path in recordings:
        recorded(job, path)
    files = [path for _, path in recordings]
    report = League(imitation_of(Store(data), NAME)).run(*files, settings=settings_of(Settings(), NAME))
    if report.failures:
        raise SystemExit(str(report.failures))


def played(data: Path, settings: str, seeds: Sequence[int], games: int) -> pl.DataFrame:
    """The counted games of all seasons: starts, seed, game, difference; missing seasons are played."""
    for first in range(0, len(seeds), 2):
        for words in (("--start", f"{PREFIX}{NAME}"), ()):
            seasons(settings, seeds[first:first + 2], data, "--opponent", "static", "--games", games, *words)
    store = Store(data)
    rows = pl.concat([store.read_table(held, "games", Games) for held in store.receipts("seasons")])
    return rows.filter(pl.col("seed").is_in(seeds)).select(
        "seed", "game", starts=pl.when(pl.col("settings") == Path(settings).stem).then(pl.lit("from nothing"))
        .otherwise(pl.lit("as the copy")), difference=DIFFERENCE,
    ).sort("starts", "seed", "game")


def needed(differences: Sequence[float]) -> int | None:
    """Matches that a season needs to beat static by :data:`AHEAD`; None if it never does."""
    pairs = pairwise(differences)
    return next((MATCHES_A_GAME * place for place, pair in enumerate(pairs) if sum(pair) / 2 >= AHEAD), None)


def summary(games: pl.DataFrame) -> str:
    """The area of each start, the gain with its interval, and the matches that were needed."""
    areas = games.pivot("starts", index="seed", values="difference", aggregate_function="mean")
    gains = (areas["as the copy"] - areas["from nothing"]).to_numpy()
    lines = [f"gain {gains.mean():+.1f} {mean_interval(gains)}"]
    for (start, seed), own in games.group_by("starts", "seed", maintain_order=True):
        found = own.sort("game")["difference"].to_list()
        lines.append(f"{start}, {seed}: area {sum(found) / len(found):+.1f}, needs {needed(found)}")
    return "\n".join(lines)


def main(study: Study, out: Path = FOLDER, settings: str = SETTINGS, seeds: Sequence[int] = SEEDS,
         games: int = GAMES, teacher: str = TEACHER) -> pl.DataFrame:  # fmt: skip
    """Play what is missing, and write the table."""
    data = study.data / "gain"
    taught(study, data, teacher)
    table = played(data, settings, seeds, games)
    table.write_csv(out / "gain.csv")
    print(summary(table))
    return table


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "data" / "from-recordings"
    main(Study(folder, recorded=RECORDED))
