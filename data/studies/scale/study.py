"""Cost of a run as the league grows: seconds of CPU and of the clock, memory, tasks, files.

``make bench-scale`` (an hour; what was stopped goes on after the last size that had ended), or ``study.py 10
100`` for other sizes. For each number of matches of one minute, in a data folder of its own with a Prefect
home of its own: play them (`record`), bring everything up to date from nothing (`run`), again with nothing
new, again with one more match, the same with a Prefect server that stays, and ask four questions. All
processes of a command count. ``scale.csv`` grows with each size.
"""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from threading import Event, Thread
from typing import NamedTuple

import polars as pl
from harness import PITCHLORE, going_on

SIZES = (10, 100, 1_000)
#: The command that plays the league's matches.
PLAYING = ("record", "--away", "human-like", "--minutes", 1)
#: README's question, and three of docs/how-to/sql.md's kinds: over situations, over samples, over matches.
QUESTIONS = {
    "goals after situations": """
        select team, name, count(*) as n, avg((exists (from goals g where g.match_id = s.match_id
            and g.team = s.team and g.t_ns - s.start_ns between 0 and 5e9))::int) as goal_within_5s
        from situations s where code in (21, 44, 47) group by all order by name, team""",
    "situations by name": "select name, count(*) as n from situations group by all order by n desc",
    "mean speed": """
        select role, avg(sqrt(vx*vx + vy*vy)) as speed from trajectories group by all order by all""",
    "results": "select home, away, avg(score_home - score_away) as lead from matches group by all",
}


class Cost(NamedTuple):
    """Cost of a command.

    Attributes:
        matches: in the league.
        what: the command, in words.
        wall_s: seconds of the clock.
        cpu_s: seconds of CPU of all its processes.
        peak_mib: most memory of all its processes at once, MiB (sampled 10 times a second). What several
            processes share counts once: each has its proportional share.
        largest_mib: most memory of one process, MiB.
        tasks: tasks that Prefect's database has of it.
        database_mib: size of Prefect's database afterwards, MiB.
        files: files in the data folder afterwards.
    """

    matches: int
    what: str
    wall_s: float
    cpu_s: float
    peak_mib: float
    largest_mib: float
    tasks: int
    database_mib: float
    files: int


class Bench:
    """A league, and what commands on it cost.

    Args:
        root: an empty folder.
    """

    def __init__(self, root: Path) -> None:
        self.data, self.home = root / "league", root / "home"
        self.environment = {**os.environ, "PREFECT_HOME": str(self.home)}
        self.environment.pop("PREFECT_API_URL", None)

    def call(self, *words: object) -> subprocess.CompletedProcess[str]:
        """Run a command.

        Raises:
            CalledProcessError: if it fails.
        """
        called = [PITCHLORE, *map(str, words), "--data", str(self.data)]
        return subprocess.run(  # noqa: S603 (our own)
            called, env=self.environment, check=True, capture_output=True, text=True)

    def cost(self, matches: int, what: str, *words: object) -> Cost:
        """Run a command, and measure it."""
        before, tasks, begun = _cpu(), self._tasks(), time.monotonic()
        with _peak() as peak:
            self.call(*words)
        wall = time.monotonic() - begun
        return Cost(
            matches, what, round(wall, 2), round(_cpu() - before, 2), round(peak[0], 1), round(peak[1], 1),
            self._tasks() - tasks, round(self._database() / (1 << 20), 1),
            sum(1 for path in self.data.rglob("*") if path.is_file()))

    def _databases(self) -> list[Path]:
        return [*self.home.glob("prefect*.db"), *(self.data / "server").glob("prefect-*.db")]

    def _database(self) -> int:
        return sum(path.stat().st_size for path in self._databases())

    def _tasks(self) -> int:
        count = 0
        for path in self._databases():
            with closing(sqlite3.connect(path)) as connection:
                count += connection.execute("select count(*) from task_run").fetchone()[0]
        return count


def _cpu() -> float:
    """Seconds of CPU of all children that have ended."""
    times = os.times()
    return times.children_user + times.children_system


@contextmanager
def _peak() -> Iterator[list[float]]:
    """The most memory of the descendants of this process while the body runs, MiB: of all at once, of one."""
    most, done = [0.0, 0.0], Event()

    def watch() -> None:
        while not done.wait(0.1):
            shares = _shares()
            most[:] = max(most[0], sum(shares)), max(most[1], *shares, 0.0)

    thread = Thread(target=watch)
    thread.start()
    try:
        yield most
    finally:
        done.set()
        thread.join()


def _shares() -> list[float]:
    """The proportional share of memory of each descendant of this process, MiB."""
    parents = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            with suppress(OSError):
                parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
    own, found = os.getpid(), list[float]()
    for process, parent in parents.items():
        above = parent
        while above in parents and above != own:
            above = parents[above]
        if above == own:
            with suppress(OSError):
                said = Path(f"/proc/{process}/smaps_rollup").read_text()
                found += [
                    int(line.split()[1]) / 1024 for line in said.splitlines() if line.startswith("Pss:")]
    return found


def measure(matches: int) -> list[Cost]:
    """The costs of a league of so many matches, command by command."""
    with tempfile.TemporaryDirectory(prefix="pitchlore-scale-") as root:
        bench = Bench(Path(root))
        found = [bench.cost(matches, "record", *PLAYING, "--matches", matches),
                 bench.cost(matches, "run from nothing", "run"), bench.cost(matches, "nothing new", "run")]
        bench.call(*PLAYING, "--seed", 1_000_001)
        found.append(bench.cost(matches + 1, "one more", "run"))
        bench.call("server", "start")
        try:
            bench.call(*PLAYING, "--seed", 1_000_002)
            found.append(bench.cost(matches + 2, "one more, with a server", "run"))
        finally:
            bench.call("server", "stop")
        return found + [
            bench.cost(matches + 2, f"sql: {what}", "sql", sql, "--csv") for what, sql in QUESTIONS.items()]


def main(out: Path, sizes: Sequence[int] = SIZES) -> None:
    """Measure, and write the table as it grows."""
    with going_on(out, __file__) as parts:
        for ended in range(1, len(sizes) + 1):
            rows = [cost for costs in parts(sizes[:ended], measure) for cost in costs]
            pl.DataFrame(rows, schema=list(Cost._fields), orient="row").write_csv(out / "scale.csv")
            print(*rows[-8:], sep="\n", flush=True)


if __name__ == "__main__":
    main(Path(__file__).parent, [int(word) for word in sys.argv[1:]] or SIZES)
