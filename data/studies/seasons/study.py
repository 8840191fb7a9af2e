"""Sections 4 and 6 of the paper: its seasons, ours, and an ablation of each idea.

``study.py [DATA]`` plays the seasons that the data folder lacks, measures their apprentices, and writes
tables, plots and the page into this folder. The data folder keeps each game and match that was played, so a
study that was stopped goes on. The settings were searched for with seeds below 101.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from harness import ROOT, command, seasons
from seasons.claims import OURS
from seasons.page import markdown
from seasons.plots import pictures

from pitchlore.pipeline.arena.teams.constant import BEST as BEST_CONSTANT
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.stages.report.claims import CLAIMS, season_verdicts
from pitchlore.pipeline.stages.report.kickoffs import kick_offs
from pitchlore.pipeline.stages.report.measures import seasons_of
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.report import ReportTables, sources, tables

#: Seed of the first season.
SEED = 101

Words = Sequence[object]


class Plan(NamedTuple):
    """Parts of the study.

    Attributes:
        seasons: settings, number of seasons, and further options of ``pitchlore season``.
        evaluations: options of ``pitchlore evaluate``.
    """

    seasons: Sequence[tuple[str, int, Words]]
    evaluations: Sequence[Words]


_BOTH = ("--opponent", "static", "--opponent", "human-like")
_IDEAS = sorted(path.stem for path in Path(__file__).parent.glob("best-*.toml"))
_APPRENTICES = [f"{settings}-static-{seed}"
                for settings in ("best", "best-in-games") for seed in range(SEED, SEED + 5)]

WHOLE = Plan(
    seasons=(
        ("paper", 5, ()), ("paper-literal", 5, ()), ("paper-full35", 5, _BOTH), ("paper-level", 5, ()),
        ("best", 5, _BOTH), ("best-in-games", 5, ()), *((idea, 3, ("--games", 20)) for idea in _IDEAS)),
    evaluations=(
        *(("--policy", "static", "--against", other, "--matches", 200, "--minutes", 2)
          for other in ("random", "static")),
        # without --against it is the panel
        *(("--policy", team, *against, "--matches", 100)
          for team in ("constant:044", "constant:021", BEST_CONSTANT, *_APPRENTICES)
          for against in (("--against", "random"), ()))),
)


def main(out: Path, data: Path, plan: Plan = WHOLE) -> None:
    """Play, measure, and write the study of a data folder into another folder."""
    for settings, count, words in plan.seasons:
        print(f"{count} seasons of {settings}", *words, flush=True)
        seasons(settings, range(SEED, SEED + count), data, *words, "--on", "processes:2")
    for words in plan.evaluations:
        print("evaluations", *words, flush=True)
        command("evaluate", *words, "--export", out.parent / "evaluations", "--data", data)
    store = Store(data)
    write(out, tables(store, sources(store)))


def write(out: Path, found: ReportTables) -> None:
    """Write tables as CSV, plots as PNG, and the page as Markdown."""
    out.mkdir(parents=True, exist_ok=True)
    games, growth, evaluations, _, preferences = found
    claims = season_verdicts(seasons_of(games, growth, evaluations), (*CLAIMS, *OURS))
    written = {"games": games, "growth": growth, "evaluations": evaluations, "claims": claims,
               "preferences": preferences, "kick-offs": kick_offs(games)}
    for name, table in written.items():
        table.write_csv(out / f"{name}.csv", float_precision=4)
    plots = pictures(games, growth)
    for name, data in plots.items():
        (out / f"{name}.png").write_bytes(data)
    (out / "README.md").write_text(markdown(found, claims, list(plots), RELEASE), encoding="utf-8")


if __name__ == "__main__":
    main(Path(__file__).parent, Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "data"))
