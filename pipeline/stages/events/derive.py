"""All events of a match."""

from __future__ import annotations

from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.game.episodes import episodes
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.settings import EventSettings
from pitchlore.pipeline.stages.events.control import ball_control
from pitchlore.pipeline.stages.events.passes import passes
from pitchlore.pipeline.stages.events.possession import possession
from pitchlore.pipeline.stages.events.pressure import pressure
from pitchlore.pipeline.stages.events.restarts import restarts
from pitchlore.pipeline.stages.events.shots import shots
from pitchlore.schemas import Passes, Possession, Pressure, Shots


class Events(NamedTuple):
    """The events of one match: rows of the schemas Possession, Passes, Shots, Pressure and Restarts."""

    possession: pl.DataFrame
    passes: pl.DataFrame
    shots: pl.DataFrame
    pressure: pl.DataFrame
    restarts: pl.DataFrame


def events(
    trajectories: pl.DataFrame, referee: pl.DataFrame, pitch: Pitch, settings: EventSettings
) -> Events:
    """All events of one match.

    Args:
        trajectories: rows of schema Trajectories of the match.
        referee: rows of schema Referee of the match.
        pitch: pitch of the match.
        settings: settings of the stage.
    """
    held, over = ball_control(trajectories, pitch), episodes(trajectories, referee)
    if not len(held.contacts.first):
        return Events(Possession.empty(), Passes.empty(), Shots.empty(), Pressure.empty(),
                      restarts(held, Shots.empty(), referee, over))
    shot = shots(held, trajectories, over, pitch, settings)
    passed = passes(held, shot, trajectories, pitch)
    owned = possession(held, passed, shot, trajectories, over)
    return Events(
        owned, passed, shot, pressure(held, owned, trajectories, pitch, settings),
        restarts(held, shot, referee, over))
