"""Pressing of each team."""

from __future__ import annotations

import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import AnalysisSettings
from pitchlore.pipeline.stages.analysis.paces import crossings_ns
from pitchlore.pipeline.stages.events.derive import Events
from pitchlore.pipeline.stages.events.views import tabled
from pitchlore.schemas import SIDES, Pressing

#: PPDA counts where the adversary builds up: its own share of the pitch.
_OWN = 0.6


def pressing(
    tried: pl.DataFrame, found: Events, trajectories: pl.DataFrame, pitch: Pitch, settings: AnalysisSettings
) -> pl.DataFrame:
    """Rows of schema Pressing of one match, one for each team.

    Args:
        tried: rows of schema PassAttempts of the match.
        found: events of the match.
        trajectories: rows of schema Trajectories of the match.
        pitch: pitch of the match.
        settings: settings of the stage.
    """
    line = (_OWN - 0.5) * pitch.length
    held = found.possession.sort("start_ns").with_columns(regained=(
        (pl.col("ended") == "lost") & (pl.col("team").shift(-2) == pl.col("team"))
        & (pl.col("segment").shift(-2) == pl.col("segment"))
        & (pl.col("start_ns").shift(-2) - pl.col("end_ns") <= crossings_ns(pitch, settings.regain))
    ).fill_null(value=False))
    rows = []
    for side, other in (SIDES, SIDES[::-1]):
        theirs, mine = held.filter(pl.col("team") == other), held.filter(pl.col("team") == side)
        passes = tried.filter(pl.col("team") == other, pl.col("x") <= line).height
        actions = theirs.filter(pl.col("ended").is_in(["lost", "contested"]), pl.col("end_x") <= line).height
        pressed = found.pressure.filter(pl.col("team") == side)
        rows.append({
            "team": side, "passes": passes, "actions": actions, "ppda": passes / actions if actions else None,
            "presses": pressed.height, "high": pressed.filter(pl.col("x") > pitch.length / 6).height,
            "won": int(pressed["won"].sum()), "lost": mine.filter(pl.col("ended") == "lost").height,
            "regained": int(mine["regained"].sum())})
    return tabled(Pressing, trajectories, dict(pl.DataFrame(rows, infer_schema_length=None).to_dict()))
