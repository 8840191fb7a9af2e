"""Logs of still and moving bodies, and their trajectories."""


import numpy as np
import polars as pl

from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import Quality, Trajectories

DEFAULT = TrajectorySettings()


def run(log, **changes):
    table, quality = trajectories(log, DEFAULT.model_copy(update=changes))
    return Trajectories.validate(table), Quality.validate(quality)


def of(table, team="ball", robot=None):
    rows = table.filter(pl.col("team") == team)
    return rows if robot is None else rows.filter(pl.col("robot") == robot)


def still(frames, x=0.0, y=0.0, theta=0.0):
    return np.tile([x, y, theta], (frames, 1))


def at_60hz(seconds):
    return np.arange(round(seconds * 60)) / 60
