"""Others who work with the league: a Dask cluster, a match that is watched live, a second league in a bucket.

Each is an actor with a state of its own (:mod:`soak.actors`).
"""

from __future__ import annotations

import json
import random
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from soak.actors import CODES, COMMAND_S, END_S, Soak
from soak.questions import MADE_FROM, Judge, Row
from support import ssl_games
from support.buckets import FAULTS, Served

from pitchlore.pipeline.importers.packets.streams import LEAGUES


class Cluster:
    """A Dask scheduler and two workers, which are killed and started again.

    Attributes:
        on: word for ``--on``; empty while there is no scheduler.
    """

    def __init__(self, soak: Soak) -> None:
        self._soak, self._file, self.on = soak, soak.league.data.parent / "scheduler.json", ""
        self._there: dict[str, subprocess.Popen[bytes]] = {}

    def keep(self, rng: random.Random) -> None:
        """Start what has ended; now and then kill a worker."""
        for name in ("scheduler", "worker 1", "worker 2"):
            if name not in self._there or self._there[name].poll() is not None:
                self._soak.note("Dask started", name)
                self._start(name)
        self._soak.stop.wait(rng.uniform(20.0, 60.0))
        victim = self._there[rng.choice(("worker 1", "worker 2"))]
        if not self._soak.stop.is_set():
            victim.kill()
            victim.wait()
            self._soak.note("Dask workers killed", str(victim.pid))
            self._soak.stop.wait(2.0)

    def _start(self, name: str) -> None:
        words = ["worker", "--scheduler-file", str(self._file), "--nthreads", "1", "--no-nanny",
                 "--local-directory", str(self._file.with_name("dask"))]
        if name == "scheduler":
            self._file.unlink(missing_ok=True)
            words = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(self._file)]
        self._there[name] = subprocess.Popen(  # noqa: S603 (our own)
            [sys.executable, "-m", f"distributed.cli.dask_{words[0]}", *words[1:], "--no-dashboard"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=self._file.parent,
            **self._soak.league.users[0].popen)
        while name == "scheduler" and self._there[name].poll() is None and not self._soak.stop.wait(0.2):
            with suppress(OSError, ValueError):
                self.on = json.loads(self._file.read_text())["address"].replace("tcp:", "dask:")
                return

    def end(self) -> None:
        """Kill all of it."""
        for process in self._there.values():
            process.kill()
            process.wait()


class Watched(NamedTuple):
    """A match that was sent and watched.

    Attributes:
        sent: number of frames of vision that were sent.
        least: number of frames that its recording has at least.
    """

    sent: int
    least: int


class Live:
    """SSL matches, sent over loopback to ``watch`` and counted by their sender."""

    def __init__(self, soak: Soak) -> None:
        self._soak = soak
        self._waiting: dict[str, Watched] = {}

    def play(self, rng: random.Random) -> None:
        """Play a match of seconds; look which ones have become matches."""
        if self._soak.stop.wait(rng.uniform(20.0, 60.0)):
            return
        frames, user = rng.randrange(200, 500), rng.choice(self._soak.league.users)
        at = [word for stream in LEAGUES["ssl"] for word in ("--at", f"{stream.name}=127.0.0.1:0")]
        watching = subprocess.Popen(  # noqa: S603 (our own)
            self._soak.league.command("watch", "ssl", "--group", "127.0.0.1", *at, "--json"), text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, **user.popen)
        assert watching.stderr is not None
        told = watching.stderr.readline()
        ports = dict(re.findall(r"([\w-]+) at 127.0.0.1:(\d+)", told))
        if ports:
            self._send(frames, {stream.channel: int(ports[stream.name]) for stream in LEAGUES["ssl"]})
        kill = rng.random() < 0.25
        watching.send_signal(signal.SIGKILL if kill else signal.SIGINT)
        try:
            out, err = watching.communicate(timeout=END_S)
        except subprocess.TimeoutExpired:
            self._soak.find(f"watch does not end in {END_S:.0f} s")
            watching.kill()
            return
        self._soak.check_said(["watch"], told + err)
        if watching.returncode == 0:
            said = json.loads(out)
            self._waiting[Path(said["file"]).stem] = Watched(frames, said["packets"] - 2)
            if said["packets"] - 2 + said["frames_lost"] < frames - 1:
                self._soak.find(f"watch: {frames} frames were sent, it says {said}")
        killed = watching.returncode < 0 or watching.pid in self._soak.killed
        self._soak.note("live matches killed" if killed else "live matches watched",
                        f"{frames} frames sent, exit code {watching.returncode}: {(told + err)[-100:]!r}")
        if watching.returncode not in CODES and not killed:
            self._soak.find(f"watch ended with {watching.returncode}: {(told + err)[-300:]!r}")
        self.look()

    def _send(self, frames: int, ports: dict[int, int]) -> None:
        gc = ssl_games.Referee()
        messages = ssl_games.ordered(
            ssl_games.frames(frames), [gc.says(0, command=1), gc.says(40, command=2, stage=1)])
        begun = time.monotonic()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for number, message in enumerate(messages):
                time.sleep(max(0.0, begun + number * ssl_games.STEP - time.monotonic()))
                sender.sendto(message.content, ("127.0.0.1", ports[message.kind]))
        time.sleep(1.0)

    def look(self) -> list[str]:
        """Count the frames of those that became matches, and forget these; the names of the others."""
        asked = self._soak.league.call("sql", (
            "select match_id, count(distinct frame) frames from trajectories where match_id like 'ssl-%'"
            " group by 1"), "--json")
        if asked.returncode == 0 and not asked.stderr:
            for row in json.loads(asked.stdout):
                name = row["match_id"].rpartition("-")[0]
                watched = self._waiting.get(name)
                if watched and not watched.least <= row["frames"] <= watched.sent:
                    self._soak.find(f"live match {name}: {row['frames']} frames, of {watched}")
                if self._soak.league.call("forget", row["match_id"]).returncode == 0:
                    (self._soak.league.inbox / f"{name}.mcap").unlink(missing_ok=True)
                    self._waiting.pop(name, None)
                    self._soak.note("live matches counted", f"{name}: {row['frames']} frames")
        return sorted(self._waiting)


class Bucket:
    """A second league, in a bucket; the users are two machines, each with a copy of its own."""

    def __init__(self, soak: Soak, kept: frozenset[str], truth: list[Row]) -> None:
        self._soak, self._kept, self._truth = soak, kept, [row for row in truth if row[0] != "behaviours"]
        self._served: Served | None = None
        self._judge, self._url, self._begun = Judge(truth, kept), "", False

    def use(self, rng: random.Random) -> None:
        """Somebody runs a command on it, perhaps over a network that fails; then somebody asks."""
        if self._soak.stop.wait(rng.uniform(5.0, 20.0)):
            return
        league = self._soak.league
        if self._served is None:
            self._served = Served()
            self._url = self._served.new()
            for user in league.users:
                user.environment.update(self._served.environment)
        if not self._begun:
            for first in (["import", *(path for path in league.recordings if league.is_kept(path))], ["run"]):
                done = league.call(*first, data=self._url)
                if done.returncode:  # killed, or the disk is full: again
                    self._soak.note("bucket: not begun", f"{first[0]}: {done.stderr.strip()[-200:]}")
                    return
            self._begun = True
        user, reader = rng.choice(league.users), rng.choice(league.users)
        others = sorted({row[1] for row in self._truth} - self._kept)
        more = ["import", str(rng.choice(league.recordings))]
        words = rng.choice([more, more, ["forget", rng.choice(others)], ["run"], ["prune"], ["verify"]])
        fails = rng.random() < 0.4
        fault, luck = rng.choice(FAULTS), random.Random(rng.random())  # noqa: S311 (no secret)
        if fails:
            self._served.fault = lambda _: fault if luck.random() < 0.03 else None
        process = subprocess.Popen(  # noqa: S603 (our own)
            league.command(*words, data=self._url), text=True, errors="replace", stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, **user.popen)
        try:
            said = process.communicate(timeout=COMMAND_S)[0]
        except subprocess.TimeoutExpired:
            self._soak.find(f"{words} in a bucket does not end in {COMMAND_S:.0f} s")
            process.kill()
            said = process.communicate()[0]
        self._served.mend()
        killed = process.pid in self._soak.killed
        self._soak.note(f"bucket: commands{' that met faults' if fails else ''}", (
            f"{user.name} {words[0]} {'killed' if killed else process.returncode}: {said.strip()[-120:]!r}"))
        self._soak.check_said([f"{words[0]} in a bucket"], said)
        if process.returncode not in CODES and not killed:
            self._soak.find(f"{words} in a bucket ended with {process.returncode}: {said[-300:]!r}")
        answer = league.asked(self._url, reader)
        if answer.rows is not None:
            said = answer.stderr if "left out" in answer.stderr else ""  # else of which moment it is
            self._soak.judge_answer("bucket", self._judge, answer.rows, said, frozenset())
        else:
            self._soak.note("bucket: refused", answer.stderr.strip()[-200:])

    def end(self) -> None:
        """Settle the league, compare its rows with those of a quiet run, and stop the server."""
        if self._served is None:
            return
        self._soak.league.settle(self._url)
        answer = self._soak.league.asked(self._url)
        rows = [row for row in answer.rows or () if row[0] in MADE_FROM]
        if sorted(rows) != sorted(self._truth):
            self._soak.find(f"bucket: {len(rows)} rows of {len(self._truth)}: {answer.stderr[-300:]!r}")
        verified = self._soak.league.call("verify", data=self._url)
        if verified.returncode:
            self._soak.find(f"bucket: verify: {verified.stdout} {verified.stderr}")
        self._served.stop()
