"""Settings that the paper leaves open: its seasons with one of them changed, beside those without.

``study.py DATA``; DATA is the data folder in which ``make sensitivity`` has played the seasons. The page has
a row for each change and opponent. Three seasons show only large differences.
"""

from __future__ import annotations

import sys
from pathlib import Path

import polars as pl

from pitchlore.pipeline.engine.report import sources, tables
from pitchlore.pipeline.report.claims import PAPER
from pitchlore.pipeline.report.sections import about_sensitivity
from pitchlore.pipeline.report.sensitivity import sensitivity, varied
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import RELEASE
from pitchlore.schemas import STAND_IN


def changes() -> dict[str, str]:
    """The change of each variation in words, by its name: the first line of its file."""
    return {path.stem: path.read_text("utf-8").splitlines()[0].partition(": ")[2]
            for path in Path(__file__).parent.glob("*.toml")}


def main(folder: Path, data: Path) -> None:
    """Write the tables and the page on the seasons of a data folder into another folder."""
    store = Store(data)
    found = tables(store, sources(store))
    of = varied() | (pl.col("settings") == PAPER)
    games, growth = found.games.filter(of), found.growth.filter(of)
    rows = sensitivity(games, growth, PAPER)
    last = pl.col("game") <= rows["games"].min()
    games, growth = games.filter(last), growth.filter(last)
    rows.write_csv(folder / "sensitivity.csv", float_precision=4)
    text = "\n\n".join((
        "# Sensitivity: the paper's seasons with one setting changed",
        (f"Made by {RELEASE} with `make sensitivity` (40 minutes on two free cores). Intervals are 95 % "
         "intervals (Student) over seasons. Each is one by itself: one in twenty differs by chance."),
        f"**{STAND_IN}.**", *about_sensitivity(games, growth, changes())))
    (folder / "README.md").write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1]))
