"""The study of what the paper leaves open: its settings, its page, and a run of seconds."""

import polars as pl
import pytest
from conftest import ROOT
from sensitivity import study
from support.seasons import season, tables

FOLDER = ROOT / "data" / "studies" / "sensitivity"


def test_settings():
    """Each variation says in a sentence what it changes, and is played."""
    said = study.variations()
    assert len(said) == 9
    assert all(line.endswith(".") and "#" not in line for line in said.values())
    assert ("paper", *sorted(said)) == study.PLAYED


def test_page_again():
    """The page is that of the table which is kept with it."""
    assert study.page(pl.read_csv(FOLDER / "sensitivity.csv")) == (FOLDER / "README.md").read_text()


def test_variations():
    """The page says what each variation that was played changes, and no other settings are on it."""
    every = [season(name, "static", s, last=14) for name in ("paper", "paper-vary-maps-large", "best") for s in range(3)]
    rows = study.measured(*tables(*every))
    assert rows["settings"].to_list() == ["paper", "paper-vary-maps-large"]
    text = study.page(rows)
    assert "- `paper-vary-maps-large`: Maps of about twice as many neurons: 20, 24, 30 and 49." in text
    assert "maps-small" not in text


@pytest.mark.slow
def test_run(tmp_path):
    """The study plays and writes; played again, nothing is played anew."""
    tiny = tmp_path / "paper-vary-tiny.toml"
    tiny.write_text('base = "paper"\nopponents = ["static"]\n[referee]\nduration_s = 6\n')
    out, data = tmp_path / "out", tmp_path / "data"
    study.main(out, data, [str(tiny)], [101], 2)
    assert pl.read_csv(out / "sensitivity.csv").select("settings", "seasons", "games").rows() == [("paper-vary-tiny", 1, 2)]
    assert "paper-vary-tiny" in (out / "README.md").read_text()
    before = {path: path.stat().st_mtime_ns for path in data.rglob("*.receipt.json")}
    study.main(out, data, [str(tiny)], [101], 2)
    assert before == {path: path.stat().st_mtime_ns for path in data.rglob("*.receipt.json")}
