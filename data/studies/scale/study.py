"""Cost of a run as the league grows: seconds of CPU and of the clock, memory, files.

``make bench-scale`` (seven minutes; what was stopped goes on after the last size that had ended), or
``study.py 10 10000`` for other sizes. For each number of matches, in a data folder of its own: play them
(`record`), bring everything up to date from nothing (`run`), again with nothing new, again with one more
match, the same by states; ask four questions; look again after a change; check every byte. All processes of
a command count. Matches have a minute, in leagues of more than 1,000 twenty seconds. ``scale.csv`` grows
with each size.

``study.py --league FOLDER`` measures a league that is there, and changes it: all but the first two.
``copies.py`` makes one of many matches.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread
from typing import NamedTuple

import polars as pl
from harness import PITCHLORE, going_on

SIZES = (10, 100, 1_000)
#: The command that plays matches; their length, and that in leagues of more than so many.
PLAYING = ("record", "--away", "human-like", "--minutes")
MINUTES, SHORT, MANY = 1.0, 1 / 3, 1_000
#: Settings of a run whose policies go by states.
BY_STATES = '[policies]\nlearner = "sarsa"\n'
#: The row of a command that ends when every byte was read.
CHECK = "verify"
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
        minutes: length of a match.
        what: the command, in words.
        wall_s: seconds of the clock.
        cpu_s: seconds of CPU of all its processes, user and system.
        peak_mib: most memory of all its processes at once, MiB (sampled 5 times a second). What several
            processes share counts once: each has its proportional share.
        largest_mib: most memory of one process, MiB.
        files: files in the data folder afterwards.
        mib: size of all of them, MiB.
    """

    matches: int
    minutes: float
    what: str
    wall_s: float
    cpu_s: float
    peak_mib: float
    largest_mib: float
    files: int
    mib: float


class Bench:
    """A league, and what commands on it cost.

    Args:
        data: its data folder.
        matches: number of its matches, for the length of those that are played.
    """

    def __init__(self, data: Path, matches: int) -> None:
        self.data = data
        self.minutes = SHORT if matches > MANY else MINUTES

    def call(self, *words: object) -> subprocess.CompletedProcess[str]:
        """Run a command.

        Raises:
            CalledProcessError: if it fails.
        """
        called = [PITCHLORE, *map(str, words), "--data", str(self.data)]
        return subprocess.run(called, check=True, capture_output=True, text=True)  # noqa: S603 (our own)

    def play(self, seed: int) -> None:
        """Play one more match."""
        self.call(*PLAYING, self.minutes, "--seed", seed)

    def cost(self, matches: int, what: str, *words: object) -> Cost:
        """Run a command, and measure it."""
        before, begun = _cpu(), time.monotonic()
        with _peak() as peak:
            self.call(*words)
        wall = time.monotonic() - begun
        sizes = [path.stat().st_size for path in self.data.rglob("*") if path.is_file()]
        found = Cost(
            matches, round(self.minutes, 2), what, round(wall, 2), round(_cpu() - before, 2),
            round(peak[0], 1), round(peak[1], 1), len(sizes), round(sum(sizes) / (1 << 20), 1))
        print(found, file=sys.stderr, flush=True)
        return found


def _cpu() -> float:
    """Seconds of CPU of all children that have ended."""
    times = os.times()
    return times.children_user + times.children_system


@contextmanager
def _peak() -> Iterator[list[float]]:
    """The most memory of the descendants of this process while the body runs, MiB: of all at once, of one."""
    most, done = [0.0, 0.0], Event()

    def watch() -> None:
        while not done.wait(0.2):
            shares = [_share(process) for process in _descendants(os.getpid())]
            most[:] = max(most[0], sum(shares)), max(most[1], *shares, 0.0)

    thread = Thread(target=watch)
    thread.start()
    try:
        yield most
    finally:
        done.set()
        thread.join()


def _descendants(process: int) -> Iterator[int]:
    """The processes that a process has started, and theirs."""
    for children in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(OSError):
            for child in map(int, children.read_text().split()):
                yield child
                yield from _descendants(child)


def _share(process: int) -> float:
    """The proportional share of memory of a process, MiB."""
    with suppress(OSError):
        for line in Path(f"/proc/{process}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return int(line.split()[1]) / 1024
    return 0.0


def measure(matches: int) -> list[Cost]:
    """The costs of a league of so many matches, command by command, from nothing on."""
    with tempfile.TemporaryDirectory(prefix="pitchlore-scale-") as root:
        bench = Bench(Path(root) / "league", matches)
        return [bench.cost(matches, "record", *PLAYING, bench.minutes, "--matches", matches),
                bench.cost(matches, "run from nothing", "run"), *measure_there(bench, matches)]


def measure_there(bench: Bench, matches: int) -> list[Cost]:
    """The costs of commands on a league of so many matches that is up to date."""
    found = [bench.cost(matches, "nothing new", "run")]
    bench.play(1_000_001)
    found.append(bench.cost(matches + 1, "one more", "run"))
    settings = bench.data.parent / "by-states.toml"
    settings.write_text(BY_STATES, encoding="utf-8")
    found.append(bench.cost(matches + 1, "the first by states", "run", "--settings", settings))
    bench.play(1_000_002)
    found.append(bench.cost(matches + 2, "one more by states", "run", "--settings", settings))
    asked = ("sql", "select 1")
    found += [bench.cost(matches + 2, f"sql: {what}", "sql", sql, "--csv") for what, sql in QUESTIONS.items()]
    found.append(bench.cost(matches + 2, "sql: select 1", *asked))
    os.utime(next((bench.data / "situations").glob("*.receipt.json")))
    return [*found, bench.cost(matches + 2, "sql: select 1, after a change", *asked),
            bench.cost(matches + 2, CHECK, CHECK)]


def main(out: Path, sizes: Sequence[int] = SIZES) -> None:
    """Measure, and write the table as it grows."""
    with going_on(out, __file__) as parts:
        for ended in range(1, len(sizes) + 1):
            rows = [cost for costs in parts(sizes[:ended], measure) for cost in costs]
            pl.DataFrame(rows, schema=list(Cost._fields), orient="row").write_csv(out / "scale.csv")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--league"]:
        league = Path(sys.argv[2])
        there = sum(1 for _ in (league / "matches").glob("*.receipt.json"))
        measure_there(Bench(league, there), there)
    else:
        main(Path(__file__).parent, [int(word) for word in sys.argv[1:]] or SIZES)
