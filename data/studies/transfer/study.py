"""Teams that learned in our arena, in others' simulators: the same laws and seeds in rSim and pSim.

``study.py RSIM PSIM DATA TEAM...``, as ``make transfer`` calls it (three minutes for a team in pSim, half an
hour in rSim; what was stopped goes on). RSIM and PSIM are Pythons with rc-robosim and with pSim, or ``-``;
DATA has the seasons of the teams that are named.

Each team plays twenty matches of eight minutes against the static team, in pairs of one seed with sides
swapped: in our arena, in rSim 1.2 and in pSim 0.2.4, which compute only the motion of bodies by wheels. Our
referee watches all. rSim takes steps of whole milliseconds, 17 instead of 16.67; both have masses, friction
and motors of their own. Controls: the best constant team and the random team, which learned nothing.
``transfer.csv`` has a row for each team and simulator: goal difference a match with Student's interval over
the pairs. Rows of what is not played stay.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl
from harness import Parts, going_on, of_pairs

from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import MatchSettings, Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.laws import RefereeSettings
from pitchlore.pipeline.engine.teams import entrant
from pitchlore.pipeline.game.bodies import BALL, COLUMNS, OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.live.encoding import WHEEL_M
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.store import Store

#: Seeds that nothing was chosen on.
SEEDS = range(2_400_000, 2_400_010)
CONTROLS = ("best-constant", "random")
HOW = MatchSettings(referee=RefereeSettings(duration_s=480.0)).of_match()
STATIC = TeamSettings(kind="static")
#: The programs that let others' simulators take steps, and their arguments.
_HERE = Path(__file__).parent
SERVERS = {"rSim 1.2": (_HERE / "rsim_server.py", "3", "17"), "pSim 0.2.4": (_HERE / "psim_server.py", "3")}


class TheirArena:
    """Bodies that another's simulator moves, as ``pipeline.arena.physics.arena.Arena`` moves them."""

    def __init__(self, python: str, simulator: str, robots: int = 3) -> None:
        self._robots = robots
        self.bodies: F64 = np.zeros((1 + 2 * robots, COLUMNS))
        self._server = subprocess.Popen(  # noqa: S603 (a program of ours)
            [python, *SERVERS[simulator]], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.field = self._answer()

    def place(self, bodies: F64) -> None:
        """Give all bodies new places; robots stand."""
        ball = bodies[BALL, [X, Y, VX, VY]].tolist()
        robots = np.column_stack((bodies[1:, X], bodies[1:, Y], np.degrees(bodies[1:, THETA]))).tolist()
        self._ask({"place": [ball, robots[: self._robots], robots[self._robots:]]})

    def frame(self, wheels: F64) -> F64:
        """Advance by one frame."""
        self._ask({"wheels": (wheels / WHEEL_M).tolist()})
        return self.bodies

    def move(self, match: MatchInPlay) -> None:
        """Move the bodies of a match from here on, in place of our arena."""
        self.bodies[:] = match.bodies
        match._arena, match.bodies = self, self.bodies  # type: ignore[assignment]

    def close(self) -> None:
        """End the simulator."""
        self._server.communicate()

    def _ask(self, what: dict[str, object]) -> None:
        assert self._server.stdin is not None
        self._server.stdin.write(json.dumps(what) + "\n")
        self._server.stdin.flush()
        state = np.array(self._answer())
        self.bodies[BALL] = state[0], state[1], 0.0, state[3], state[4], 0.0
        rows = state[5:].reshape(2 * self._robots, 6)
        self.bodies[1:, :] = rows[:, [0, 1, 2, 3, 4, 5]]
        turned = np.radians(rows[:, 2])
        self.bodies[1:, THETA] = np.arctan2(np.sin(turned), np.cos(turned))
        self.bodies[1:, OMEGA] = np.radians(rows[:, 5])

    def _answer(self) -> object:
        assert self._server.stdout is not None
        line = self._server.stdout.readline()
        assert line, "the simulator has ended"
        return json.loads(line)


def difference(store: Store, word: str, seed: int, home: bool, arena: TheirArena | None) -> int:
    """Goals of a team less those of static in one match, in another's arena or in ours."""
    policies: dict[str, PolicyTables] = {}
    team = entrant(store, word, policies).settings
    sides = (team, STATIC) if home else (STATIC, team)
    recipe = Recipe(**HOW, home=sides[0], away=sides[1], seed=seed)
    match = MatchInPlay(recipe, controllers_of(recipe, policies), logged=False)
    if arena is not None:
        arena.move(match)
    while match.advance(1024):
        pass
    own, other = match.score if home else match.score[::-1]
    return own - other


def rows(
    store: Store, pythons: Sequence[str], words: Sequence[str], seeds: Sequence[int], parts: Parts
) -> list[dict[str, object]]:
    """A row for each team and simulator; a Python for each of the others' simulators, or ``-``."""
    there = {
        name: TheirArena(python, name) for name, python in zip(SERVERS, pythons, strict=True) if python != "-"
    }

    def pair(job: tuple[str, str, int]) -> float:
        word, name, seed = job
        return float(
            np.mean([difference(store, word, seed, home, there.get(name)) for home in (True, False)]))

    found: list[dict[str, object]] = []
    for word in (*CONTROLS, *words):
        for name in ("our arena", *there):
            pairs = parts([(word, name, seed) for seed in seeds], pair)
            found.append({"team": word, "simulator": name, **of_pairs(pairs)})
            print(found[-1], flush=True)
    for arena in there.values():
        arena.close()
    return found


def main(
    out: Path, pythons: Sequence[str], data: Path, words: Sequence[str], seeds: Sequence[int] = SEEDS
) -> None:
    """Play, and put the rows into the table."""
    with going_on(out, __file__) as parts:
        found, path = pl.DataFrame(rows(Store(data), pythons, words, seeds, parts)), out / "transfer.csv"
        if path.exists():
            found = pl.concat([found, pl.read_csv(path).join(found, on=("team", "simulator"), how="anti")])
        found.sort("team", "simulator").write_csv(path, float_precision=2)


if __name__ == "__main__":
    main(Path(__file__).parent, sys.argv[1:3], Path(sys.argv[3]), sys.argv[4:])
