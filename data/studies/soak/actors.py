"""Events that befall the data folder, each in a thread of its own."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Lock, Thread
from typing import NamedTuple

from soak.clock import Clock
from soak.league import KINDS, LIVE, NAMES, League
from soak.processes import listens, running
from soak.questions import NOTEBOOK, PROGRAM, Judge, Row, Standing
from soak.users import STRANGER
from support.terminal import Terminal

#: Most that a command may take on a busy machine, and to end once it is told to, seconds.
COMMAND_S, END_S = 600.0, 60.0
#: Exit codes of a command that was not killed (docs/explanation/guarantees.md).
CODES = (0, 1, 3)
#: What none of our commands may say.
FORBIDDEN = ("Traceback", "nexpected", "Exception in thread", "Task exception", "core dumped")
SEASON = 'base = "paper"\ngames = 2\nlead_from = 2\n[referee]\nduration_s = 10\n'
#: How far the clock is ahead, one after the other, seconds.
STEPS = (3_600, -3_600, 86_400, -7 * 86_400, 45, 0)


class Sample(NamedTuple):
    """The soak at a moment.

    Attributes:
        second: since its beginning.
        processes: how many there are.
        mib: their resident memory, MiB.
        files: most open files of one of them.
        serve_mib: resident memory of `serve`, MiB; 0 while it does not run.
        serve_files: its open files.
        notebook_mib: the notebook's resident memory, MiB.
        database_mib: size of Prefect's database, MiB.
        temporary: number of temporary files in the data folder.
        league_mib: size of the data folder, MiB.
    """

    second: float
    processes: int
    mib: float
    files: int
    serve_mib: float
    serve_files: int
    notebook_mib: float
    database_mib: float
    temporary: int
    league_mib: float


class Soak:
    """All that happens, and what was seen of it.

    Args:
        league: the data folder.
        clock: the clock of its processes.
        judge: judges the answers.
        seconds: how long it takes.
        seed: chooses what happens.
        room: whether the folder's disk is small, and can be filled.
        log: receives a line for each event.

    Attributes:
        counts: number of events of each kind.
        findings: faults.
        samples: use of the machine by the processes.
        actors: events, each called again and again in a thread of its own, with a generator.
        on: gives the word for ``--on`` of a cluster; empty if there is none.
        stop: set when time is over.
        killed: processes that were killed.
    """

    def __init__(
        self, league: League, clock: Clock, judge: Judge, seconds: float, seed: int, room: bool, log: Path
    ) -> None:
        self.league, self.clock, self.judge, self.seconds = league, clock, judge, seconds
        self.counts: Counter[str] = Counter()
        self.findings: list[str] = []
        self.samples: list[Sample] = []
        self.actors: list[Callable[[random.Random], None]] = [
            self._drop, self._command, self._interrupt, self._kill, self._step, self._ask, self._tell,
            self._read, self._keep, self._watch, self._flip,
            *([self._close] if len(league.users) > 1 else []), *([self._fill] if room else [])]
        self.on: Callable[[], str] = str
        self._seed, self.stop, self._lock = seed, Event(), Lock()
        self.killed: set[int] = set()
        self._parts: set[str] = set()
        self._begun, self._log = time.monotonic(), log
        log.write_text("")
        self._serve: subprocess.Popen[bytes] | None = None
        self._notebook: subprocess.Popen[str] | None = None
        self._program: subprocess.Popen[str] | None = None

    def run(self) -> None:
        """Let all happen until time is over, then end all of it."""
        luck = [random.Random(f"{self._seed} {actor.__name__}") for actor in self.actors]  # noqa: S311 (no secret)
        threads = [Thread(target=self._act, args=each) for each in zip(self.actors, luck, strict=True)]
        for thread in threads:
            thread.start()
        time.sleep(self.seconds)
        self.stop.set()
        for thread in threads:
            thread.join()
        for process, stop in ((self._serve, signal.SIGINT), (self._notebook, signal.SIGTERM),
                              (self._program, signal.SIGTERM)):
            if process is not None:
                self._end(process, stop)
        self.clock.step(0)

    def note(self, kind: str, text: str = "") -> None:
        """Count an event, and write it down."""
        with self._lock:
            self.counts[kind] += 1
            if text:
                with self._log.open("a") as log:
                    log.write(f"{time.monotonic() - self._begun:7.1f} {kind}: {text}\n")

    def find(self, what: str) -> None:
        """Write down what must not be."""
        with self._lock:
            self.findings.append(what)
        self.note("finding", what)

    def _act(self, actor: Callable[[random.Random], None], rng: random.Random) -> None:
        """Let an actor act again and again."""
        while not self.stop.is_set():
            try:
                actor(rng)
            except Exception as error:
                self.find(f"the soak itself: {actor.__name__}: {type(error).__name__}: {error}")
                self.stop.wait(5.0)

    def _drop(self, rng: random.Random) -> None:
        """A recording comes into the inbox, at once or in pieces, perhaps with a bad name; or one goes."""
        self.stop.wait(rng.uniform(1.0, 8.0))
        there = [path for path in self.league.inbox.iterdir()
                 if path.is_file() and not path.name.startswith(LIVE)]
        if there and rng.random() < 0.35:
            path = rng.choice(there)
            path.unlink(missing_ok=True)
            self.note("recordings removed", repr(path.name))
            return
        source = self.league.recording(rng)
        bad = source in self.league.refused and rng.random() < 0.5
        target = self.league.inbox / (rng.choice(NAMES).format(source.name) if bad else source.name)
        try:
            self._copy(source, target, 0 if rng.random() < 0.5 else rng.randrange(2, 40))
            self.note("recordings dropped", repr(target.name))
        except OSError as error:  # the disk is full
            target.unlink(missing_ok=True)
            self.note("recordings that found no room", str(error.strerror))

    def _copy(self, source: Path, target: Path, pieces: int) -> None:
        """Copy a file under a hidden name, and rename it; or in pieces."""
        if not pieces:
            shutil.copyfile(source, hidden := target.with_name(f".{source.name}"))
            hidden.rename(target)
            return
        data = source.read_bytes()
        size = len(data) // pieces + 1
        with target.open("wb", buffering=0) as file:
            for at in range(0, len(data), size):
                file.write(data[at:at + size])
                self.stop.wait(0.02)

    def _command(self, rng: random.Random) -> None:
        """Somebody runs a command."""
        self.stop.wait(rng.uniform(0.0, 5.0))
        words, user = self._words(rng), rng.choice(self.league.users)
        begun = time.monotonic()
        process = subprocess.Popen(  # noqa: S603 (our own)
            self.league.command(*words), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            errors="replace", **user.popen)
        said = self._heard(process, words)
        took = time.monotonic() - begun
        killed = process.pid in self.killed
        self.note(
            f"commands {words[0]}",
            f"{user.name} {words[1:2]} {words[-1] if '--on' in words else ''}"
            f" {'killed' if killed else process.returncode} in {took:.0f} s:"
            f" {said.strip().splitlines()[-1][-120:] if said.strip() else ''!r}",
        )
        self.check_said(words, said)
        if not killed and process.returncode not in CODES:
            self.find(f"{words} ended with {process.returncode}: {said[-300:]!r}")

    def _words(self, rng: random.Random) -> list[object]:
        """A command."""
        matches = sorted(name for kind, name in self.league.standing()
                         if kind == "matches" and name not in self.judge.kept and not name.startswith(LIVE))
        settings = self.league.data.parent / "short.toml"
        if not settings.exists():
            settings.write_text(SEASON)
        chosen: list[list[object]] = [
            ["run"], ["run"], ["import", self.league.recording(rng)],
            ["import", "--isolate", self.league.recording(rng)], ["verify"], ["prune"], ["kb", "list"],
            ["season", "--settings", settings, "--seed", rng.randrange(1, 4)]]
        if matches:
            chosen += [["forget", rng.choice(matches)]] * 2
        words = rng.choice(chosen)
        if words[0] in ("run", "import", "season") and (luck := rng.random()) < 0.4:
            words = [*words, "--on", "dask:local:2" if luck < 0.05 else self.on() or "processes:2"]
        return words

    def _heard(self, process: subprocess.Popen[str], words: list[object]) -> str:
        """The output of a command until it ends; one that does not end is found, and killed."""
        try:
            return process.communicate(timeout=COMMAND_S)[0]
        except subprocess.TimeoutExpired:
            self.find(f"{words} does not end in {COMMAND_S:.0f} s")
            process.kill()
            return process.communicate()[0]

    def check_said(self, words: list[object], said: str) -> None:
        """Find what a command must not say."""
        for line in said.splitlines():
            if any(word in line for word in FORBIDDEN):
                self.find(f"{words[0]} says: {line[:300]!r} in {said[-2000:]!r}")
                return

    def _interrupt(self, rng: random.Random) -> None:
        """Somebody presses Ctrl-C in a terminal."""
        self.stop.wait(rng.uniform(10.0, 40.0))
        user = rng.choice(self.league.users)
        terminal = Terminal("run", "--data", self.league.data, before=user.before,
                            environment={**user.environment, "TERM": "xterm"})
        try:
            while terminal.process.poll() is None and not listens(terminal.process.pid):
                terminal.read(0.1)
            end = time.monotonic() + rng.uniform(0.0, 12.0)
            while time.monotonic() < end and terminal.process.poll() is None:
                terminal.read(0.2)
            was_over = terminal.process.poll() is not None
            if not was_over:
                terminal.press()
            code = terminal.end(END_S)
            left = terminal.left(END_S)
            killed = terminal.process.pid in self.killed
            self.note("Ctrl-C", "too late" if was_over else f"exit code {code}")
            self.check_said(["run in a terminal"], terminal.text)
            if left:
                self.find(f"Ctrl-C leaves {left}")
            # -2: the command had ended, and Python was about to
            if code not in (*CODES, 130, -2) and not killed:
                self.find(f"Ctrl-C: exit code {code}: {terminal.text[-300:]!r}")
        except AssertionError as error:
            self.find(f"Ctrl-C: {str(error)[-300:]}")
        finally:
            terminal.close()

    def _kill(self, rng: random.Random) -> None:
        """Any process is killed, once a minute."""
        if self.stop.wait(rng.uniform(40.0, 80.0)):
            return
        there = running()
        if there:
            victim, how = rng.choice(there), rng.choice((signal.SIGKILL, signal.SIGKILL, signal.SIGTERM))
            with suppress(ProcessLookupError):
                self.killed.add(victim.pid)
                os.kill(victim.pid, how)
                self.note("kills", f"{victim.role} by {how.name}")

    def _step(self, rng: random.Random) -> None:
        """The clock steps, every five minutes."""
        if self.clock.environment and not self.stop.wait(self.seconds / 12):
            seconds = rng.choice(STEPS)
            self.clock.step(seconds)
            self.note("clock steps", f"{seconds:+,} s")
        self.stop.wait(1.0)

    def _fill(self, _rng: random.Random) -> None:
        """The disk is full for a minute, twice."""
        if self.stop.wait(self.seconds * 0.3):
            return
        filler = self.league.data.parent / "filler"
        try:
            with filler.open("wb", buffering=0) as file, suppress(OSError):
                while True:
                    file.write(bytes(1 << 20))
            self.note("full disk", f"{shutil.disk_usage(filler).free} bytes are free")
            self.stop.wait(min(60.0, self.seconds / 20))
        finally:
            filler.unlink()
        self.note("disk free again", f"{shutil.disk_usage(self.league.data).free >> 20} MiB")

    def _ask(self, rng: random.Random) -> None:
        """`sql` asks without pause; receipts are counted before and after, by names in folders."""
        before, quarantined = self.league.standing(), self.league.quarantined()
        answer = self.league.asked(user=rng.choice(self.league.users))
        after, quarantined = self.league.standing(), quarantined + self.league.quarantined()
        self.check_said(["sql"], answer.stderr)
        if answer.rows is None:  # refused, or killed
            self.note("sql: refused", f"{answer.code} {answer.stderr.strip()[-200:]}")
            return
        whole = {of for of, seen in before.items() if after.get(of) == seen}
        self.judge_answer("sql", self.judge, answer.rows, answer.stderr, whole, quarantined)
        if (answer.code == 3) != ("left out" in answer.stderr) or answer.code not in (0, 3):
            self.find(f"sql: exit code {answer.code} with {answer.stderr[-300:]!r}")

    def _tell(self, _rng: random.Random) -> None:
        """A program asks a league that it opened once, without pause; it is started again when it ends."""
        if self._program is None or self._program.poll() is not None:
            self.note("programs started")
            if self._program is not None:
                self._end(self._program, signal.SIGTERM)
            # a file: of -c DuckDB thinks that a person reads it, and shows progress
            (file := self.league.data.parent / "program.py").write_text(PROGRAM)
            self._program = subprocess.Popen(  # noqa: S603 (our own)
                [sys.executable, str(file), str(self.league.data)], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, text=True, **self.league.users[0].popen)
        assert self._program.stdin is not None
        assert self._program.stdout is not None
        before, quarantined = self.league.standing(), self.league.quarantined()
        line = ""
        with suppress(BrokenPipeError):
            print(file=self._program.stdin, flush=True)
            line = self._program.stdout.readline()
        after, quarantined = self.league.standing(), quarantined + self.league.quarantined()
        if not line.endswith("\n"):
            self.stop.wait(0.5)
        elif isinstance(said := json.loads(line), str):
            self.note("program: refused", said)
        else:
            whole = {of for of, seen in before.items() if after.get(of) == seen}
            self.judge_answer("program", self.judge, [(*row,) for row in said], "", whole, quarantined)
        self.stop.wait(0.2)

    def judge_answer(
        self, who: str, judge: Judge, answer: list[Row], said: str, standing: Standing | None,
        quarantined: str = "",
    ) -> None:
        """Find what is wrong with an answer, and what one of now lacks though nothing was ``said``."""
        wrong = judge.wrong(answer, of_now=standing is not None, said=said)
        self.note(f"{who}: answers{' that say what they lack' if said else ''}", said.strip()[:200])
        self.counts[f"{who}: rows"] += len(answer)
        if not said and standing is not None:
            wrong += judge.lacking(answer, standing, quarantined)
        for what in wrong[:3]:
            self.find(f"{who}: {what}")

    def _flip(self, rng: random.Random) -> None:
        """A bit of a receipt, manifest or index is wrong for seconds."""
        records = (*(f"{kind}/*.receipt.json" for kind in KINDS), "*/v*/manifest.json", "closed/*.json")
        with self._opened(rng, "damaged", records, os.O_RDWR) as file:
            if file is not None:
                at = rng.randrange(os.fstat(file).st_size)
                byte = os.pread(file, 1, at)
                os.pwrite(file, bytes([byte[0] ^ 1 << rng.randrange(8)]), at)
                self.stop.wait(rng.uniform(2.0, 8.0))
                os.pwrite(file, byte, at)

    def _close(self, rng: random.Random) -> None:
        """A file is closed to the users for seconds, as one that was made with a umask of 077."""
        with self._opened(rng, "closed", (*(f"{kind}/*.*" for kind in KINDS), "*/v*/*", "closed/*",
                                          "catalog.duckdb"), os.O_RDONLY) as file:
            if file is not None:
                seen = os.fstat(file)
                os.fchmod(file, 0o600)
                os.fchown(file, STRANGER, -1)
                self.stop.wait(rng.uniform(2.0, 8.0))
                os.fchown(file, seen.st_uid, -1)
                os.fchmod(file, seen.st_mode & 0o7777)

    @contextmanager
    def _opened(
        self, rng: random.Random, harm: str, patterns: Iterable[str], flags: int,
    ) -> Iterator[int | None]:
        """Wait, and open a file of the league, which may be replaced meanwhile; None if there is none."""
        self.stop.wait(rng.uniform(15.0, 40.0))
        there = sorted(path for of in patterns for path in self.league.data.glob(of) if path.is_file())
        path = rng.choice(there) if there and not self.stop.is_set() else None
        file: int | None = None
        with suppress(FileNotFoundError):
            file = os.open(path, flags) if path else None
        try:
            if file is not None:
                self.note(f"files {harm}", str(path))
            yield file
        finally:
            if file is not None:
                os.close(file)
                self.note(f"files {harm} before", str(path))

    def _read(self, _rng: random.Random) -> None:
        """A notebook asks without pause; it is opened again when it is killed."""
        if self._notebook is None or self._notebook.poll() is not None:
            self.note("notebooks opened")
            if self._notebook is not None:
                self._end(self._notebook, signal.SIGTERM)
            self._notebook = subprocess.Popen(  # noqa: S603 (our own)
                [sys.executable, "-c", NOTEBOOK, str(self.league.data / "catalog.duckdb")],
                stdout=subprocess.PIPE, text=True,
                **self.league.users[-1].popen)
        assert self._notebook.stdout is not None
        line = self._notebook.stdout.readline()
        if not line.endswith("\n"):
            self.stop.wait(0.5)
            return
        said = json.loads(line)
        if isinstance(said, str):
            self.note("notebook: refused", said)
        else:
            self.judge_answer("notebook", self.judge, [(*row,) for row in said], "", None)

    def _keep(self, rng: random.Random) -> None:
        """`serve` runs each minute; it is started again when it ends."""
        if self._serve is not None and self._serve.poll() is None:
            self.stop.wait(2.0)
            return
        if self._serve is not None:
            self.note("serve ended", f"exit code {self._serve.returncode}")
        with (self.league.data.parent / "serve.txt").open("ab") as said:
            self._serve = subprocess.Popen(  # noqa: S603 (our own)
                self.league.command("serve", "--cron", "* * * * *"), stdout=said,
                stderr=said, start_new_session=True, **rng.choice(self.league.users).popen)
        self.note("serve started")
        self.stop.wait(10.0)

    def _watch(self, _rng: random.Random) -> None:
        """Count what the processes take."""
        parts = {path.name for path in self.league.data.glob("closed/*.json")}
        self.counts["closed parts seen"] += len(parts - self._parts)
        self.counts["closed parts taken apart"] += len(self._parts - parts)
        there, self._parts = running(), parts
        self.samples.append(
            Sample(
                round(time.monotonic() - self._begun, 1),
                len(there),
                round(sum(p.mib for p in there), 1),
                max((p.files for p in there), default=0),
                *next(
                    ((round(p.mib, 1), p.files) for p in there if self._serve and p.pid == self._serve.pid),
                    (0.0, 0)),
                round(next((p.mib for p in there if p.role == "notebook"), 0.0), 1),
                _mib(self.league.data / "server", "*.db*"),
                sum(1 for _ in self.league.data.rglob("*.tmp*")),
                _mib(self.league.data, "*"),
            )
        )
        self.stop.wait(10.0)

    def _end(self, process: subprocess.Popen[bytes] | subprocess.Popen[str], how: int) -> None:
        """End a process that was kept; it has to end soon."""
        if process.poll() is None:
            process.send_signal(how)
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            self.find(f"{process.args!r} does not end in {END_S:.0f} s")
            process.kill()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with suppress(BrokenPipeError):
                    pipe.close()


def _mib(folder: Path, pattern: str) -> float:
    """Size of the files in a folder, MiB."""
    total = 0
    for path in folder.rglob(pattern):
        with suppress(OSError):
            total += path.stat().st_size
    return round(total / (1 << 20), 1)
