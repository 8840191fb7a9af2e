"""SIGKILL at a step of knowledge, policies, seasons, the catalogue, closed parts, pages, exports, restoring, pruning and imports: what stands is whole, and the work goes on.

A step is a write, sync, rename, lock or removal of a file (``support.killing``). The suite takes some of them;
`make soak` takes all.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from conftest import clip
from support.buckets import files
from support.processes import answering, line, tell

from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.store import Store

#: One step in so many is taken; of what has most of them, one in so many times as many.
EVERY = int(os.environ.get("PITCHLORE_STEPS", "25"))
RARER = {"season": 24, "scout": 8}


@pytest.fixture(scope="module")
def reported() -> Iterator[Callable[..., tuple[int, int]]]:
    """Does an action on a folder so often, and dies at a step; the number of steps, and the exit code."""
    with answering("support.killing") as process:
        assert line(process) == "ready"

        def ask(step: int, action: str, folder: Path, times: int = 1) -> tuple[int, int]:
            tell(process, step, times, action, folder)
            steps, code = line(process).split()
            return int(steps), int(code)

        yield ask


def prepared(finished: Path, data: Path, action: str, *without: str) -> Path:
    shutil.rmtree(data, ignore_errors=True)
    shutil.copytree(finished, data)
    for name in ("inbox", *without):
        shutil.rmtree(data / name)
    (data / "catalog.duckdb").unlink()
    if action == "prune":
        for path in (data / "situations").glob("*.parquet"):
            for number in range(9):
                shutil.copy(path, path.with_name(f"{path.name.split('-')[0]}-{number:012x}.situations.parquet"))
    if action == "restore":
        if not (data.parent / "backup").is_dir():
            shutil.copytree(data, data.parent / "backup")
        for path in sorted((data / "situations").glob("*.parquet")) + sorted((data / "knowledge").rglob("*.parquet")):
            path.write_bytes(path.read_bytes()[:-9])
    return data


@pytest.mark.parametrize(("action", "without", "times"), [
    ("run", ("knowledge", "policies"), 1),
    ("run", ("decisions",), 1),
    ("forget", (), 1),
    ("season", (), 2),
    ("scout", (), 1),
    ("export", (), 1),
    ("restore", (), 1),
    ("prune", (), 1),
    ("import", (), 1),
    ("join", (), 1),
])
def test_killed_at_a_step(finished, tmp_path, reported, action, without, times):
    """After a kill all that stands is whole, and the same command gives the bytes of a quiet run."""
    data = tmp_path / "data"
    (tmp_path / "recordings").mkdir()
    clip(120.0, 125.0).write_parquet(tmp_path / "recordings" / "third.parquet")
    prepared(finished, data, action, *without)
    steps, code = reported(0, action, data, times)
    assert (steps > 10, code) == (True, 0)
    assert reported(0, "prune", data)[1] == 0
    quiet = files(data)
    every = EVERY * RARER.get(action, 1)
    for step in range(1 + every // 2, steps + 1, every):
        prepared(finished, data, action, *without)
        assert reported(step, action, data, times)[1] == -9
        assert action == "restore" or verify_all(Store(data)).problems == [], step
        assert reported(0, action, data, times)[1] == 0
        assert reported(0, "prune", data)[1] == 0  # a kill may leave files that no receipt names
        assert files(data) == quiet, step
        store = Store(data)
        assert refresh(store)[1] == []
        assert all(store.versions(noun) == [1] for noun in STAGES.versioned)
        assert not [path for path in data.rglob(".*") if path.suffix in (".tmp", ".staging")]
