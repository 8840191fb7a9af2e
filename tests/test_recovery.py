"""Faults are named, mended and forgotten: nothing good is left out for ever."""

import dataclasses
import shutil

import polars as pl
import pytest
from conftest import clip, fill, run

from pitchlore.pipeline.engine.catalog import catalog_path
from pitchlore.pipeline.engine.imports import import_all
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording, with_map
from pitchlore.pipeline.engine.run import make_stage, make_version
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.settings import (
    BehaviourSettings,
    KnowledgeSettings,
    RoundSettings,
    Settings,
    TrajectorySettings,
)
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask


@pytest.fixture
def data(copied):
    """A finished data folder of one's own, without its inbox."""
    shutil.rmtree(copied / "inbox")
    return copied


def matches_known(data) -> int:
    return Store(data).latest("knowledge").details["matches"]


def test_mended_match(data):
    """A match whose log is damaged is left out when its log is read again; mended, it counts again."""
    store = Store(data)
    receipt = next(iter(store.receipts("matches")))
    path = data / receipt.files["log"].path
    whole = path.read_bytes()
    path.write_bytes(whole[:-1] + b"?")
    assert run(data).made == 0, "what was made of it still holds"
    report = run(data, settings=Settings(trajectories=TrajectorySettings(gap_s=0.6)))
    assert set(report.failures) == {f"matches {receipt.name}", f"trajectories {receipt.name}"}
    assert "Import the recording again" in report.failures[f"matches {receipt.name}"]
    assert [record.noun for record in store.quarantined()] == ["trajectories"]
    assert (report.knowledge, matches_known(data)) == (2, 1), "the knowledge is emitted without it"
    path.write_bytes(whole)
    assert run(data).failures == {}
    assert store.quarantined() == []
    assert matches_known(data) == 2
    assert run(data).made == 0


def test_failure_everywhere(tmp_path, clips, finished, monkeypatch):
    """A failure in every match emits nothing and loses nothing."""
    fill(tmp_path, clips)

    def broken(*_args, **_kwargs):
        raise ZeroDivisionError("sequences")

    with monkeypatch.context() as patch:
        patch.setattr("pitchlore.pipeline.stages.sequences.derive.sequences", broken)
        report = run(tmp_path)
    assert len(report.failures) == 2
    assert report.knowledge is report.policy is None
    assert run(tmp_path).failures == {}
    for noun in ("knowledge", "policies"):
        made, wanted = Store(tmp_path).manifest(noun, 1), Store(finished).manifest(noun, 1)
        assert made == wanted


def test_rounds(data):
    """The lengths of behaviours are those of the rounds in the settings."""
    two = Settings(behaviours=BehaviourSettings(rounds=(
        RoundSettings(n=3, rows=3, columns=4, activation=0.08),
        RoundSettings(n=1, rows=5, columns=5, activation=0.04),
    )))
    report = run(data, settings=two)
    assert (report.failures, report.knowledge) == ({}, 2)
    lengths = ask(catalog_path(Store(data)), "select distinct n from behaviours where version = 2 order by n")
    assert set(lengths["n"]) <= {1, 3}
    assert lengths.height


def test_nothing_selected(data):
    """A run whose settings select nothing still finishes, says so, and makes no empty version."""
    before = Store(data).latest("knowledge").version
    nothing = Settings(behaviours=BehaviourSettings(value_over=1.0))
    report = run(data, settings=nothing)
    assert report.failures == {}
    assert report.notes[0].startswith("No knowledge and no policy were made: no behaviour went with better chances beyond chance in 2 matches")
    assert Store(data).latest("knowledge").version == before


def test_copies(tmp_path):
    """Copies imported at once are one match."""
    folder = tmp_path / "same"
    folder.mkdir()
    clip(0.0, 5.0).write_csv(folder / "copy0.csv")
    for index in range(1, 8):
        shutil.copy(folder / "copy0.csv", folder / f"copy{index}.csv")
    store = Store(tmp_path / "data")
    report = import_all(store, [Recording(file=file) for file in sorted(folder.iterdir())])
    assert (len(report.made), report.kept, report.failed) == (1, 7, {})
    assert len(list(store.receipts("matches"))) == 1


