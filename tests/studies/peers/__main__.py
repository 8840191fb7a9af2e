"""How many matches do other learners need? Peers on the same pitch, beside the apprentice that looks.

``PYTHONPATH=tests python -m studies.peers data/studies/peers DATA``; what is in the data folder is neither trained
nor played again. ``--only matches`` trains nothing, ``--only tables`` plays nothing either: they take what is there.

Peers are PPO and DQN of stable-baselines3, which play, and behaviour cloning and discrete CQL of d3rlpy, which
learn from what our apprentice's season logged. All train against the static team alone. They see what our
apprentice sees (30 numbers, and the role), decide at its clock (0.2 s), and choose among the 32 behaviours that
robots have an action for. One network plays all robots of a team. The reward is goals; of ``-v`` it is goals, and
the change of V (:mod:`studies.peers.worth`); ``cql-v`` learns the change of V a second later, as our learner does.

Each library has an environment of its own: ``.venv-sb3`` and ``.venv-d3rlpy``, which ``make peers`` makes.
"""

from __future__ import annotations

import argparse
import os
import subprocess
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from pathlib import Path

from studies.peers.logged import decisions_of, export
from studies.peers.tables import row, write
from studies.peers.teams import (
    OFFLINE,
    ONCE,
    ONLINE,
    SETTINGS,
    STATIC,
    WHOLE,
    Team,
    measured,
    networks,
    season_of,
    teams,
)
from studies.teams_apart import command

from pipeline.arena.teams.panel import PANEL
from pipeline.store import Store

#: Seeds of the pairs of matches; they are used for nothing else.
FIRST_PAIR = 2_300_000
#: Numbers of matches at which learners are measured.
MEASURED = (0, 20, 40, 80, ONCE, 280, 560, 10 * ONCE, 2_800, 5_600, 11_200)


def trained(data: Path, seed: int, matches: int, minutes: float | None) -> list[list[str]]:
    """The commands that train the networks of a seed that are not there."""
    if Store(data).receipt("seasons", season_of(seed)) is None:
        command("season", "--settings", SETTINGS, "--seed", str(seed), "--data", str(data))
    todo, logged = [], data / "peers" / f"decisions-{seed}.npz"
    for learner in OFFLINE:
        out = networks(data) / f"{learner}-{seed}-{ONCE}.npz"
        if not out.exists():
            if not logged.exists():
                logged.parent.mkdir(parents=True, exist_ok=True)
                export(decisions_of(Store(data), season_of(seed)), logged)
            todo.append([".venv-d3rlpy/bin/python", "-m", "studies.peers.offline", learner, str(seed), str(logged),
                         str(out)])
    how = ["--minutes", str(minutes)] if minutes is not None else ["--matches", str(matches)]
    for learner in ONLINE:
        there = [int(path.stem.rsplit("-", 1)[1]) for path in networks(data).glob(f"{learner}-{seed}-*.npz")]
        if minutes is not None or max(there, default=0) < matches:
            todo.append([".venv-sb3/bin/python", "-m", "studies.peers.online", learner, str(seed),
                         str(networks(data)), *how])
    return todo


def jobs(data: Path, seeds: Sequence[int]) -> Iterator[tuple[Team, str]]:
    """Who has to be measured against whom: everybody against the static team first."""
    there = list(teams(data, seeds, MEASURED))
    yield from ((team, STATIC) for team in there if team.player != STATIC)
    most = {team.learner: max(own.matches for own in there if own.learner == team.learner) for team in there}
    for team in there:
        if team.matches in WHOLE or team.matches == most[team.learner]:
            yield from ((team, opponent) for opponent in PANEL if opponent not in (STATIC, team.player))


def main() -> None:
    """Read the command, train and play what is missing, and write the tables."""
    said = argparse.ArgumentParser(description=__doc__)
    said.add_argument("out", type=Path)
    said.add_argument("data", type=Path)
    said.add_argument("--seeds", type=int, nargs="+", default=[2101, 2102, 2103])
    said.add_argument("--matches", type=int, default=10 * ONCE, help="of a peer that plays (default 1,400)")
    said.add_argument("--minutes", type=float, help="that a peer plays, in place of matches")
    said.add_argument("--pairs", type=int, default=20, help="of matches, for each team and opponent (default 20)")
    said.add_argument("--processes", type=int, default=2)
    said.add_argument("--only", choices=("matches", "tables"), help="train nothing; play nothing either")
    given = said.parse_args()
    pairs = range(FIRST_PAIR, FIRST_PAIR + given.pairs)
    if given.only is None:
        todo = [each for seed in given.seeds for each in trained(given.data, seed, given.matches, given.minutes)]
        environment = os.environ | {"PYTHONPATH": "tests"}
        with ThreadPoolExecutor(given.processes) as trainers:
            for done in [trainers.submit(subprocess.run, each, check=True, env=environment) for each in todo]:
                done.result()
    with ProcessPoolExecutor(given.processes) as players:
        waiting = {players.submit(measured, given.data, team, opponent, pairs, given.only == "tables"): (team, opponent)
                   for team, opponent in jobs(given.data, given.seeds)}
        found = {waiting[done]: done.result() for done in as_completed(waiting)}
    write(given.out, [row(*job, found[job]) for job in waiting.values() if found[job].height])


if __name__ == "__main__":
    main()
