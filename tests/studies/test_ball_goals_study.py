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


def test_restarts_of_the_study() -> None:
    """Where robots are put with the ball nearly all restarts are found, and no other; in other leagues none."""
    rows = pl.read_csv(STUDY / "restarts.csv").filter(rule="the rule")
    vsss = pl.col("game").is_in(["played here", "rc-robosim VSSS"])
    clean = rows.filter(vsss, ~pl.col("seen").str.contains("glitches"))
    assert clean["right"].sum() >= 0.95 * clean["called"].sum()
    assert clean["right"].sum() == clean["found"].sum()
    glitches = rows.filter(vsss, seen="glitches")
    assert glitches["right"].sum() >= 0.95 * glitches["found"].sum()
    assert rows.filter(~vsss)["found"].sum() == 0


def test_findings_of_the_study() -> None:
    """The committed study knows all recordings; nearly all goals are found as they were recorded, and few others."""
    rows = pl.read_csv(STUDY / "found.csv").filter(seen="as recorded")
    assert len(rows) == 1 + len(ALL)
    assert rows["recall"].min() >= 0.99  # type: ignore[operator]
    assert rows["precision"].min() >= 0.99  # type: ignore[operator]
