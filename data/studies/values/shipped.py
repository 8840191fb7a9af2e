"""The model of V that is shipped, for recordings with too few goals of their own.

``make study-values`` (half a minute of it) plays two pairings and fits the logistic model of the named
features to them. It has seen no recording. If the file changes, raise the versions of the stages models and
values; ``make golden`` says so.
"""

from __future__ import annotations

import json
from pathlib import Path

import polars as pl
from harness import ROOT, workers
from values.study import played

from pitchlore.pipeline.arena.teams.table import TeamKind
from pitchlore.pipeline.settings import ModelSettings
from pitchlore.pipeline.stages.values import models
from pitchlore.pipeline.stages.values.fitting import fit

MATCHES, _FIRST_SEED = 20, 8001
_PAIRINGS: tuple[tuple[TeamKind, TeamKind], ...] = (("static", "static"), ("human-like", "human-like"))


def main(path: Path, matches: int = MATCHES) -> None:
    """Write the model."""
    jobs = [(home, away, _FIRST_SEED + i) for home, away in _PAIRINGS for i in range(matches)]
    with workers() as pool:
        parts = [part.moments for part in pool.map(played, jobs, chunksize=5)]
    every = pl.concat(parts)
    found, report = fit(every, ModelSettings(boosting_goals=10**9, matches_at_most=len(parts)))
    assert found is not None
    path.write_text(json.dumps({
        "from": f"{matches} matches each of {', '.join(' - '.join(pair) for pair in _PAIRINGS)}",
        "report": report, **models.to_json(found)}, indent=1) + "\n")
    print(report)


if __name__ == "__main__":
    main(ROOT / "pipeline" / "stages" / "values" / "shipped.json")
