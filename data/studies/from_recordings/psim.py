"""A team from its recordings in another's simulator: recorded in pSim, copied, and played there.

``psim.py PSIM DATA [TEAM...]``, as ``make from-recordings-psim PSIM=PYTHON`` calls it. PSIM is a Python with
pSim 0.2.4, DATA the folder in which ``study.py`` has learned. Each demonstrator plays 30 matches against
static in pSim, under our laws; its copy is learned from their poses. Then the team, this copy, and controls
play static there: 20 matches of eight minutes, in pairs of one seed with sides swapped. ``psim.csv`` has
goals a match more than static. What was done is kept: a study that was stopped goes on.

Controls: the copy that ``study.py`` made of as many recordings from our arena; and a copy of those from pSim
whose clues were dealt out anew. Options are recovered by executors that drive as our arena's robots do; one
copy was told how pSim's drive (``ROBOTS``). Another measures that in recordings (``MEASURED``), with trees
for clues that were fitted to arenas drawn at random (:mod:`options.drawn`): its settings and trees were fixed
on ``looking-held-static-4302`` (seeds from 4,481,000 on), its aims, kappa .5 by classes in the first eight
recordings and that of the study, before these were looked at and it was played. The ceiling is a copy that
was told what was executed. Demonstrators, seeds, rows and the aim (that of ``study.py``:
80 % of the team's lead, lower bound 60 %) were written down before a match was played there.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

import numpy as np
from from_recordings.executed import clone, executed
from from_recordings.study import (
    FOLDER,
    LOGS_OPTIONS,
    NAME,
    PPO,
    TABLES,
    TEAMS,
    Job,
    Study,
    ahead,
    keep,
    recorded,
    shuffled,
    write,
)
from harness import Parts, going_on, of_pairs
from transfer.study import TheirArena

from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.engine.imitations import settings_of
from pitchlore.pipeline.settings import OptionSettings, Settings
from pitchlore.pipeline.store import Store

SIMULATOR = "pSim 0.2.4"
#: Demonstrators in the order in which they are played; so many as there is time for.
DEMONSTRATORS = (TEAMS[0], "best-constant", TEAMS[1], PPO, "pressing")
#: Recorded matches, pairs that are played, and their first seeds.
RECORDED, PAIRS, FIRST_RECORDED, FIRST_PLAYED = 30, 10, 4_460_000, 4_470_000
#: Robots as pSim drives them: 30 rad/s at wheels of 25 mm that are 75 mm apart, reached in a frame of ours.
ROBOTS = OptionSettings(recover=True, wheel_speed=0.75, wheel_acceleration=45.0, axle=0.075)
#: Robots as the recordings show them.
MEASURED = OptionSettings(recover=True, robots="measured")


@contextmanager
def moving(python: str) -> Iterator[Callable[[MatchInPlay], None]]:
    """Lets pSim move the bodies of matches, a program for each, for it keeps something for the next."""
    with ExitStack() as programs:
        def move(match: MatchInPlay) -> None:
            arena = TheirArena(python, SIMULATOR, match.recipe.robots)
            programs.callback(arena.close)
            arena.move(match)

        yield move


def ahead_there(python: str, job: Job) -> int:
    """Goals that the team was ahead by in a match in pSim."""
    with moving(python) as move:
        return ahead(job, move)


def recordings(study: Study, team: str) -> list[tuple[Job, Path]]:
    """The recordings of a demonstrator in pSim; it plays home and away in turn."""
    return [(Job(str(study.data), team, FIRST_RECORDED + i, i % 2 == 1, False, study.seconds),
             study.data / "recordings" / f"{team}-psim" / f"{i:02d}.mcap") for i in range(study.recorded[-1])]


def learned(study: Study, team: str) -> Iterator[tuple[str, Path, str]]:
    """Kind, data folder and word of each team that plays for a demonstrator, and itself."""
    yield "itself", study.data, team
    files, plain = [path for _, path in recordings(study, team)], settings_of(Settings(), NAME)
    copied = study.run(team, f"psim-{len(files)}", files, plain)
    yield "copy, recorded in pSim", *copied
    yield "copy, recorded in our arena", *study.copy(team)
    dealt = study.data / "learned" / f"{team}-psim-shuffled"
    yield "copy, recorded in pSim, clues shuffled", *shuffled(Store(copied[0]), dealt)
    for kind, name, options in (("known", "told", ROBOTS), ("measured", "measured", MEASURED)):
        settings = plain.model_copy(update={"options": options})
        yield (f"copy, recorded in pSim, its robots {kind}",
               *study.run(team, f"psim-{name}-{len(files)}", files, settings))
    if team in LOGS_OPTIONS:
        root = study.data / "learned" / f"{team}-psim-done"
        if not (root / "appraisals.parquet").exists():
            keep(*clone(executed(Store(copied[0]), files)), root)
        yield "copy, recorded in pSim, options known", root, TABLES


def row(
    study: Study, python: str, parts: Parts, team: str, kind: str, data: Path, word: str
) -> dict[str, object]:  # fmt: skip
    """A row of the table: how far a team is ahead of static in pSim."""
    jobs = [Job(str(data), word, FIRST_PLAYED + place, away, False, study.seconds)
            for place in range(study.pairs) for away in (False, True)]
    found = np.array(parts(jobs, partial(ahead_there, python))).reshape(-1, 2).mean(axis=1)
    return {"demonstrator": team, "team": kind, **of_pairs(found.tolist())}


def main(
    python: str, study: Study, out: Path = FOLDER, teams: Sequence[str] = DEMONSTRATORS
) -> None:
    """Play what is missing, and put the rows into the table; those of teams that are not played stay."""
    with going_on(out, __file__) as parts:
        for team in teams:
            for job, path in recordings(study, team):
                with moving(python) as move:
                    recorded(job, path, move)
            made = partial(row, study, python, parts, team)
            rows = list[dict[str, object]]()
            for kind, data, word in learned(study, team):
                rows.append(made(kind, data, word))
                print(rows[-1], flush=True)
                write(rows, out / "psim.csv")


if __name__ == "__main__":
    main(sys.argv[1], Study(Path(sys.argv[2]), recorded=(RECORDED,), pairs=PAIRS),
         teams=sys.argv[3:] or DEMONSTRATORS)
