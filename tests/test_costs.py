"""Costs of a run: a row a stage, measured where the pieces are done."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import fill, run
from hypothesis import given
from hypothesis import strategies as st
from support.buckets import files
from support.prefect_client import post

from pitchlore.pipeline.engine.costs import Cost, Spent
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.outputs import RECEIPT

OF_MATCHES = [noun for noun in STAGES.of_matches if noun != "matches"]


def kept(data: Path, noun: str) -> int:
    """Bytes of the outputs of a noun and of their receipts."""
    store = Store(data)
    return sum(record.size for receipt in store.receipts(noun) for record in receipt.files.values()) + sum(
        path.stat().st_size for path in (data / noun).iterdir() if path.name.endswith(RECEIPT))


@pytest.fixture(scope="module")
def at_places(tmp_path_factory, clips, prefect_server) -> dict[str, tuple[Path, RunReport]]:
    """The data folder and the report of a flow on threads, and of a run by the engine on processes."""
    from pitchlore.flows.run import run_flow

    flow, engine = (tmp_path_factory.mktemp("costs") for _ in range(2))
    for data in (flow, engine):
        fill(data, clips)
    return {"threads:2": (flow, RunReport.model_validate(run_flow(flow, on="threads:2"))),
            "processes:2": (engine, run(engine, on="processes:2"))}


@pytest.mark.slow
@pytest.mark.parametrize("place", ["threads:2", "processes:2"])
def test_a_row_a_stage(at_places, place):
    """Each stage says its pieces, its bytes to the byte, and its slowest piece; so do the versions."""
    data, report = at_places[place]
    assert list(report.costs) == ["matches", *OF_MATCHES, "knowledge", "policies"]
    for noun, cost in report.costs.items():
        assert 0 < cost.slowest_s <= cost.seconds, noun
        if noun in OF_MATCHES:
            made = report.stage(noun).made
            assert (cost.pieces, cost.bytes_out) == (len(made), kept(data, noun)), noun
            assert cost.slowest in made
    matches = report.costs["matches"]
    recordings = list((data / "inbox").iterdir())
    assert (matches.pieces, matches.bytes_out) == (len(recordings), kept(data, "matches"))
    assert matches.bytes_in == sum(file.stat().st_size for file in recordings)
    # a stage reads what its stage group has not read before: trajectories the log, behaviours the sequences
    store = Store(data)
    logs = sum(receipt.files["log"].size for receipt in store.receipts("matches"))
    assert report.costs["trajectories"].bytes_in == logs
    sequences = sum(receipt.files["sequences"].size for receipt in store.receipts("sequences"))
    assert report.costs["behaviours"].bytes_in % sequences == 0 < report.costs["behaviours"].bytes_in
    folder = store.version_folder("knowledge", 1)
    assert report.costs["knowledge"].bytes_out == sum(path.stat().st_size for path in folder.iterdir())
    assert report.costs["policies"].slowest == "version 1"


@pytest.mark.slow
def test_the_same_at_places(at_places):
    """Where work is done, and whether by a flow, changes no count, and no byte that is kept."""
    (threads, one), (processes, other) = at_places.values()
    counts = [{noun: (cost.pieces, cost.bytes_in, cost.bytes_out) for noun, cost in report.costs.items()}
              for report in (one, other)]
    assert counts[0] == counts[1]
    assert files(threads) == files(processes)


@pytest.mark.slow
def test_failed_piece(tmp_path, clips, monkeypatch):
    """A piece that fails has cost something, too; no later stage has a piece."""
    def refuse(*_: object) -> None:
        raise ZeroDivisionError

    fill(tmp_path, clips)
    monkeypatch.setattr("pitchlore.pipeline.stages.goals.attribute", refuse)
    report = run(tmp_path)
    failed = report.stage("goals")
    assert (len(failed.failed), failed.cost.pieces, failed.cost.bytes_out > 0) == (2, 2, True)  # the quarantine's
    assert failed.cost.seconds > 0
    assert list(report.costs) == ["matches", "sides", "trajectories", "situations", "options", "goals"]


@pytest.mark.slow
def test_artifact(at_places):
    """The artifact of a flow has a row for each stage, with what it cost."""
    _, report = at_places["threads:2"]
    asked = {"artifacts": {"key": {"any_": ["run"]}}, "sort": "CREATED_DESC", "limit": 50}
    shown = [artifact["data"] for artifact in post("/artifacts/filter", asked)]
    assert report.markdown() in shown
    for noun, cost in report.costs.items():
        (row,) = [line for line in report.markdown().splitlines()
                  if line.startswith(f"| {noun} | {cost.pieces} | {cost.seconds:.2f} | ")]
        assert row.endswith(f" | {cost.slowest_s:.2f} |")


@given(st.lists(st.tuples(st.text(min_size=1), st.floats(0, 1e6), st.integers(0, 1 << 50), st.integers(0, 1 << 50)), min_size=1))
def test_adding_up(pieces):
    """Sums are of all pieces, in whatever parts they come; the slowest is one that took longest."""
    whole, halves = Cost(), [Cost(), Cost()]
    for number, (name, *spent) in enumerate(pieces):
        whole.add(name, Spent(*spent))
        halves[number % 2].add(name, Spent(*spent))
    halves[0].include(halves[1])
    assert whole.pieces == halves[0].pieces == len(pieces)
    assert (whole.bytes_in, whole.bytes_out) == (halves[0].bytes_in, halves[0].bytes_out) == (
        sum(read for _, _, read, _ in pieces), sum(written for *_, written in pieces))
    assert whole.slowest_s == halves[0].slowest_s == max(seconds for _, seconds, *_ in pieces)
    assert (whole.slowest, whole.slowest_s) in {(name, seconds) for name, seconds, *_ in pieces}
    assert whole.seconds == pytest.approx(halves[0].seconds)
    assert whole.seconds == pytest.approx(sum(seconds for _, seconds, *_ in pieces))
