"""SIGKILL at a step of knowledge, policies, seasons and the catalogue: what stands is whole, and the work goes on.

A step is a write, sync, rename, lock or removal of a file (``support.killing``). The suite takes some of them;
`make soak` takes all.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from conftest import ROOT

from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.store import Store

#: One step in so many is taken; of a season, which has most, one in twenty-four times as many.
EVERY = int(os.environ.get("PITCHLORE_STEPS", "25"))


@pytest.fixture(scope="module")
def reported() -> Iterator[Callable[..., tuple[int, int]]]:
    """Does an action on a folder so often, and dies at a step; the number of steps, and the exit code."""
    here = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests"), *sys.path])}
    with subprocess.Popen([sys.executable, "-m", "support.killing"], env=here, text=True,
                          stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"

        def tell(step: int, action: str, folder: Path, times: int = 1) -> tuple[int, int]:
            process.stdin.write(f"{step} {times} {action} {folder}\n")
            process.stdin.flush()
            steps, code = process.stdout.readline().split()
            return int(steps), int(code)

        yield tell
        process.kill()


def contents(data: Path) -> dict[str, bytes]:
    """The bytes of all outputs and versions, without locks, the catalogue and the log of runs."""
    return {str(path.relative_to(data)): path.read_bytes() for path in sorted(data.rglob("*"))
            if path.is_file() and not path.name.startswith(".") and path.suffix != ".duckdb" and path.parent.name != "runs"}


def prepared(finished: Path, data: Path, *without: str) -> Path:
    shutil.rmtree(data, ignore_errors=True)
    shutil.copytree(finished, data)
    for name in ("inbox", *without):
        shutil.rmtree(data / name)
    (data / "catalog.duckdb").unlink()
    return data


@pytest.mark.parametrize(("action", "without", "times"), [
    ("run", ("knowledge", "policies"), 1),
    ("run", ("decisions",), 1),
    ("forget", (), 1),
    ("season", (), 2),
])
def test_killed_at_a_step(finished, tmp_path, reported, action, without, times):
    """After a kill all that stands is whole, and the same command gives the bytes of a quiet run."""
    data = tmp_path / "data"
    prepared(finished, data, *without)
    steps, code = reported(0, action, data, times)
    assert (steps > 10, code) == (True, 0)
    assert reported(0, "prune", data)[1] == 0
    quiet = contents(data)
    every = EVERY * (24 if action == "season" else 1)
    for step in range(1 + every // 2, steps + 1, every):
        prepared(finished, data, *without)
        assert reported(step, action, data, times)[1] == -9
        assert verify_all(Store(data)).problems == [], step
        assert reported(0, action, data, times)[1] == 0
        assert reported(0, "prune", data)[1] == 0  # a kill may leave files that no receipt names
        assert contents(data) == quiet, step
        store = Store(data)
        assert refresh(store)[1] == []
        assert all(store.versions(noun) == [1] for noun in STAGES.versioned)
        assert not [path for path in data.rglob(".*") if path.suffix in (".tmp", ".staging")]
