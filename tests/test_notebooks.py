"""The notebooks run from top to bottom on what a run makes."""

from __future__ import annotations

import json

import polars as pl
import pytest
from conftest import ROOT

NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_cell_runs(path, finished, monkeypatch):
    monkeypatch.setenv("PITCHLORE_DATA", str(finished))
    cells = [c for c in json.loads(path.read_text(encoding="utf-8"))["cells"] if c["cell_type"] == "code"]
    names: dict[str, object] = {}
    with pl.Config():  # what a notebook shows is of no concern to others
        for cell in cells:
            exec("".join(cell["source"]), names)
    assert len(cells) > 5
