"""Settings that the paper leaves open: its seasons with one of them changed, beside those without.

``study.py [DATA]`` plays the seasons that the data folder lacks, and writes the table and the page into this
folder. The data folder keeps each game that was played, so a study that was stopped goes on. The page has a
row for each change and opponent. Three seasons show only large differences.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import polars as pl
from harness import ROOT, seasons

from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.stages.report.claims import PAPER
from pitchlore.pipeline.stages.report.report import estimates
from pitchlore.pipeline.stages.report.sensitivity import LAST, PREFIX, sensitivity, varied_settings
from pitchlore.pipeline.stages.report.table3 import CHANGE
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.report import sources, tables
from pitchlore.schemas import STAND_IN

#: Files of the variations. The comment at the top of each says what differs from the paper's settings.
FILES = sorted(Path(__file__).parent.glob(f"{PREFIX}*.toml"))
#: Settings that are played.
PLAYED = (PAPER, *(path.stem for path in FILES))
#: Seeds of the seasons, and games of each: the figures need games 1 to 10, and a few after the new score.
SEEDS, GAMES = (101, 102, 103), 14

#: Headings of the columns that have intervals.
HEADINGS = {
    "states": "states (Figure 8)", "behaviours": "behaviours (Figure 9)",
    "early": f"learned actions to game {CHANGE - 1}, %", "late": f"from game {CHANGE} on, %",
    "effective": "goals effectively made a game (Figure 10)",
    "difference": f"goal difference, last {LAST} games",
}


def main(
    out: Path, data: Path, settings: Sequence[str] = PLAYED, seeds: Sequence[int] = SEEDS, games: int = GAMES,
) -> None:
    """Play the seasons, and write the study of a data folder into another folder."""
    for word in settings:
        print(f"{word}: {len(seeds)} seasons of {games} games", flush=True)
        seasons(word, seeds, data, "--games", games, "--on", "processes:2")
    store = Store(data)
    found = tables(store, sources(store))
    rows = measured(found.games, found.growth)
    out.mkdir(parents=True, exist_ok=True)
    rows.write_csv(out / "sensitivity.csv", float_precision=4)
    (out / "README.md").write_text(page(rows), encoding="utf-8")


def measured(games: pl.DataFrame, growth: pl.DataFrame) -> pl.DataFrame:
    """Key numbers of the paper's settings and of their variations, from schemas Games and Growth."""
    of = varied_settings() | (pl.col("settings") == PAPER)
    return sensitivity(games.filter(of), growth.filter(of), PAPER)


def page(rows: pl.DataFrame) -> str:
    """The page in Markdown, from the rows that :func:`measured` gives."""
    return "\n\n".join((
        "# Sensitivity: the paper's seasons with one setting changed",
        (f"Made by {RELEASE} with `make sensitivity` (40 minutes on two free cores). Intervals are 95 % "
         "intervals (Student) over seasons. Each is one by itself: one in twenty differs by chance."),
        f"**{STAND_IN}.**", *_about(rows))) + "\n"


def _about(rows: pl.DataFrame) -> Iterator[str]:
    yield "## Points that the paper leaves open"
    yield (
        f"The key numbers of Table 3 and Figures 8 to 10 with one setting of `{PAPER}` changed, over the "
        f"first {rows['games'][0]} games, means over seasons.")
    said = variations()
    yield "\n".join(f"- `{name}`: {said[name]}" for name in rows["settings"].unique().sort() if name in said)
    yield estimates(rows.drop("games"), HEADINGS, ("opponent", "settings", "seasons"))


def variations() -> dict[str, str]:
    """Change that each variation makes, in words, by its name."""
    first = {path.stem: path.read_text(encoding="utf-8").splitlines()[0] for path in FILES}
    return {name: line.removeprefix("# Sensitivity: ") for name, line in first.items()}


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "data"))
