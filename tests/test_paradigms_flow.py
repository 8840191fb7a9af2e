"""Section 5 of the paper through the flow and the command line."""

import json
import re
from pathlib import Path

import polars as pl
import pytest

from pitchlore.flows.paradigms import play_paradigms
from pitchlore.pipeline.engine.paradigms import points_of, reports
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.stages.paradigms import experiments
from pitchlore.pipeline.stages.paradigms.experiments import Design
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.query import ask
from pitchlore.schemas import Paradigms, Verdicts

QUICK = Design(figures=(4, 5), runs=4, quick=True)


@pytest.fixture(scope="module")
def played(tmp_path_factory) -> tuple[Path, StageReport]:
    data = tmp_path_factory.mktemp("paradigms")
    return data, play_paradigms(data, QUICK)


@pytest.mark.slow
def test_catalogue_tables(played):
    """The points and verdicts are tables of the catalogue."""
    data, report = played
    assert report.failed == {}
    catalogue = data / "catalog.duckdb"
    points = ask(catalogue, "select * from paradigms")
    assert set(points.columns) == set(Paradigms.dtypes())
    assert set(points["figure"]) == {4, 5}
    assert set(points["runs"]) == {4}
    claims = ask(catalogue, "select distinct figure from verdicts order by 1")
    assert claims["figure"].to_list() == [4, 5]


def test_report_plot(played):
    """A report holds its verdicts and the plot of its figure."""
    data, _ = played
    store = Store(data)
    receipt = store.receipt("paradigms", reports(QUICK)[1].name)
    assert set(receipt.files) == {"verdicts", "figure-5"}
    assert store.read(receipt, "figure-5").startswith(b"\x89PNG")


def test_second_run(played):
    """A second run plays nothing again."""
    data, first = played
    again = play_paradigms(data, QUICK)
    assert again.made == []
    assert again.kept == len(first.made)


@pytest.mark.slow
def test_same_bytes(played, tmp_path):
    """Two folders hold the same tables and plots, byte for byte."""
    data, _ = played
    play_paradigms(tmp_path, QUICK)
    for path in sorted((data / "paradigms").iterdir()):
        if path.suffix in (".parquet", ".png"):
            assert (tmp_path / "paradigms" / path.name).read_bytes() == path.read_bytes(), path.name


@pytest.mark.slow
def test_failing_sweep(tmp_path, monkeypatch):
    """A sweep that fails is reported, and the others stand."""
    from pitchlore.pipeline.stages.paradigms import curves

    def broken(k):
        raise MemoryError("no room")

    monkeypatch.setattr(curves, "penalty", broken)
    report = play_paradigms(tmp_path, QUICK)
    failed = report.failed
    assert failed
    assert all(name.startswith("figure-4") for name in failed)
    assert all(reason == "MemoryError: no room" for reason in failed.values())
    assert "report-5-r4-s0-quick" in report.made
    assert "report-4-r4-s0-quick" not in report.made
    assert {record.noun for record in Store(tmp_path).quarantined()} == {"paradigms"}


def test_command_output(played, call):
    """The command prints numbers, verdicts and where the plot is, of the figure and the learners asked for."""
    data, _ = played
    code, out, _ = call("paradigms", "--figure", "5", "--runs", "4", "--quick", "--beside", "team", "--data", data)
    assert code == 0
    assert "Figure 5: climbing, 4 trainings a point" in out
    assert "equation 1 over joint actions" in out
    assert "IVQ never" not in out
    assert "IVQ sometimes converges to the optimum" in out
    assert "figure-5.png" in out
    assert "penalty" not in out


@pytest.mark.slow
def test_comparison(played, tmp_path, call, monkeypatch):
    """The comparison plays printed IVQ and IQ on seeds of its own, and gives their difference with its interval."""
    data, _ = played
    monkeypatch.setattr(experiments, "CONFIRMATION_RUNS", 60)
    words = ["paradigms", "--figure", "5", "--runs", "4", "--quick", "--comparison", "--data", data]
    code, out, _ = call(*words, "--export", tmp_path)
    assert code == 0
    (reported,) = re.findall(r"IVQ less IQ, 60 trainings each, seed 2000: (-?[0-9.]+) \[(-?[0-9.]+), (-?[0-9.]+)\]", out)
    points = pl.read_csv(tmp_path / "figure-5-r4-s0-quick.comparison.csv")
    assert points.select("learner", "reading", "decay", "runs", "seed").sort("learner").rows() == [
        ("IQ", "printed", 0.9997, 60, 2000), ("IVQ", "printed", 0.9997, 60, 2000)]
    (lead,) = pl.read_csv(tmp_path / "figure-5-r4-s0-quick.leads.csv").iter_rows(named=True)
    iq, ivq = points.sort("learner")["p_optimal"]
    assert lead["difference"] == pytest.approx(ivq - iq, abs=2e-4)
    assert lead["low"] < lead["difference"] < lead["high"]
    assert tuple(map(float, reported)) == pytest.approx((lead["difference"], lead["low"], lead["high"]), abs=1e-4)
    assert "any equilibrium at 0.9997" in re.sub(r"[^a-z0-9.]+", " ", out)
    (figure,) = json.loads(call(*words, "--json")[1])
    assert [row["study"] for row in figure["leads"]] == ["comparison"]


def test_json(played, call):
    """The JSON holds every point and every verdict."""
    data, _ = played
    (figure,) = json.loads(call("paradigms", "--figure", "5", "--runs", "4", "--quick", "--json", "--data", data)[1])
    assert figure["figure"] == 5
    store = Store(data)
    report = reports(QUICK)[1]
    assert len(figure["points"]) == points_of(store, report).height
    table = store.read_table(store.receipt("paradigms", report.name), "verdicts", Verdicts)
    assert len(figure["verdicts"]) == table.height


def test_export(played, tmp_path, call):
    """An export writes points, verdicts, plot and settings of a figure, each into its own file."""
    data, _ = played
    call("paradigms", "--figure", "4", "--runs", "4", "--quick", "--export", tmp_path, "--data", data)
    names = {path.name for path in tmp_path.iterdir()}
    stem = "figure-4-r4-s0-quick"
    assert names == {f"{stem}.points.csv", f"{stem}.verdicts.csv", f"{stem}.png", f"{stem}.settings.jsonl"}
    points = pl.read_csv(tmp_path / f"{stem}.points.csv")
    assert set(points["learner"]) >= {"IQ", "JAQ", "IVQ", "hysteretic"}
    head, *curves = (tmp_path / f"{stem}.settings.jsonl").read_text().splitlines()
    assert json.loads(head)["design"]["runs"] == 4
    assert {json.loads(line)["learner"] for line in curves} == set(points["learner"])


@pytest.mark.parametrize(("words", "what"), [
    (["--figure", "8"], "figure"), (["--runs", "0"], "runs"), (["--seed", "-1"], "seed"), (["--seed", str(10**20)], "seed"),
])
def test_bad_arguments(words, what, tmp_path, call):
    """Arguments that make no sense are refused by name."""
    code, out, err = call("paradigms", *words, "--data", tmp_path)
    assert code != 0
    assert what in out + err
