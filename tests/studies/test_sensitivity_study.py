"""The study of what the paper leaves open: its settings, and its page."""

import polars as pl
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
