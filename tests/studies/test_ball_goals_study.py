"""The study of goals found from the ball: the importer is as sure of a goal as the study measured."""

from __future__ import annotations

import polars as pl
from conftest import ROOT
from support.recordings import ALL

from pitchlore.pipeline.importers.tracking.ball_goals import CONFIDENCE, OURS

STUDY = ROOT / "data" / "studies" / "ball_goals"


def test_confidence_is_measured() -> None:
    """Each confidence is the study's estimate, rounded down to hundredths."""
    rows = pl.read_csv(STUDY / "kinds.csv")
    measured = {(crossing, sequel): int(estimate * 100) / 100
                for crossing, sequel, estimate in rows.select("crossing", "sequel", "estimate").iter_rows()}
    assert {kind: CONFIDENCE[kind] for kind in CONFIDENCE if kind not in OURS} == {
        kind: share for kind, share in measured.items() if kind not in OURS}


def test_findings_of_the_study() -> None:
    """The committed study knows all recordings; nearly all goals are found as they were recorded, and few others."""
    rows = pl.read_csv(STUDY / "found.csv").filter(seen="as recorded")
    assert len(rows) == 1 + len(ALL)
    assert rows["recall"].min() >= 0.99  # type: ignore[operator]
    assert rows["precision"].min() >= 0.99  # type: ignore[operator]
