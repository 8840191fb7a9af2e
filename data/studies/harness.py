"""Everything that studies share: commands, seasons, matches, recordings, intervals, parts that are kept.

A study is a folder here: its code beside what the code writes. It is run as a file,
``.venv/bin/python data/studies/NAME/study.py``, and imports ``pitchlore``, this module and other studies
(``from looking.study import HELD``). An editable install has this folder on Python's path (``dev-mode-dirs``
in pyproject.toml); a wheel has no study.
"""

from __future__ import annotations

import io
import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.base.digests import digest
from pitchlore.pipeline.base.software import software
from pitchlore.pipeline.importers import readers
from pitchlore.pipeline.importers.tracking.mapping import TrackingMap
from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.numbers.statistics import mean_interval
from pitchlore.pipeline.stages.seasons.settings import SeasonSettings, named_settings, parse_season

#: The checkout; its sample recording; where recordings may be that are not part of the project.
ROOT = Path(__file__).parents[2]
SAMPLE = ROOT / "data" / "samples" / "rsim-vss-3v3.parquet"
RECORDINGS = ROOT.parent / "shared" / "matches"
#: Names of the recordings: the sample's, and those of the folder.
RSIM, SSL = SAMPLE.name, "ssl-2025-robocin-tigers-345s.parquet"
RCSS, INSPER = "rcssserver-3v3.rcg.gz", "insper-2d-2022-unfinished.rcg.gz"
ALL = (RSIM, SSL, RCSS, INSPER)
#: The command line as it is installed.
PITCHLORE = str(Path(sys.executable).with_name("pitchlore"))

Job = TypeVar("Job")
Result = TypeVar("Result")


def command(*words: object) -> None:
    """Run a pitchlore command.

    Raises:
        SystemExit: with what it says, if it fails.
    """
    called = [PITCHLORE, *map(str, words)]
    done = subprocess.run(called, capture_output=True, text=True, check=False)  # noqa: S603 (our own)
    if done.returncode:
        raise SystemExit(f"{' '.join(called)}: {done.stderr or done.stdout}")


def settings_file(name: str) -> Path | None:
    """The file of settings of seasons in a study's folder; None if they are in the package."""
    return next(iter(ROOT.glob(f"data/studies/*/{name}.toml")), None)


def settings_of(name: str) -> SeasonSettings:
    """Settings of seasons by name: those of a study, or in the package."""
    path = settings_file(name)
    return named_settings(name) if path is None else parse_season(path.read_bytes(), str(path))


def seasons(settings: str, seeds: Sequence[int], data: Path, *words: object) -> None:
    """Play the seasons of consecutive seeds that are missing; ``words`` go to ``pitchlore season``.

    Args:
        settings: their name (:func:`settings_of`).
        seeds: seeds of the seasons.
        data: the data folder.
        words: further words of the command.
    """
    command("season", "--settings", settings_file(settings) or settings, "--seed", seeds[0],
            "--seasons", len(seeds), "--discard", "--data", data, *words)


def logged(recipe: Recipe, policies: Mapping[str, PolicyTables] | None = None) -> bytes:
    """The log of a match that is played; ``policies`` are those of its learned teams, by label."""
    return log_of(MatchInPlay(recipe, controllers_of(recipe, policies or {})))


def log_of(match: MatchInPlay) -> bytes:
    """The log of a match, which is played to its end."""
    stream = io.BytesIO()
    recorder, goes_on = matches.Recorder(stream, match.info), True
    while goes_on:
        goes_on = match.advance(4096)
        taken = match.take()
        recorder.frames(taken.frames)
        recorder.referee(taken.referee)
        recorder.decisions(taken.decisions)
    recorder.close(info=match.info)
    return stream.getvalue()


def elsewhere() -> Path:
    """The folder that the command line gives: recordings that are not part of the project."""
    return Path(sys.argv[1]) if len(sys.argv) > 1 else RECORDINGS


