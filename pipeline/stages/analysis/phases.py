"""Phases of a team that has the ball."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import AnalysisSettings
from pitchlore.pipeline.stages.analysis.paces import crossings_ns
from pitchlore.pipeline.stages.events.control import Control
from pitchlore.pipeline.stages.events.views import towards
from pitchlore.schemas import SIDES, Phases
from pitchlore.schemas.analysis import PHASES


def phases(
    control: Control, possession: pl.DataFrame, pitch: Pitch, settings: AnalysisSettings
) -> pl.DataFrame:
    """Rows of schema Phases of one match.

    Args:
        control: control of the match.
        possession: rows of schema Possession of the match.
        pitch: pitch of the match.
        settings: settings of the stage.
    """
    if possession.is_empty():
        return Phases.empty()
    own = possession.sort("start_ns").with_columns(
        won=((pl.col("team") != pl.col("team").shift()) & (pl.col("segment") == pl.col("segment").shift())
             & pl.col("ended").shift().is_in(["lost", "shot"])).fill_null(value=False))
    t_ns = control.ball.t_ns
    start, end = own["start_ns"].to_numpy(), own["end_ns"].to_numpy()
    row = np.searchsorted(start, t_ns, side="right") - 1
    held = np.flatnonzero((row >= 0) & (t_ns < end[np.maximum(row, 0)]))
    row = row[held]
    team = (own["team"] == SIDES[1]).cast(pl.Int64).to_numpy()[row]
    x = control.ball.x[held] * towards(team)
    third = np.digitize(x, [-pitch.length / 6, pitch.length / 6]) + 1
    recent = own["won"].to_numpy()[row] & (t_ns[held] - start[row] < crossings_ns(pitch, settings.transition))
    phase = np.where(recent, 0, third)
    begins = np.flatnonzero(np.append(True, (np.diff(row) != 0) | (np.diff(phase) != 0)))
    owner, first = row[begins], t_ns[held[begins]]
    goes_on = np.append(owner[1:] == owner[:-1], False)
    return pl.DataFrame({
        "match_id": own["match_id"].gather(owner),
        "team": own["team"].gather(owner),
        "start_ns": first,
        "end_ns": np.where(goes_on, np.append(first[1:], 0), end[owner]),
        "segment": own["segment"].gather(owner),
        "phase": np.array(PHASES)[phase[begins]],
    }).cast(pl.Schema(Phases.dtypes()))
