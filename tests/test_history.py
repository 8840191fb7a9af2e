"""The log of runs, the command that lists it, and what is forgotten: old entries, old flow runs in Prefect."""

from __future__ import annotations

import json
import os
import re
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import pytest
from conftest import clip, fill, run
from prefect import flow, runtime
from support.prefect_client import flow_run, post

from pitchlore.flows import pruning
from pitchlore.flows.flow import our_flow
from pitchlore.flows.pruning import prune
from pitchlore.flows.run import run_flow
from pitchlore.pipeline.base.errors import BadSettings, NotFound, StorageFailed
from pitchlore.pipeline.engine import history
from pitchlore.pipeline.engine.costs import Cost
from pitchlore.pipeline.engine.history import LOG, Note, log, noted
from pitchlore.pipeline.engine.progress import RunReport, StageReport
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.tasks import run_pieces
from pitchlore.pipeline.settings import HistorySettings
from pitchlore.pipeline.store import Store

FEW = HistorySettings(runs=3)


def names(store: Store) -> list[str]:
    return [entry.name for entry in log(store).entries]


def full(*_: object) -> None:
    raise StorageFailed("cannot be written (No space left on device)", where="runs")


def test_bounded(tmp_path):
    """The last runs stay, in order; with 0 none does; nothing else of the folder is touched."""
    store = Store(tmp_path)
    (tmp_path / LOG).mkdir()
    (tmp_path / LOG / "notes.txt").write_text("mine")
    written = []
    for _ in range(5):
        with noted(store, "run", FEW):
            pass
        written += [name for name in names(store) if name not in written]
    assert len(written) == 5
    assert sorted(names(store)) == sorted(written)[-3:]
    Note("run").write(store, HistorySettings(runs=0))
    assert names(store) == []
    assert (tmp_path / LOG / "notes.txt").read_text() == "mine"


def test_clock_that_was_ahead(tmp_path, monkeypatch):
    """Runs of a clock that was ahead hide none that began after it was set right, and go first."""
    store = Store(tmp_path)

    def at(year: int) -> str:
        with monkeypatch.context() as patch:
            patch.setattr(history, "datetime", SimpleNamespace(now=lambda zone: datetime(year, 1, 1, tzinfo=zone)))
            Note("run").write(store, FEW)
            return " ".join(name[:4] for name in names(store))

    assert [at(year) for year in (2090, 2091, 2092, 2026, 2027, 1970, 2028)] == [
        "2090", "2090 2091", "2090 2091 2092", "2091 2092 2026", "2092 2026 2027", "2027 2092 1970", "1970 2027 2028"]


def test_ended_early(tmp_path, monkeypatch):
    """A run that an error ends is in the log with it and with what was made before; the error goes on.

    If the log cannot be written either, the run's error is what is said.
    """
    store = Store(tmp_path)

    def broken() -> None:
        with noted(store, "run", FEW) as note:
            note.report.stages.append(StageReport(noun="matches", made=["derby"], kept=2))
            raise NotFound("no cheese")

    with pytest.raises(NotFound, match="no cheese"):
        broken()
    monkeypatch.setattr(Store, "keep", full)
    with pytest.raises(NotFound, match="no cheese"):
        broken()
    (entry,) = log(store).entries
    assert (entry.made, entry.kept, entry.failed, entry.error) == (1, 2, 0, "no cheese.")


def test_log_not_written(tmp_path, monkeypatch):
    """A log that cannot be written is one more failure of the run, and ends it not."""
    monkeypatch.setattr(Store, "keep", full)
    with noted(Store(tmp_path), "run", FEW) as note:
        pass
    assert list(note.report.failures) == [f"{LOG} log"]


def test_many_failures(tmp_path):
    """The first of many failures are reported and all are counted: an entry stays small."""
    store, report = Store(tmp_path), RunReport()
    report.stage("goals").failed |= {f"m{n}": "is broken." for n in range(1_000)}
    report.stage("sides").made += [f"m{n}" for n in range(100_000)]
    with noted(store, "run", FEW) as note:
        note.report = report
    (entry,) = log(store).entries
    assert (entry.failed, len(entry.failures), entry.made) == (1_000, 20, 100_000)
    (path,) = (tmp_path / LOG).glob("*.json")
    assert path.stat().st_size < 4_000


def test_damaged(tmp_path, call):
    """A damaged entry is named with what to do, and the others are listed."""
    store = Store(tmp_path)
    for _ in range(2):
        Note("run").write(store, FEW)
    first, _ = sorted((tmp_path / LOG).glob("*.json"))
    first.write_text(first.read_text().replace('"run"', '"ran"'))
    code, out, err = call("runs", "--json", "--data", tmp_path)
    assert (code, len(json.loads(out)), err.count("\n")) == (3, 1, 1)
    assert str(first) in err
    assert "Remove it: only what `pitchlore runs` says of that run is lost." in err


