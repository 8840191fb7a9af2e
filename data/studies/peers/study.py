"""Peers on the same pitch, beside the apprentice that looks: matches that other learners need.

``study.py DATA``; what is in the data folder is neither trained nor played again, and a training that was
stopped goes on. ``--only matches`` trains nothing, ``--only tables`` plays nothing either: they take what is
there.

Peers are PPO and DQN of stable-baselines3, which play, and behaviour cloning and discrete CQL of d3rlpy,
which learn from what our apprentice's season logged. All train against the static team alone. They see what
our apprentice sees (30 numbers, and the role), decide at its clock (0.2 s), and choose among the 32
behaviours that robots have an action for. One network plays all robots of a team. The reward is goals; of
``-v`` it is goals, and the change of V (:mod:`peers.worth`); ``cql-v`` learns the change of V a
second later. Our apprentices are those of ``looking-held`` (:mod:`looking.study`), which are offered the
same behaviours. All teams meet in matches of the same seeds, which are those of that study.

Each library has an environment of its own: ``.venv-sb3`` and ``.venv-d3rlpy``, which ``make peers`` makes.
"""

from __future__ import annotations

import argparse
import os
import subprocess
from collections.abc import Iterator
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, as_completed, wait
from pathlib import Path
from typing import Literal

from harness import ROOT, workers
from looking.learners import HELD, STATIC
from looking.measuring import seasons
from peers.logged import decisions_of, export
from peers.results import row, write
from peers.teams import ALONE, OFFLINE, ONCE, ONLINE, WHOLE, Team, measured, networks, seeds_of, teams

from pitchlore.pipeline.arena.teams.panel import PANEL
from pitchlore.pipeline.store import Store


def trainings(data: Path, minutes: float) -> Iterator[list[str]]:
    """The commands that train the networks that are not there.

    Args:
        data: the data folder.
        minutes: minutes of one core that the first trainings of PPO and DQN take in all.
    """
    for learner in OFFLINE:
        for seed in seeds_of(learner):
            out = networks(data) / f"{learner}-{seed}-{ONCE}.npz"
            if not out.exists():
                yield _called("d3rlpy", "offline", learner, seed, _logged(data, seed), out)
    for learner, of_each in ONLINE.items():
        for seed, matches in zip(seeds_of(learner), of_each, strict=True):
            until = ("--minutes", minutes) if matches is None else ("--matches", matches)
            yield _called("sb3", "online", learner, seed, networks(data), *until)


def _called(library: str, module: str, *words: object) -> list[str]:
    """The command that runs a module of this study in the environment of a library."""
    return [f"{ROOT}/.venv-{library}/bin/python", "-m", f"peers.{module}", *map(str, words)]


def _logged(data: Path, seed: int) -> Path:
    """The file with the decisions of a season; it is written if it is not there."""
    path = data / "peers" / f"decisions-{seed}.npz"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        season = HELD.panel.words[HELD.seasons.index(seed)]
        export(decisions_of(Store(data), season), path)
    return path


def jobs(data: Path) -> Iterator[tuple[Team, str]]:
    """Teams and opponents that are to be measured: all against the static team first."""
    there = list(teams(data))
    yield from ((team, STATIC) for team in there if team.player != STATIC)
    most = {team.learner: max(own.matches for own in there if own.learner == team.learner) for team in there}
    for team in there:
        if team.learner not in ALONE and (team.matches in WHOLE or team.matches == most[team.learner]):
            yield from ((team, opponent) for opponent in PANEL if opponent not in (STATIC, team.player))


def train(data: Path, minutes: float) -> None:
    """Train the networks that are missing, two at once; where one fails, the others are not begun."""
    seasons([HELD.panel], data)
    environment = os.environ | {"PYTHONPATH": str(ROOT / "data" / "studies")}
    with ThreadPoolExecutor(2) as trainers:
        begun = [trainers.submit(subprocess.run, each, check=True, env=environment)
                 for each in trainings(data, minutes)]
        wait(begun, return_when=FIRST_EXCEPTION)
        trainers.shutdown(cancel_futures=True)
        for done in begun:
            done.result()


def main(
    out: Path, data: Path, minutes: float, pairs: int, only: Literal["matches", "tables"] | None
) -> None:
    """Train and play what is missing, and write the tables.

    Args:
        out: folder of the tables.
        data: the data folder.
        minutes: minutes of one core that PPO and DQN of the first seed train in all.
        pairs: number of pairs of matches for each team and opponent.
        only: "matches": train nothing. "tables": play nothing either.
    """
    if only is None:
        train(data, minutes)
    seeds = HELD.seeds[:pairs]
    with workers() as pool:
        waiting = {pool.submit(measured, data, team, opponent, seeds, only == "tables"): (team, opponent)
                   for team, opponent in jobs(data)}
        found = {waiting[done]: done.result() for done in as_completed(waiting)}
    write(out, [row(*job, found[job]) for job in waiting.values() if found[job].height])


if __name__ == "__main__":
    said = argparse.ArgumentParser(description=__doc__)
    said.add_argument("data", type=Path)
    said.add_argument("--minutes", type=float, default=120.0, help="of a core, of the first PPO and DQN")
    said.add_argument("--pairs", type=int, default=20, help="of each team and opponent (default 20)")
    said.add_argument("--only", choices=("matches", "tables"), help="train nothing; play nothing either")
    main(Path(__file__).parent, **vars(said.parse_args()))
