"""Imitation gain: apprentices that start as the imitation of a team, beside those that start from nothing.

``make imitation-gain`` (over an hour on 2 cores, after ``make from-recordings``) plays ten pairs of seasons
of ``looking-held`` against static: eight games of ten matches. Of each pair, one season starts as the copy of
``looking-held-static-4301`` from its 30 recordings, poses alone; the other has the same seed and starts from
nothing. Both learn after each game from what they tried.

The area is the mean goal difference over the counted matches of a season; that of game n is played by what
was learned from 10 (n - 1) matches. The gain is the difference of the areas of a pair, with Student's
interval over the ten. The matches that a season needs to beat static by five are those before the first game
from which on the mean of it and the next is at least five. Both aims were written before any of these seeds
was played: a gain whose lower bound is above 0; at most a third of the matches, in the median.

The control was added when these seasons were known, and written down before it was played: seasons of the
first five seeds that start from *shuffled* habits. Those are learned as the copy's, from the same clues dealt
out anew among the windows of a role, so the apprentice is offered the same actions, and knows how often a
role takes each, but nothing of when. The aim: the area of those that start as the copy is greater, lower
bound of the five differences above 0. If it is not, the gain was that of a list of actions.

``gain.csv`` has a row for each season and counted game.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import polars as pl
from from_recordings.study import FOLDER, NAME, RECORDED, TEAMS, Study, dealt_clues, recorded
from harness import ROOT, seasons

from pitchlore.pipeline.engine.imitations import PREFIX, imitation_of, settings_of
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.face.league import League
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.settings import OptionSettings, Settings
from pitchlore.pipeline.stages.report.measures import DIFFERENCE
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made
from pitchlore.schemas import Clues, Games, Options

SETTINGS, TEACHER = "looking-held", TEAMS[0]
SEEDS, GAMES = range(4721, 4731), 8
#: Seeds of the control, and the team whose imitation has shuffled habits.
CONTROLS, SHUFFLED = SEEDS[:5], "shuffled"
#: A season beats static from this mean difference on.
AHEAD = 5.0
MATCHES_A_GAME = 10


def taught(study: Study, data: Path, teacher: str = TEACHER) -> None:
    """Rebuild the teacher from its recordings, and once more from shuffled clues, in folders of their own."""
    recordings = study.recordings(teacher, noisy=False)
    for job, path in recordings:
        recorded(job, path)
    own = imitation_of(Store(data), NAME)
    _rebuilt(own, *(path for _, path in recordings))
    control = imitation_of(Store(data), SHUFFLED)
    if not control.versions("policies"):
        shutil.copytree(own.root, control.root, dirs_exist_ok=True)
        for noun in ("knowledge", "policies"):
            shutil.rmtree(control.root / noun)
        _shuffle(control)
        _rebuilt(control)


def _rebuilt(store: Store, *files: Path) -> None:
    """Bring an imitation of the teacher up to date."""
    report = League(store).run(*files, settings=settings_of(Settings(), NAME))
    if report.failures:
        raise SystemExit(str(report.failures))


def _shuffle(store: Store) -> None:
    """Replace the clues to the teacher's options by :func:`from_recordings.study.dealt_clues`."""
    dealt = dealt_clues(store)
    for held in list(store.receipts("options")):
        clues = table_of(store, held, Clues).select(pl.exclude("ratios")).join(
            dealt.select("match_id", "team", "robot", "start_ns", "ratios"), how="inner",
            on=("match_id", "team", "robot", "start_ns"), maintain_order="left").select(list(Clues.dtypes()))
        work = STAGES["options"].work(held.name, OptionSettings.model_validate(held.settings), held.inputs)
        store.commit(work, Made([(table_of(store, held, Options), Options), (clues, Clues)],
                                details=held.details))


def played(
    data: Path, settings: str, seeds: Sequence[int], controls: Sequence[int], games: int,
) -> pl.DataFrame:  # fmt: skip
    """The counted games of all seasons: starts, seed, game, difference; missing seasons are played.

    Args:
        data: the data folder.
        settings: name of the settings of seasons.
        seeds: seeds of those that start as the copy, and of those that start from nothing.
        controls: seeds of those that start from shuffled habits.
        games: games of a season.
    """
    starts = {f"as-imitated-{NAME}": "as the copy", f"as-imitated-{SHUFFLED}": "from shuffled habits"}
    for start, own in ((NAME, seeds), (None, seeds), (SHUFFLED, controls)):
        words = ("--start", f"{PREFIX}{start}") if start else ()
        for first in range(0, len(own), 2):
            seasons(settings, own[first:first + 2], data, "--opponent", "static", "--games", games, *words)
    store, name = Store(data), Path(settings).stem
    rows = pl.concat([store.read_table(held, "games", Games) for held in store.receipts("seasons")])
    start_of = pl.col("settings").cast(pl.String).str.strip_prefix(name).str.strip_prefix("-")
    return rows.filter(pl.col("seed").is_in(seeds)).select(
        "seed", "game", starts=start_of.replace_strict(starts | {"": "from nothing"}), difference=DIFFERENCE,
    ).sort("starts", "seed", "game")


def needed(differences: Sequence[float]) -> int | None:
    """Matches that a season needs to beat static by :data:`AHEAD`; None if it never does."""
    pairs = pairwise(differences)
    return next((MATCHES_A_GAME * place for place, pair in enumerate(pairs) if sum(pair) / 2 >= AHEAD), None)


def summary(games: pl.DataFrame) -> str:
    """The area of each start, the gain over others with its interval, and the matches that were needed."""
    areas = games.pivot("starts", index="seed", values="difference", aggregate_function="mean")
    lines = []
    for other in sorted({*areas.columns} - {"seed", "as the copy"}):
        pairs = areas.drop_nulls(other)
        gains = (pairs["as the copy"] - pairs[other]).to_numpy()
        lines.append(f"gain over those that start {other} {gains.mean():+.1f} {mean_interval(gains)}")
    for (start, seed), own in games.group_by("starts", "seed", maintain_order=True):
        found = own.sort("game")["difference"].to_list()
        lines.append(f"{start}, {seed}: area {sum(found) / len(found):+.1f}, needs {needed(found)}")
    return "\n".join(lines)


def main(study: Study, out: Path = FOLDER, settings: str = SETTINGS, seeds: Sequence[int] = SEEDS,
         controls: Sequence[int] = CONTROLS, games: int = GAMES,
         teacher: str = TEACHER) -> pl.DataFrame:  # fmt: skip
    """Play what is missing, and write the table."""
    data = study.data / "gain"
    taught(study, data, teacher)
    table = played(data, settings, seeds, controls, games)
    table.write_csv(out / "gain.csv")
    print(summary(table))
    return table


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "data" / "from-recordings"
    main(Study(folder, recorded=RECORDED))
