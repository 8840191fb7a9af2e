"""A match that was found done is not looked at again until something that it depends on changes."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from support.idle import nothing_new

from pitchlore.pipeline.engine import freshness, run
from pitchlore.pipeline.engine.catalog import distrust
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import GramSettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.outputs import RECEIPT

OTHER = Settings(grams=GramSettings(alpha=0.99))


@pytest.fixture
def data(tmp_path, finished) -> Path:
    """A finished data folder of the day before, looked at once."""
    folder = shutil.copytree(finished, tmp_path / "data")
    for path in folder.rglob(f"*{RECEIPT}"):
        found = path.stat().st_mtime_ns - 86_400 * 10**9
        os.utime(path, ns=(found, found))
    assert nothing_new(Store(folder), Settings()) is not None
    return folder


@pytest.fixture
def looked_at(monkeypatch) -> set[tuple[str, str]]:
    """The matches' outputs that are looked at from now on: noun and name."""
    seen = set[tuple[str, str]]()
    whole = type(STAGES).done

    def done(self, store, stage, output, *others):
        if output.match is not None:
            seen.add((stage.noun, output.name))
        return whole(self, store, stage, output, *others)

    monkeypatch.setattr(type(STAGES), "done", done)
    return seen


def receipt_at(folder: Path, noun: str, name: str) -> Path:
    return folder / noun / f"{name}{RECEIPT}"


def matches(folder: Path) -> list[str]:
    return sorted(receipt.name for receipt in Store(folder).receipts("matches"))


def test_found_done(data, looked_at):
    """Outputs found done are not looked at again, and the report is the same."""
    report = nothing_new(Store(data), Settings())
    assert report is not None
    assert looked_at == set()
    (data / ".done.json").unlink()
    again = nothing_new(Store(data), Settings())
    assert again is not None
    assert again.model_copy(update={"legs": []}) == report.model_copy(update={"legs": []})  # their seconds vary
    assert {name for _, name in looked_at} == set(matches(data))


@pytest.mark.parametrize("noun", ["matches", "sides", "goals", "sequences"])
def test_receipt_changed(data, looked_at, noun):
    """A receipt that was written again has its own match looked at, and no other."""
    name = matches(data)[0]
    path = receipt_at(data, noun, name)
    copy = path.read_bytes()
    path.unlink()
    path.write_bytes(copy)
    os.utime(path, ns=(10**18, 10**18))
    assert nothing_new(Store(data), Settings()) is not None
    assert {name for _, name in looked_at} == {name}


def test_receipt_removed(data, looked_at):
    """An output without a receipt is new work."""
    name = matches(data)[0]
    receipt_at(data, "goals", name).unlink()
    assert nothing_new(Store(data), Settings()) is None
    assert {name for _, name in looked_at} == {name}


def test_written_just_now(data, looked_at):
    """A receipt of this second is always looked at: a later one might have its stamp."""
    name = matches(data)[0]
    for _ in range(2):
        os.utime(receipt_at(data, "goals", name))
        assert nothing_new(Store(data), Settings()) is not None
        assert ("goals", name) in looked_at
        looked_at.clear()


def test_other_settings(data, looked_at):
    """Other settings of a stage are new work; with the first settings all is known to be done."""
    assert nothing_new(Store(data), OTHER) is None
    assert ("sequences", matches(data)[0]) in looked_at
    looked_at.clear()
    assert nothing_new(Store(data), Settings()) is not None
    assert looked_at == set()


@pytest.mark.parametrize("spoil", [
    distrust,
    freshness.forget_freshness,
    lambda store: (store.root / ".done.json").write_text("{"),
    lambda store: (store.root / ".done.json").write_bytes(
        (store.root / ".done.json").read_bytes().replace(b'"sides ', b'"sidez ')),
], ids=["verify found damage", "forgotten", "no JSON", "edited"])
def test_forgotten(data, looked_at, spoil):
    """Without a cache that is whole, everything is looked at."""
    spoil(Store(data))
    assert nothing_new(Store(data), Settings()) is not None
    assert {name for _, name in looked_at} == set(matches(data))


@pytest.fixture
def asked(data, monkeypatch) -> Callable[..., bool]:
    """Runs the stages; True if the run asked outputs whether they are done."""
    calls = list[bool]()
    whole = run.bring_up_to_date
    monkeypatch.setattr(run, "bring_up_to_date", lambda *args, **others: (calls.append(True), whole(*args, **others)))

    def asks(settings=Settings(), **others) -> bool:
        before = len(calls)
        found = run.run(data, [], settings, **others)
        assert (found.made, found.failures, found.knowledge, found.policy) == (0, {}, 1, 1)
        assert {stage.noun: stage.kept for stage in found.stages}["goals"] == len(matches(data))
        assert found.notes == first.notes
        return len(calls) > before

    first = run.run(data, [])
    return asks


def test_idle(data, asked):
    """A run with nothing new after a run with nothing new asks no output; it reports the same."""
    asked()
    assert not asked()
    os.utime(receipt_at(data, "goals", matches(data)[0]))
    assert asked(), "a receipt was touched"
    asked()
    assert not asked()
    freshness.forget_freshness(Store(data))
    assert asked()


def test_no_longer_idle(data, asked):
    """Other settings, a file that is lost, and a folder that is doubted are looked at in full."""
    asked()
    assert not asked()
    assert asked(train=False)
    found = run.run(data, [], OTHER)
    assert found.made
    lost = next((data / "goals").glob("*.parquet"))
    lost.unlink()
    run.run(data, [], OTHER)
    assert lost.exists()
