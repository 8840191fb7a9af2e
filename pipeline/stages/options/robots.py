"""Robots as a recording shows them: how fast they drive, and how near they get to other bodies.

Executors command wheels. Motors and bodies make motion of that, and not all are those of our arena. Three
things can be seen without knowing what was commanded: the speeds and changes that rims reach away from other
bodies, the least distances at which bodies touch, and whether a command beyond the top speed slows one rim or
both: the executors then explain more of the motion by the one than by the other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.game.bodies import BALL, X, Y
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools
from pitchlore.pipeline.settings import OptionSettings
from pitchlore.pipeline.stages.options.commands import Commanded

#: A robot is away from others whose centres are further, and from walls, metres.
_AWAY, _OFF_WALL = 0.13, 0.08
#: Least number of samples of robots away from others that tell how a team drives.
_LEAST = 300
#: Bodies touch at the distance that so few of those within reach go below; reach, and that distance in the
#: arena, metres: to robots, to the ball, to the walls along the pitch.
_TOUCH, _REACH, _ARENA = 0.01, (0.2, 0.15, 0.15), (0.0744, 0.0572, 0.0369)
#: Share of speeds, and of changes of speed, that lie below the greatest.
_MOST = 0.99
#: A rim that is no further from a command's is explained by it, m/s.
_EXPLAINED = 0.03


class RobotTraits(NamedTuple):
    """How a team's robots drive, and how near they get to other bodies.

    Attributes:
        top: greatest speed of a rim, m/s; infinite: whatever executors command.
        acceleration: greatest change of a rim's speed, m/s².
        axle: from wheel to wheel, metres.
        together: whether a command beyond ``top`` slows both rims, so that the robot keeps its curve.
        robot, ball, wall: how much further than in the arena a robot's centre stays from other robots, from
            the ball and from walls, metres.
        measured: whether a recording has told all that; executors then assume the robots of the arena.
    """

    top: float
    acceleration: float
    axle: float
    together: bool = False
    robot: float = 0.0
    ball: float = 0.0
    wall: float = 0.0
    measured: bool = False

    @classmethod
    def told(cls, settings: OptionSettings) -> RobotTraits:
        """The robots of settings."""
        return cls(math.inf, settings.wheel_acceleration, settings.axle)


def traits_of(
    views: F64, segment: I64, frame_s: float, told: Commanded, pitch: Pitch, settings: OptionSettings
) -> RobotTraits:  # fmt: skip
    """The robots of a team as a match shows them.

    Args:
        views: float64 [T, 1 + 2 N, 6], bodies as the team sees them.
        segment: int64 [T], stretch of play, -1 while play is stopped.
        frame_s: time between samples, seconds.
        told: commands of all executors, and rims.
        pitch: pitch of the match.
        settings: the robots where too little is seen.
    """
    play, count = segment >= 0, told.rims.shape[1]
    apart = np.hypot(*(views[:, 1:, None, axis] - views[:, None, :, axis] for axis in (X, Y)))
    apart[:, np.arange(2 * count), np.arange(1, 1 + 2 * count)] = np.inf
    beside = pitch.width / 2 - np.abs(views[:, 1:, Y])
    wall = np.minimum(pitch.goal_x - np.abs(views[:, 1:, X]), beside)[:, :count]
    nearest = np.where(np.isnan(apart[:, :count]), np.inf, apart[:, :count]).min(axis=2)
    away = (nearest > _AWAY) & (wall > _OFF_WALL) & play[:, None] & ~np.isnan(told.rims[:, :, 0])
    goes_on = away[1:] & away[:-1] & (segment[1:] == segment[:-1])[:, None]
    if goes_on.sum() < _LEAST:
        return RobotTraits.told(settings)
    speeds = np.abs(told.rims).max(axis=2)
    changes = np.abs(np.diff(told.rims, axis=0)).max(axis=2) / frame_s
    top = float(np.quantile(speeds[away], _MOST))
    acceleration = float(np.quantile(changes[goes_on], _MOST))
    shares = [_explained(told, goes_on, top, acceleration * frame_s, together) for together in (False, True)]
    robot, ball, side = (_further(found[play], reach, usual) for found, reach, usual in zip(
        (apart[:, :, 1:], apart[:, :, BALL], beside), _REACH, _ARENA, strict=True))
    return RobotTraits(
        top, acceleration, settings.axle, shares[1] > shares[0], robot, ball, side, measured=True)


def _further(distances: F64, reach: float, usual: float) -> float:
    """How much further than usual bodies stay that are within reach, metres; 0 where few are."""
    near = distances[distances < reach]
    return float(np.quantile(near, _TOUCH)) - usual if len(near) >= _LEAST else 0.0


def _explained(told: Commanded, goes_on: Bools, top: float, change: float, together: bool) -> float:
    """Share of the samples of driving robots whose next rims one of the executors explains."""
    sample, robot = np.nonzero(goes_on & (np.abs(told.rims[:-1]).max(axis=2) > top / 10))
    rims = told.rims[sample, robot][:, None]
    wanted = limited(told.wheels[sample, robot].astype(np.float64), top, together)
    off = rims + np.clip(wanted - rims, -change, change) - told.rims[sample + 1, robot][:, None]
    return float((np.abs(off).max(axis=2).min(axis=1) < _EXPLAINED).mean()) if len(sample) else 0.0


def of_axle(rims: F64, times: float) -> F64:
    """Rims, float64 [..., 2], of robots whose axle is so many times as long as was assumed, m/s."""
    ahead, turn = rims.mean(axis=-1), (rims[..., 1] - rims[..., 0]) / 2 * times
    return np.stack((ahead - turn, ahead + turn), axis=-1)


def limited(wheels: F64, top: float, together: bool) -> F64:
    """Commands that robots can follow, float64 [..., 2], m/s."""
    most = np.maximum(np.abs(wheels).max(axis=-1, keepdims=True), top)
    found: F64 = wheels * (top / most) if together else np.clip(wheels, -top, top)
    return found