@pytest.mark.slow
def test_command(tmp_path, call, monkeypatch):
    """The command lists what commands did, without a server: import, run, a failure, nothing new, train."""
    (tmp_path / "inbox").mkdir()
    clip(0.0, 40.0).write_csv(tmp_path / "derby.csv")
    assert call("import", tmp_path / "derby.csv", "--data", tmp_path)[0] == 0
    assert call("run", "--data", tmp_path)[0] == 0
    (tmp_path / "inbox" / "notes.txt").write_text("dear diary")
    assert call("run", "--data", tmp_path)[0] == 1
    (tmp_path / "inbox" / "notes.txt").unlink()
    assert call("run", "--data", tmp_path)[0] == 0
    assert call("train", "--data", tmp_path)[0] == 0
    monkeypatch.setenv("PREFECT_API_URL", "http://127.0.0.1:1/api")
    code, out, err = call("runs", "--json", "--data", tmp_path)
    assert (code, err) == (0, "")
    reported = json.loads(out)
    assert [entry["what"] for entry in reported] == ["import", "run", "run", "run", "train"]
    assert [entry["made"] for entry in reported] == [1, len([*STAGES.computed(), *STAGES.versioned]), 0, 0, 0]
    assert [entry["failed"] for entry in reported] == [0, 0, 1, 0, 0]
    assert (reported[1]["knowledge"], reported[1]["policy"]) == (1, 1)
    assert list(reported[2]["failures"]) == [f"matches {tmp_path}/inbox/notes.txt"]
    assert reported[1]["cost"]["bytes_out"] > reported[1]["cost"]["bytes_in"] // 100 > 0
    assert reported[3]["cost"] == Cost().model_dump()  # nothing new: nothing was worked on
    legs = reported[1]["legs"]
    assert {"sides to moments", "behaviours", "knowledge"} <= {leg["name"] for leg in legs}
    assert 0 < sum(leg["seconds"] for leg in legs) <= reported[1]["seconds"]
    assert sum(leg["work_s"] for leg in legs) == pytest.approx(reported[1]["cost"]["seconds"], abs=0.2)
    assert all(entry["seconds"] > 0 for entry in reported)
    assert [entry["began"] for entry in reported] == sorted(entry["began"] for entry in reported)
    code, out, _ = call("runs", "--last", "2", "--data", tmp_path)
    assert (code, len(re.findall(r"\d{8}-\d{6}-\d{6}", out))) == (0, 2)
    code, out, _ = call("runs", reported[2]["name"], "--data", tmp_path)
    assert code == 0
    assert f"failed matches {tmp_path}/inbox/notes.txt: " in out
    code, out, _ = call("runs", reported[1]["name"], "--data", tmp_path)
    assert all(noun in out for noun in ("trajectories", "behaviours", "knowledge", "policies", "busy", "the rest"))
    code, out, err = call("runs", "2", "--data", tmp_path)
    assert (code, err) == (1, f"pitchlore: {tmp_path}: 5 remembered runs are named '2'. `pitchlore runs` lists them.\n")


@pytest.mark.slow
def test_broken_off(tmp_path, clips, monkeypatch):
    """A run that breaks off is in the log, with the error and what was imported before."""
    def refuse(*_: object) -> None:
        raise BadSettings("has two captains", where="team.toml")

    fill(tmp_path, clips)
    monkeypatch.setattr("pitchlore.pipeline.engine.run.look_for_damage", refuse)
    with pytest.raises(BadSettings):
        run(tmp_path)
    (entry,) = log(Store(tmp_path)).entries
    assert (entry.what, entry.made, entry.error) == ("run", 2, "team.toml: has two captains.")


@pytest.fixture
def ours(prefect_server, monkeypatch):
    """A flow of ours with one task, whose runs no other test has; it returns the id of its run."""
    name = f"pitchlore-{os.urandom(4).hex()}"
    monkeypatch.setattr("pitchlore.flows.flow.OURS", name)
    monkeypatch.setattr(pruning, "OURS", name)

    @our_flow(name="ours")
    def flow() -> str:
        assert run_pieces(_nothing, "things", {"one": {}}).made == ["one"]
        return runtime.flow_run.id

    return flow


def _nothing() -> None:
    pass


@pytest.mark.slow
@pytest.mark.usefixtures("prefect_server")
def test_pruning(ours, monkeypatch):
    """Our old flow runs go from Prefect's database with their tasks; younger ones, running ones and others' stay."""
    @flow(name="ours", version="theirs")
    def theirs() -> str:
        return runtime.flow_run.id

    old, other, young = ours(), theirs(), ours()
    assert flow_run(old).flow_version == pruning.OURS
    running = post("/flow_runs/", {
        "flow_id": str(flow_run(old).flow_id), "flow_version": pruning.OURS, "state": {"type": "RUNNING"}})["id"]
    assert prune(HistorySettings()) == 0
    between = flow_run(other).end_time
    assert flow_run(old).end_time < between < flow_run(young).end_time
    monkeypatch.setattr(pruning, "_now", lambda: between + timedelta(days=28))
    assert prune(HistorySettings(days=0)) == 0
    assert prune(HistorySettings(days=28)) == 1
    assert flow_run(old) is None
    assert all(flow_run(name) for name in (young, other, running))
    left = post("/task_runs/filter", {"task_runs": {"flow_run_id": {"any_": [old, young]}}})
    assert {task["flow_run_id"] for task in left} <= {young}
    assert prune(HistorySettings(days=28)) == 0


@pytest.mark.slow
@pytest.mark.usefixtures("prefect_server")
def test_a_run_prunes(tmp_path, ours, monkeypatch):
    """A run removes our old flow runs; its settings say how old."""
    old = ours()
    monkeypatch.setattr(pruning, "_now", lambda: datetime.now(UTC) + timedelta(days=5))
    run_flow(tmp_path)
    assert flow_run(old)
    run_flow(tmp_path, history=HistorySettings(days=4))
    assert flow_run(old) is None


@pytest.mark.usefixtures("prefect_server")
def test_a_server_that_refuses(tmp_path, monkeypatch):
    """A server that refuses the removal ends no run."""
    def refuse(_: object) -> int:
        raise RuntimeError("not yours")

    monkeypatch.setattr(pruning, "prune", refuse)
    assert run_flow(tmp_path)["policy"] is None
