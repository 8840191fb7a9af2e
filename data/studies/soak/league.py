"""The data folder, its recordings, and what a quiet run makes of them."""

from __future__ import annotations

import json
import os
import random
import subprocess
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import polars as pl
from harness import PITCHLORE, SAMPLE
from hostile.make import HOSTILE
from soak.processes import MARK
from soak.questions import QUESTION, Row
from soak.users import User, share, users
from support.idle import nothing_new

from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Behaviours, Occasions, Policies

#: Recordings that are refused soon, and need little room.
REFUSED = (
    "quadratic.mcap", "lying.mcap", "deep.mcap", "chunks.mcap", "rows.parquet", "bomb.csv.gz", "nothing.csv",
    "empty.csv")
#: What no file should be named.
NAMES = ("a\nb{}", "\x1b[2J{}", "<script>{}", "{}" + "x" * 180, "-rf {}")
STARTS_S, LENGTH_S = range(0, 560, 45), 8.0
#: How names of matches begin that were watched live.
LIVE = "ssl-"
#: Nouns with an output of each match.
KINDS = STAGES.nouns(Per.MATCH)


class Answer(NamedTuple):
    """Answer of `sql`.

    Attributes:
        code: exit code.
        rows: the answer; None if there is none.
        stderr: the lines beside it.
    """

    code: int
    rows: list[Row] | None
    stderr: str


class League:
    """A data folder, and recordings to drop into it.

    Args:
        root: folder of everything.
        environment: for its commands, besides this process's.
        several: whether two users share it.

    Attributes:
        data: the data folder.
        users: callers of commands.
        recordings: files that are matches.
        refused: files that are none.
    """

    def __init__(self, root: Path, environment: Mapping[str, str], several: bool = False) -> None:
        self.data, self._pool = root / "league", root / "recordings"
        own = {**os.environ, **environment, MARK: str(os.getpid()),
               "PREFECT_SERVER_ANALYTICS_ENABLED": "false"}
        own.pop("PREFECT_API_URL", None)
        self.users = users(root, own, several)
        self._pool.mkdir(parents=True)
        self.inbox.mkdir(parents=True)
        if several:
            share(self.data)
        self.recordings = [self._recording(start) for start in STARTS_S]
        self.refused = list[Path]()
        for case in HOSTILE:
            if case.name in REFUSED:
                (self._pool / case.name).write_bytes(case.content())
                self.refused.append(self._pool / case.name)

    @property
    def inbox(self) -> Path:
        """Where recordings are dropped."""
        return self.data / "inbox"

    def _recording(self, start: int) -> Path:
        table = pl.read_parquet(SAMPLE).filter(pl.col("t").is_between(start, start + LENGTH_S, closed="left"))
        if start % 2:
            path = self._pool / f"w{start:03d}.csv"
            table.write_csv(path)
        else:
            path = self._pool / f"w{start:03d}.parquet"
            table.write_parquet(path)
        return path

    def is_kept(self, recording: Path) -> bool:
        """Tell whether the match of a recording is in the league all the time."""
        return recording in self.recordings[::4]

    def standing(self) -> dict[tuple[str, str], tuple[int, int]]:
        """Receipts by noun and match, counted by names in folders: inode and time of change of each."""
        found = {}
        for kind in KINDS:
            for path in (self.data / kind).glob("*.receipt.json"):
                with suppress(FileNotFoundError):
                    seen = path.stat()
                    found[kind, path.name.removesuffix(".receipt.json")] = seen.st_ino, seen.st_mtime_ns
        return found

    def quarantined(self) -> str:
        """The names of what is in quarantine, in one text."""
        return " ".join(path.name for path in (self.data / "quarantine").rglob("*"))

    def recording(self, rng: random.Random) -> Path:
        """Some recording, of each seven one that is refused."""
        return rng.choice(self.recordings if rng.random() < 0.85 else self.refused)

    def command(self, *words: object, data: Path | str | None = None) -> list[str]:
        """A command line."""
        return [PITCHLORE, *map(str, words), "--data", str(data or self.data)]

    def call(
        self, *words: object, data: Path | str | None = None, user: User | None = None,
    ) -> subprocess.CompletedProcess[str]:
        """Run a command to its end."""
        return subprocess.run(  # noqa: S603 (our own)
            self.command(*words, data=data), text=True, check=False, capture_output=True, errors="replace",
            **(user or self.users[0]).popen)

    def ask(self, data: Path | str | None = None) -> list[Row]:
        """The answer to the question.

        Raises:
            RuntimeError: with what the command said, if it refuses.
        """
        answer = self.asked(data)
        if answer.rows is None or answer.code:
            raise RuntimeError(answer.stderr.strip() or f"exit code {answer.code}")
        return answer.rows

    def asked(self, data: Path | str | None = None, user: User | None = None) -> Answer:
        """Answer of `sql` to the question."""
        asked = self.call("sql", QUESTION, "--json", data=data, user=user)
        rows = None
        with suppress(ValueError):  # refused, or killed while it wrote
            rows = [(row["kind"], row["name"], row["many"], row["content"])
                    for row in json.loads(asked.stdout)]
        return Answer(asked.returncode, rows if asked.returncode >= 0 else None, asked.stderr)

    def settle(self, data: Path | str | None = None) -> None:
        """Import all recordings, and run until nothing is new.

        Raises:
            RuntimeError: if a command fails.
        """
        for words in (["import", *self.recordings], ["run"], ["run"]):
            done = self.call(*words, data=data)
            if done.returncode:
                raise RuntimeError(f"{words[0]}: {done.stdout[-500:]} {done.stderr[-500:]}")


def contents(data: Path) -> dict[str, str]:
    """The state of a folder: SHA-256 of all outputs' files, of the rows of knowledge and of the policy.

    Raises:
        RuntimeError: if a run would find work.
    """
    store = Store(data)
    report = nothing_new(store, Settings())
    if report is None:
        raise RuntimeError(f"{data}: a run would find work")
    nouns = STAGES.nouns(Per.MATCH, Per.GROUP)
    found = {f"{noun}/{receipt.name}/{key}": file.sha256
             for noun in nouns for receipt in store.receipts(noun) for key, file in receipt.files.items()}
    for noun, version, tables in (("knowledge", report.knowledge, (Behaviours, Occasions)),
                                  ("policies", report.policy, (Policies,))):
        assert version is not None
        manifest = store.manifest(noun, version)
        for table in tables:
            rows = store.read_table(manifest, table.NAME, table)
            numbers = [name for name in rows.columns if name.endswith("version")]
            found[f"{noun}/{table.NAME}"] = digest(rows.drop(numbers).write_ndjson().encode())
    return found