@pytest.mark.parametrize("harm", ["lost", "damaged"])
def test_lost_log(tmp_path, clips, harm):
    """A match whose log is lost or damaged can be imported again."""
    store = Store(tmp_path)
    recording = Recording(file=clips / "early.parquet")
    receipt, *_ = take_in(store, recording)
    path = tmp_path / receipt.files["log"].path
    if harm == "lost":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:-1] + b"?")
    assert take_in(store, recording)[:2] == (receipt, True)
    assert store.intact(receipt)
    assert take_in(store, recording)[:2] == (receipt, False)


def raised(monkeypatch, noun):
    """Another version of a stage."""
    stages = {**STAGES, noun: dataclasses.replace(STAGES[noun], version=STAGES[noun].version + 1)}
    monkeypatch.setattr(STAGES, "_stages", stages)


def test_other_version(tmp_path, clips, monkeypatch):
    """Another version of the stage imports a match anew, under the same name."""
    store = Store(tmp_path)
    file = clips / "early.parquet"
    receipt, *_ = take_in(store, Recording(file=file))
    renamed = tmp_path / "renamed.parquet"
    shutil.copy(file, renamed)
    raised(monkeypatch, "matches")
    again, new, _ = take_in(store, Recording(file=renamed))
    assert new
    assert again.name == receipt.name
    assert again.key != receipt.key


def test_single_stages(data):
    """Every noun can be made by itself: what is missing."""
    store = Store(data)
    for noun in ("trajectories", "situations", "goals", "decisions"):
        store.forget(noun, next(iter(store.receipts(noun))).name)
    for noun in ("trajectories", "situations", "goals"):
        report = make_stage(noun, data)
        assert (len(report.made), report.kept, report.failed) == (1, 1, {})
    assert make_stage("sequences", data).kept == 2
    assert make_stage("behaviours", data).kept == 1
    assert len(make_stage("decisions", data).made) == 1
    for noun in STAGES.versioned:
        made = make_version(noun, data)
        assert (made.version, made.new, made.failed) == (1, False, {})
    assert ask(catalog_path(store), "select count(distinct match_id) from decisions").item() == 2


def test_stage_too_early(tmp_path, clips):
    """A stage before its turn says what to run first and blames no match."""
    store = Store(tmp_path)
    take_in(store, Recording(file=clips / "early.parquet"))
    (why,) = make_stage("situations", tmp_path).failed.values()
    assert "Run the stage trajectories first" in why
    assert store.quarantined() == []


def test_other_state_key(data):
    """A policy of another state key lends no value."""
    report = run(data, settings=Settings(knowledge=KnowledgeSettings(state_key="ego19", backoff=())))
    assert (report.failures, report.policy) == ({}, 2)
    (roles,) = Store(data).manifest("policies", 2).details["tables"].values()
    assert all(counts["new_pairs"] == counts["pairs"] for counts in roles.values())


def flaws(store: Store) -> dict[str, dict[str, int]]:
    return {receipt.name: receipt.details["flaws"] for receipt in store.receipts("matches")}


def test_corrected_map(tmp_path):
    """A corrected map replaces the match that was read with the wrong one."""
    file = tmp_path / "derby.csv"
    clip(0.0, 10.0).with_columns(pl.col("x", "y") * 100).write_csv(file)
    maps = tmp_path / "derby.csv.toml"
    store = Store(tmp_path / "data")
    maps.write_text('[units]\nlength = "m"\n[pitch]\nkind = "vsss"\nlength = 1.5\nwidth = 1.3\n')
    wrong, *_ = take_in(store, with_map(file))
    assert flaws(store)[wrong.name]["off the pitch"] > 1000
    maps.write_text('[units]\nlength = "cm"\n[pitch]\nkind = "vsss"\nlength = 1.5\nwidth = 1.3\n')
    right, new, _ = take_in(store, with_map(file))
    assert new
    assert [receipt.name for receipt in store.receipts("matches")] == [wrong.name] == [right.name]
    assert "off the pitch" not in flaws(store)[right.name]
    assert take_in(store, with_map(file))[:2] == (right, False)


def test_plausibility_checks(tmp_path):
    """A match without a ball, or with goals without a scorer, is flagged."""
    store = Store(tmp_path / "data")
    file = tmp_path / "odd.csv"
    table = clip(0.0, 10.0).drop("score_home", "score_away")
    table.filter(pl.col("team") != "ball").with_columns(
        game_state=pl.col("game_state").str.replace("goal_b+kickoff_y", "goal+kickoff", literal=True)
    ).write_csv(file)
    receipt, *_ = take_in(store, with_map(file))
    assert flaws(store)[receipt.name]["ball lost"] == 400
    assert flaws(store)[receipt.name]["scorer unknown"] == 2
