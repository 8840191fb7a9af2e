"""A team from its recordings in another's simulator: recorded in pSim, copied, and played there.

``psim.py PSIM DATA [TEAM...]``, as ``make from-recordings-psim PSIM=PYTHON`` calls it. PSIM is a Python with
pSim 0.2.4, DATA the folder in which ``study.py`` has learned. Each demonstrator plays 30 matches against
static in pSim, under our laws; its copy is learned from their poses. Then the team, this copy, and controls
play static there: 20 matches of eight minutes, in pairs of one seed with sides swapped. ``psim.csv`` has
goals a match more than static. What was done is kept: a study that was stopped goes on.

Options are recovered by executors that drive as our arena's robots do. The copy of each demonstrator measures
how pSim's drive in its recordings (``MEASURED``), with trees for clues that were fitted to arenas drawn at
random (:mod:`options.drawn`). Its control is the same policy, from the same clues dealt out anew. The others
are the copy that ``study.py`` made of as many recordings from our arena, and, as the ceiling, one that was
told what was executed. Of the first demonstrator (``TRIED``) there are copies with the trees of our arena,
too: as they are, with their clues dealt out anew, and told how pSim's robots drive (``ROBOTS``).

Demonstrators, seeds, rows and the aim (that of ``study.py``: 80 % of the team's lead, lower bound 60 %) were
written down before a match was played there; settings and trees of measured robots were fixed on
``looking-held-static-4302`` (seeds from 4,481,000 on), and their aim, kappa .5 by classes in the first eight
recordings, before these were looked at. After two mends in what the trees are fitted to they were fitted
anew, by the same seeds; nothing was chosen by what came out. That the copy is ahead of its own control in
pairs, lower bound above 0 (``AHEAD``), was first asked of the first demonstrator, when its copy was known;
for the others, whose rows are fewer for want of time, it was written down before they were played.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
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
from harness import Parts, going_on, of_pairs, workers
from transfer.study import TheirArena

from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.engine.imitations import settings_of
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.settings import MEASURED_TREES, OptionSettings, Settings
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
#: Demonstrators with copies by the trees of our arena, too.
TRIED = DEMONSTRATORS[:1]
#: The copy by measured robots, its control, and the row of how far it is ahead of that in pairs.
COPY = "copy, recorded in pSim, its robots measured"
CONTROL, AHEAD = f"{COPY}, clues shuffled", f"{COPY}, ahead of its clues shuffled"


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


def recorded_there(python: str, job: Job, path: Path) -> None:
    """Play a match in pSim and keep it, if it is not there."""
    with moving(python) as move:
        recorded(job, path, move)


def recordings(study: Study, team: str) -> list[tuple[Job, Path]]:
    """The recordings of a demonstrator in pSim; it plays home and away in turn."""
    return [(Job(str(study.data), team, FIRST_RECORDED + i, i % 2 == 1, False, study.seconds),
             study.data / "recordings" / f"{team}-psim" / f"{i:02d}.mcap") for i in range(study.recorded[-1])]


def learned(study: Study, team: str) -> Iterator[tuple[str, Path, str]]:
    """Kind, data folder and word of each team that plays for a demonstrator, and itself."""
    yield "itself", study.data, team
    yield "copy, recorded in our arena", *study.copy(team)
    files = [path for _, path in recordings(study, team)]

    def copy(name: str, options: OptionSettings | None = None) -> tuple[Path, str]:
        settings = settings_of(Settings() if options is None else Settings(options=options), NAME)
        return study.run(team, f"psim-{name}{len(files)}", files, settings)

    def dealt(root: Path, name: str) -> tuple[Path, str]:
        return shuffled(Store(root), study.data / "learned" / f"{team}-psim-{name}shuffled")

    if team in TRIED:
        root, word = copy("")
        yield "copy, recorded in pSim", root, word
        yield "copy, recorded in pSim, clues shuffled", *dealt(root, "")
        yield "copy, recorded in pSim, its robots known", *copy("told-", ROBOTS)
    root, word = copy("measured-", MEASURED)
    yield COPY, root, word
    yield CONTROL, *dealt(root, f"measured-{MEASURED_TREES}-")
    if team in LOGS_OPTIONS:
        told = study.data / "learned" / f"{team}-psim-done"
        if not (told / "appraisals.parquet").exists():
            keep(*clone(executed(Store(root), files)), told)
        yield "copy, recorded in pSim, options known", told, TABLES


def leads(study: Study, python: str, parts: Parts, pool: Executor, data: Path, word: str) -> F64:
    """Goals that a team is ahead of static by in pSim, mean of each pair of matches."""
    jobs = [Job(str(data), word, FIRST_PLAYED + place, away, False, study.seconds)
            for place in range(study.pairs) for away in (False, True)]
    found: F64 = np.array(parts(jobs, partial(ahead_there, python), pool), dtype=np.float64)
    pairs: F64 = found.reshape(-1, 2).mean(axis=1)
    return pairs


def main(
    python: str, study: Study, out: Path = FOLDER, teams: Sequence[str] = DEMONSTRATORS
) -> None:
    """Play what is missing, and put the rows into the table; those of teams that are not played stay."""
    with going_on(out, __file__) as parts, workers() as pool:
        for team in teams:
            list(pool.map(partial(recorded_there, python), *zip(*recordings(study, team), strict=True)))
            found = dict[str, F64]()
            for kind, data, word in learned(study, team):
                found[kind] = leads(study, python, parts, pool, data, word)
                print(team, kind, of_pairs(found[kind].tolist()), flush=True)
            found[AHEAD] = found[COPY] - found[CONTROL]
            write([{"demonstrator": team, "team": kind, **of_pairs(pairs.tolist())}
                   for kind, pairs in found.items()], out / "psim.csv")


if __name__ == "__main__":
    main(sys.argv[1], Study(Path(sys.argv[2]), recorded=(RECORDED,), pairs=PAIRS),
         teams=sys.argv[3:] or DEMONSTRATORS)
