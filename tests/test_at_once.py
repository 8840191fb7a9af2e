"""Two commands at once on one data folder: what stands in the end is whole, and made once.

Each round starts two processes with random delays. `make soak` plays fifty rounds of each pair.
"""

from __future__ import annotations

import dataclasses
import os
import random
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from support.processes import answering, line, tell

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.catalog import forget_match, refresh
from pitchlore.pipeline.engine.stage import Output, Scope
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.settings import Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask

ROUNDS = int(os.environ.get("PITCHLORE_ROUNDS", "1"))
#: Longest delay of one of the two, seconds.
DELAY_S = 0.2


@pytest.fixture(scope="module")
def processes() -> Iterator[list[subprocess.Popen[str]]]:
    """Two processes that do as they are commanded."""
    with ExitStack() as both:
        started = [both.enter_context(answering("support.at_once")) for _ in range(2)]
        assert [line(process) for process in started] == ["ready", "ready"]
        yield started


@pytest.fixture
def at_once(processes) -> Callable[..., list[str]]:
    """Does actions on a folder at once, each in a process of its own and after a delay; what came of them."""
    rng = random.Random(1)

    def reported(folder: Path, *actions: str) -> list[str]:
        for process, action in zip(processes, actions, strict=False):
            tell(process, f"{rng.uniform(0, DELAY_S):.3f}", action, folder)
        return [line(process) for process, _ in zip(processes, actions, strict=False)]

    return reported


@pytest.fixture
def folders(tmp_path, finished, clips) -> Iterator[Path]:
    """Copies of a finished data folder, each new; its recordings beside it."""
    shutil.copytree(clips, tmp_path / "recordings")

    def copies() -> Iterator[Path]:
        for _ in range(ROUNDS):
            data = tmp_path / "data"
            shutil.rmtree(data, ignore_errors=True)
            shutil.copytree(finished, data)
            shutil.rmtree(data / "inbox")
            yield data

    return copies()


def sound(data: Path) -> Store:
    """The store, in which everything is whole, and which answers."""
    store = Store(data)
    assert verify_all(store).problems == []
    path, left_out = refresh(store)
    assert left_out == []
    assert set(ask(path, "select distinct match_id from situations")["match_id"]) <= {r.name for r in store.receipts("matches")}
    assert not list(data.rglob(".*.tmp"))
    assert not list(data.rglob(".*.staging"))
    return store


@pytest.mark.parametrize("action", ["run", "train"])
def test_one_policy(folders, at_once, action):
    """Two runs at once, or a run and a training, make one version of the knowledge and one policy."""
    for data in folders:
        shutil.rmtree(data / "policies")
        if action == "run":
            shutil.rmtree(data / "knowledge")
            shutil.rmtree(data / "sequences")
        said = at_once(data, "run", action)
        assert not [line for line in said if line.startswith("error")]
        store = sound(data)
        assert [store.versions(noun) for noun in STAGES.versioned] == [[1], [1]], said
        assert sum(line.endswith("True") for line in said) == 1


def test_import_and_forget(folders, at_once):
    """A match that is imported while it is forgotten is there in the end, or is not; nothing is left of it."""
    for data in folders:
        assert at_once(data, "import", "forget") == ["imported", "forgotten"]
        assert len(list(sound(data).receipts("matches"))) in (1, 2)


@pytest.mark.parametrize("other", ["forget", "prune", "import", "season"])
def test_beside_a_run(folders, at_once, other):
    """A run while a match is forgotten, files are pruned, a recording comes or a game is played: nothing is torn.

    The next run finishes what the first could not.
    """
    for data in folders:
        for noun in ("sequences", "decisions", "situations"):
            shutil.rmtree(data / noun)
        said = at_once(data, "run", other)
        assert not said[1].startswith("error"), said
        store = sound(data)
        (again,) = at_once(data, "run")
        assert not again.startswith("error"), again
        sound(data)
        if other == "season":
            assert store.receipt("seasons", "short-static-1") is not None


def test_two_imports(folders, at_once):
    """Two imports of the same recordings at once make each match once."""
    for data in folders:
        shutil.rmtree(data)
        data.mkdir()
        at_once(data, "import", "import")
        assert len(list(sound(data).receipts("matches"))) == 2


def test_forgotten_while_it_is_made(copied, monkeypatch):
    """An output of a match that is forgotten while the output is made is not committed."""
    store = Store(copied)
    (match, _) = (receipt.name for receipt in store.receipts("matches"))
    stage = STAGES["goals"]
    assert stage.compute is not None
    compute = stage.compute

    def slowly(*arguments):
        made = compute(*arguments)
        forget_match(store, match)
        return made

    scope, output = Scope(matches=(match,)), Output(match, match)
    slow = dataclasses.replace(stage, compute=slowly)
    store.forget("goals", match)
    with pytest.raises(NotFound, match=f"matches {match} has been removed meanwhile. Run again"):
        STAGES.perform(store, slow, output, Settings().goals, scope)
    assert store.receipt("goals", match) is None
    assert store.quarantined() == []
    assert verify_all(store).problems == []
