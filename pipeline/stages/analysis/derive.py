"""All analysts' tables of a match."""

from __future__ import annotations

from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.game.episodes import episodes
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import AnalysisSettings
from pitchlore.pipeline.stages.analysis.attempts import pass_attempts
from pitchlore.pipeline.stages.analysis.efforts import efforts
from pitchlore.pipeline.stages.analysis.phases import phases
from pitchlore.pipeline.stages.analysis.pressing import pressing
from pitchlore.pipeline.stages.analysis.space import space
from pitchlore.pipeline.stages.events.control import ball_control
from pitchlore.pipeline.stages.events.derive import Events


class Analysis(NamedTuple):
    """Rows of the schemas PassAttempts, Efforts, Phases, Pressing and Space of one match."""

    pass_attempts: pl.DataFrame
    efforts: pl.DataFrame
    phases: pl.DataFrame
    pressing: pl.DataFrame
    space: pl.DataFrame


def analysis(
    trajectories: pl.DataFrame, referee: pl.DataFrame, found: Events, pitch: Pitch, settings: AnalysisSettings
) -> Analysis:
    """All analysts' tables of one match.

    Args:
        trajectories: rows of schema Trajectories of the match.
        referee: rows of schema Referee of the match.
        found: events of the match.
        pitch: pitch of the match.
        settings: settings of the stage.
    """
    held = ball_control(trajectories, pitch)
    tried = pass_attempts(held, found.shots, episodes(trajectories, referee), trajectories, pitch)
    reached, of_robots = space(trajectories, pitch, settings)
    return Analysis(
        tried, efforts(trajectories, of_robots, pitch, settings),
        phases(held, found.possession, pitch, settings),
        pressing(tried, found, trajectories, pitch, settings), reached)