def recordings(folder: Path, names: Iterable[str] = ALL) -> dict[str, Path]:
    """The recordings that are there, by name; those that are not are named on the screen.

    Args:
        folder: has all but the sample.
        names: the recordings that are looked for.
    """
    paths = {name: SAMPLE if name == RSIM else folder / name for name in names}
    for path in paths.values():
        if not path.exists():
            print(f"{path} is not there: left out", flush=True)
    return {name: path for name, path in paths.items() if path.exists()}


def read(path: Path) -> MatchLog:
    """A recording as a match."""
    return readers.read(readers.open_source(path.read_bytes(), path.name), TrackingMap())


def of_pairs(differences: Sequence[float]) -> dict[str, float | None]:
    """Mean of a team's goal differences in pairs of matches, with Student's 95 % interval (None of one pair).

    The two matches of a pair have one seed, and sides swapped.

    Returns:
        matches, difference, low, high.
    """
    low, high = mean_interval(differences) or (None, None)
    return {
        "matches": 2 * len(differences),
        "difference": float(np.mean(differences)),
        "low": low,
        "high": high,
    }


def workers() -> Executor:
    """Two processes that play and read; they are spawned, because polars' threads do not survive a fork."""
    return ProcessPoolExecutor(2, get_context("spawn"))


class Parts:
    """Results of a study's parts; :func:`going_on` opens them.

    Args:
        path: the file that keeps them, a line of JSON each: the part, its result.
        about: their maker. A file of another is not used.
    """

    def __init__(self, path: Path, about: str) -> None:
        self._path, self._found = path, dict[str, Any]()
        lines = path.read_text("utf-8").split("\n")[:-1] if path.exists() else []  # the last one may be torn
        if lines[:1] == [json.dumps(about)]:
            self._found = dict(map(json.loads, lines[1:]))
            print(f"goes on after {len(self._found)} parts that {path} has", flush=True)
        else:
            lines = [json.dumps(about)]
        path.write_text("".join(f"{line}\n" for line in lines), "utf-8")

    def __call__(
        self, jobs: Iterable[Job], make: Callable[[Job], Result], pool: Executor | None = None
    ) -> list[Result]:
        """The results of some parts, in their order; each that is missing is made, and kept as it is there.

        Args:
            jobs: the parts, values that JSON tells apart from all others of the study.
            make: makes the result of a part, a value that JSON gives back as it is.
            pool: where they are made; None: here, one after the other.
        """
        names = {json.dumps(job): job for job in jobs}
        missing = {name: job for name, job in names.items() if name not in self._found}
        for name, result in _made(missing, make, pool):
            line = json.dumps([name, result])
            self._found[name] = json.loads(line)[1]
            with self._path.open("a", encoding="utf-8") as file:
                file.write(f"{line}\n")
        return [self._found[name] for name in names]


def _made(
    jobs: dict[str, Job], make: Callable[[Job], Result], pool: Executor | None
) -> Iterator[tuple[str, Result]]:
    """Names and results, as they are there."""
    if pool is None:
        yield from ((name, make(job)) for name, job in jobs.items())
        return
    begun: dict[Future[Result], str] = {pool.submit(make, job): name for name, job in jobs.items()}
    try:
        yield from ((begun[done], done.result()) for done in as_completed(begun))
    finally:
        for each in begun:
            each.cancel()


@contextmanager
def going_on(out: Path, study: str) -> Iterator[Parts]:
    """The parts of a study that takes long: one that was stopped goes on after those that had ended.

    They are kept in a hidden file of the study's folder, which goes when the study has ended. What other
    software, or other code of the study, has made is made again.

    Args:
        out: the folder that the study writes to.
        study: path of its code, ``__file__``.
    """
    out.mkdir(parents=True, exist_ok=True)
    path, code = out / f".{Path(study).stem}.parts", sorted(Path(study).parent.glob("*.py"))
    yield Parts(path, f"{software()} {digest(b''.join(file.read_bytes() for file in code))[:8]}")
    path.unlink()
