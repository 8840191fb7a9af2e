"""Other recordings, another copy: how much copies of one team differ that were learned from other matches.

``sets.py [DATA [TEAM...]]``, after ``study.py``, takes the 30 recordings of a demonstrator as six sets of
five. The copy of each plays the same pairs of matches against static as those of ``goals.csv``, whose column
"copy of 5" is the first set. ``sets.csv`` has a row for each set, with Student's interval over pairs, and one
for all: its interval is over sets, ``between`` is the standard deviation of the sets' means, and ``alone``
what that would be if sets were alike, and pairs alone differed. Teams and sets were written down before any
set but the first was played. What was done is kept: a study that was stopped goes on.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path

import numpy as np
import polars as pl
from from_recordings.study import FOLDER, NAME, PPO, TEAMS, Study, ahead, recorded, write
from harness import ROOT, Parts, going_on, of_pairs, workers

from pitchlore.pipeline.engine.imitations import settings_of
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.settings import Settings

#: Teams whose copies are compared, an apprentice and a script; the PPO if there is time.
COMPARED = (TEAMS[0], "static", PPO)
#: Recordings of a set.
OF_SET = 5


def rows(study: Study, parts: Parts, pool: Executor, team: str, of_set: int) -> list[dict[str, object]]:
    """The rows of a demonstrator: its sets, and all of them."""
    files = [path for _, path in study.recordings(team, noisy=False)]
    found, pairs = list[dict[str, object]](), []
    for first in range(0, len(files), of_set):
        own = files[first:first + of_set]
        data, word = study.copy(team, of_set) if first == 0 else study.run(
            team, f"from{first}-{of_set}", own, settings_of(Settings(), NAME))
        jobs = [job for place in range(study.pairs) for job in study.pair(place, data, word)]
        pairs.append(np.array(parts(jobs, ahead, pool)).reshape(-1, 2).mean(axis=1))
        found.append({"demonstrator": team, "recordings": f"{first} to {first + len(own) - 1}",
                      **of_pairs(pairs[-1].tolist()), "between": None, "alone": None})
        print(found[-1], flush=True)
    means, of_one = np.mean(pairs, axis=1), np.var(pairs, axis=1, ddof=1) / study.pairs
    low, high = mean_interval(means.tolist()) or (None, None)
    return [*found, {
        "demonstrator": team, "recordings": "all sets", "matches": 2 * np.size(pairs),
        "difference": float(means.mean()), "low": low, "high": high,
        "between": round(float(means.std(ddof=1)), 2), "alone": round(float(np.sqrt(of_one.mean())), 2)}]


def main(
    study: Study, out: Path = FOLDER, teams: Sequence[str] = COMPARED, of_set: int = OF_SET
) -> pl.DataFrame:
    """Play what is missing, and put the rows into the table; those of teams that are not played stay."""
    with going_on(out, __file__) as parts, workers() as pool:
        for team in teams:
            list(pool.map(recorded, *zip(*study.recordings(team, noisy=False), strict=True)))
            write(rows(study, parts, pool, team, of_set), out / "sets.csv")
    return pl.read_csv(out / "sets.csv")


if __name__ == "__main__":
    given = dict(enumerate(sys.argv))
    main(Study(Path(given.get(1, ROOT / "data" / "from-recordings"))), teams=sys.argv[2:] or COMPARED)
