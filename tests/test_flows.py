"""End to end: new things are made once, bad matches step aside, the rest goes on; flows make the same bytes."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import ROOT, clip, fill, run
from prefect import Flow
from support.mcap_logs import written

from pitchlore.flows.run import (
    evaluation_flow,
    flow_of,
    matches_flow,
    paradigms_flow,
    run_flow,
    season_flow,
    training_flow,
)
from pitchlore.pipeline import matches as log_format
from pitchlore.pipeline.base.errors import BadRecording, StorageFailed
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording, inbox
from pitchlore.pipeline.engine.run import train_policy
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import (
    BehaviourSettings,
    GramSettings,
    PolicySettings,
    Settings,
)
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Occasions, Policies

pytestmark = pytest.mark.slow


def products(data: Path) -> dict[str, bytes]:
    """Everything that a run makes, but the catalogue, what is remembered, the log of runs and the claims."""
    return {
        str(p.relative_to(data)): p.read_bytes()
        for p in sorted(data.rglob("*"))
        if p.is_file() and "inbox" not in p.parts and p.suffix not in (".duckdb", ".claim") and p.name not in (".done.json", ".idle.json", ".looked.json", ".recordings.json")
        and p.parent.name != "runs"
    }


def test_second_run(tmp_path, clips, finished):
    """One run makes everything, of the same inputs the same bytes, and the next one nothing."""
    fill(tmp_path, clips)
    first = run(tmp_path)
    assert first.failures == {}
    assert [s.noun for s in first.stages] == [
        "matches", "sides", "trajectories", "situations", "options", "goals", "events", "analysis", "moments", "models",
        "chances", "values", "sequences", "acts", "behaviours", "decisions"]
    assert [len(s.made) for s in first.stages] == [2, 2, 2, 2, 2, 2, 2, 2, 2, 1, 2, 2, 2, 2, 1, 1]
    assert (first.knowledge, first.knowledge_is_new, first.policy, first.policy_is_new) == (1, True, 1, True)
    assert products(tmp_path) == products(finished)
    second = run(tmp_path)
    assert second.made == 0
    assert [s.kept for s in second.stages] == [2, 2, 2, 2, 2, 2, 2, 2, 2, 1, 2, 2, 2, 2, 1, 1]
    assert products(tmp_path) == products(finished)


def test_new_match(copied):
    """A new match makes only what depends on it."""
    clip(100.0, 130.0).write_csv(copied / "inbox" / "third.csv")
    report = run(copied)
    made = {s.noun: len(s.made) for s in report.stages}
    assert [made[n] for n in ("matches", "trajectories", "situations", "goals")] == [1, 1, 1, 1]
    assert (report.knowledge, report.policy) == (2, 2)
    assert Store(copied).manifest("knowledge", 2).parent == 1


def test_other_settings(copied):
    """Other settings remake only their stage and what follows."""
    report = run(copied, settings=Settings(grams=GramSettings(alpha=0.99)))
    made = {s.noun: len(s.made) for s in report.stages}
    assert made["matches"] == made["trajectories"] == made["situations"] == made["goals"] == 0
    assert made["sequences"] > 0
    report = run(copied, settings=Settings(
        grams=GramSettings(alpha=0.99), behaviours=BehaviourSettings(value_over=-1.0)))
    assert {s.noun: len(s.made) for s in report.stages}["behaviours"] == 1


def test_bad_match_and_disk_error(tmp_path, clips, monkeypatch):
    """A bad match is quarantined, and the others finish; after a disk error the work is tried again."""
    fill(tmp_path, clips)
    (tmp_path / "inbox" / "broken.csv").write_text("this is not a match\n")
    commit, failures = Store.commit, [2]

    def flaky(self, work, made, sources=()):
        if work.noun == "situations" and failures[0]:
            failures[0] -= 1
            raise StorageFailed("cannot be written (No space left on device)")
        return commit(self, work, made, sources)

    monkeypatch.setattr(Store, "commit", flaky)
    report = run(tmp_path)
    assert failures == [0]
    (what, why), = report.failures.items()
    assert what.endswith("broken.csv")
    assert why
    assert [len(stage.made) for stage in report.stages][:4] == [2, 2, 2, 2]
    (record,) = Store(tmp_path).quarantined()
    assert record.noun == "matches"
    assert record.name.startswith("broken-")


def test_import_twice(tmp_path, clips):
    """Importing a recording twice gives one match."""
    store = Store(tmp_path)
    file = clips / "early.parquet"
    receipt, new, _ = take_in(store, Recording(file=file))
    assert new
    renamed = tmp_path / "Another Name.parquet"
    shutil.copy(file, renamed)
    ours = tmp_path / receipt.files["log"].path
    for again in (file, renamed, ours):
        assert take_in(store, Recording(file=again))[:2] == (receipt, False)
    assert len(list(store.receipts("matches"))) == 1


def test_whole_after_damaged(tmp_path, clips):
    """A damaged log is replaced by the whole one, and never the other way round."""
    there, here = Store(tmp_path / "there"), Store(tmp_path / "here")
    sent, *_ = take_in(there, Recording(file=clips / "early.parquet"))
    whole = there.root / sent.files["log"].path
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size * 2 // 3])
    first, *_ = take_in(here, Recording(file=cut))
    assert not first.details["complete"]
    second, new, _ = take_in(here, Recording(file=whole))
    assert new
    assert second.name == first.name
    assert second.details["complete"]
    third, new, _ = take_in(here, Recording(file=cut))
    assert (third, new) == (second, False)


def test_one_id_twice(tmp_path, clips):
    """Another match of the same id is refused."""
    store = Store(tmp_path)
    receipt, *_ = take_in(store, Recording(file=clips / "early.parquet"))
    log = log_format.read(store.read(receipt, "log"), where="log")
    path = tmp_path / "impostor.mcap"
    path.write_bytes(written(replace(log, info=log.info.model_copy(update={"home": "impostors"}))))
    with pytest.raises(BadRecording, match="another match is here"):
        take_in(store, Recording(file=path))
    assert store.receipt("matches", receipt.name) == receipt


def test_inbox_maps(tmp_path):
    """The inbox pairs maps with recordings."""
    folder = tmp_path / "inbox" / "league"
    folder.mkdir(parents=True)
    for name in ("a.csv", "a.csv.toml", "b.csv", ".hidden"):
        (folder / name).touch()
    found = inbox(Store(tmp_path))
    assert [(r.file.name, r.mapping and r.mapping.name) for r in found] == [("a.csv", "a.csv.toml"), ("b.csv", None)]


@pytest.mark.usefixtures("prefect_server")
def test_flows_and_engine(tmp_path, clips, finished):
    """Flows make the bytes that the engine makes by itself, and their results are JSON."""
    fill(tmp_path, clips)
    imported = matches_flow(tmp_path, on="threads:1")
    assert json.loads(json.dumps(imported)) == imported
    assert len(imported["made"]) == 2
    for stage in STAGES.computed():
        assert flow_of(stage.noun)(tmp_path)["failed"] == {}
    assert flow_of("knowledge")(tmp_path).items() >= {"version": 1, "new": True, "failed": {}}.items()
    assert training_flow(tmp_path).items() >= {"version": 1, "new": True, "failed": {}}.items()
    assert products(tmp_path) == products(finished)
    whole = run_flow(tmp_path)
    assert (whole["knowledge"], whole["knowledge_is_new"]) == (1, False)
    assert products(tmp_path) == products(finished)


def test_other_training(copied):
    """Training with other settings begins anew and counts each match once; by states, of exactly the pairs that were seen."""
    assert train_policy(copied).new is False
    for sweeps, version in ((5, 2), (9, 3)):
        made = train_policy(copied, Settings(policies=PolicySettings(learner="sarsa", sweeps=sweeps)))
        assert (made.version, made.new, made.failed) == (version, True, {})
    store = Store(copied)
    assert store.manifest("policies", 3).parent is None, "the others have learned from these matches"
    tables = [store.read_table(store.manifest("policies", v), "policies", Policies) for v in (2, 3)]
    learned = ("version", "q")
    assert tables[0].drop(learned).equals(tables[1].drop(learned)), "visits count each match once"
    assert not tables[0]["q"].equals(tables[1]["q"])
    known = store.latest("knowledge")
    occasions = store.read_table(known, "occasions", Occasions).filter(**store.manifest("policies", 3).details["imitates"])
    pairs = ["role", "key", "state", "behaviour_id"]
    assert tables[0].height == occasions.height == tables[0].join(occasions, on=pairs).height


def test_flow_from_file(monkeypatch):
    """Prefect runs a deployment's flow from its file, where annotations must be real types."""
    from prefect.flows import load_flow_from_entrypoint

    monkeypatch.chdir(ROOT)
    loaded = load_flow_from_entrypoint("flows/run.py:run_flow")
    parameters = loaded.validate_parameters({"data": "data", "settings": {"policies": {"sweeps": 2}}})
    assert parameters["settings"].policies.sweeps == 2


def test_no_pickles():
    """Prefect keeps results as JSON and never as pickles."""
    of_nouns = [flow_of(noun) for noun, stage in STAGES.items() if stage.compute is not None]
    found = [*of_nouns, matches_flow, run_flow, season_flow, paradigms_flow, evaluation_flow, training_flow]
    assert all(isinstance(flow, Flow) for flow in found)
    assert {flow.result_serializer for flow in found} == {"json"}
