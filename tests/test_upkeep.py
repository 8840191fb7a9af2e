"""The commands that keep the data folder tidy."""

from __future__ import annotations

import shutil

import pytest

from pitchlore.flows.cli import main
from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made, Work


@pytest.fixture
def data(tmp_path, finished):
    return shutil.copytree(finished, tmp_path / "data")


def call(*words: object) -> int:
    with pytest.raises(SystemExit) as stop:
        main([str(word) for word in words])
    return int(stop.value.code or 0)


def test_quarantine(data, capsys):
    """Quarantine is listed with its reasons and can be cleared."""
    assert call("quarantine", "--data", data) == 0
    assert "nothing is in quarantine" in capsys.readouterr().out
    Store(data).quarantine("goals", "m-1", BadRecording("is odd", where="row 3", next_step="Mend it"))
    assert call("quarantine", "--json", "--data", data) == 0
    assert '"reason": "row 3: is odd. Mend it."' in capsys.readouterr().out
    assert call("quarantine", "--clear", "--data", data) == 0
    assert Store(data).quarantined() == []


def test_forget(data, capsys):
    """Forget removes a match and all outputs of it; the knowledge stays."""
    store = Store(data)
    name, other = (receipt.name for receipt in store.receipts("matches"))
    assert call("forget", name, "--data", data) == 0
    assert f"{len(STAGES.nouns(Per.MATCH))} outputs removed" in capsys.readouterr().out
    assert not [path for path in data.rglob(f"*{name}*") if "inbox" not in path.parts]
    assert [receipt.name for receipt in store.receipts("situations")] == [other]
    assert store.versions("knowledge") == [1]
    assert call("forget", name, "--data", data) == 1
    assert "there is no such match" in capsys.readouterr().err


def test_forget_by_beginning(data, capsys):
    """Forget takes the beginning of an id, as replay does, and refuses to choose."""
    store = Store(data)
    name, other = (receipt.name for receipt in store.receipts("matches"))
    store.commit(Work("matches", "early-2", {}, version=1), Made())
    assert call("forget", "early", "--data", data) == 1
    assert f"several matches begin so (there are: {name}, early-2). Name one of them." in capsys.readouterr().err
    assert call("forget", "", "--data", data) == 1
    assert "no match is named" in capsys.readouterr().err
    assert call("forget", name[:8], "--data", data) == 0
    assert f"{name}: {len(STAGES.nouns(Per.MATCH))} outputs removed" in capsys.readouterr().out
    assert [receipt.name for receipt in store.receipts("matches")] == ["early-2", other]


def test_prune(data, capsys):
    """Prune removes superseded files and nothing that a receipt names."""
    before = {path: path.read_bytes() for path in data.rglob("*") if path.is_file()}
    stray = data / "goals" / "early-000000000000-0123456789ab.goals.parquet"
    stray.write_bytes(b"old")
    assert call("prune", "--data", data) == 0
    assert "1 superseded files removed" in capsys.readouterr().out
    assert not stray.exists()
    assert {path: path.read_bytes() for path in before if path.suffix != ".duckdb"} == {
        path: data for path, data in before.items() if path.suffix != ".duckdb"}
