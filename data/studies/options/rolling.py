"""Motion rolled out from moments of a match: by an option, by wheels that are told, by the last velocity.

Rims follow what they are told as motors can, the robot rolls without slip, all other bodies keep their
velocities, and nobody touches anybody.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from from_recordings.wheels import SEEN, see_all
from numba import njit

from pitchlore.pipeline.game.bodies import OMEGA, THETA, VX, VY, Records, X, Y
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.executors.actions import ACTION
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.game.tactics.splitmix import SplitMix, seeded
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.settings import OptionSettings

#: Frames of a second, and frames ahead.
HZ, AHEAD = 60, (6, 15, 30)
FRAMES = max(AHEAD)


class Moments(NamedTuple):
    """Moments that are foretold: starts of windows that follow on another window of the robot.

    Attributes:
        views: float64 [K, 1 + 2 N, 6], what the team saw.
        robot: int64 [K], row of the robot.
        poses: float64 [K, H, 3], the robot's x, y and heading later on.
        before, here: int64 [K], rows of clues of the window before the moment, and of the window at it.
    """

    views: F64
    robot: I64
    poses: F64
    before: I64
    here: I64


@njit(cache=True, nogil=True, error_model="numpy")
def go_on(view: F64, robot: int, rims: F64, told: F64, change: float, axle: float, frame_s: float) -> None:
    """Go on by a frame: float64 [2] ``rims`` follow ``told``; ``view`` is written."""
    for wheel in range(2):
        rims[wheel] += min(max(told[wheel] - rims[wheel], -change), change)
    ahead, turn = 0.5 * (rims[0] + rims[1]), (rims[1] - rims[0]) / axle
    for row in range(len(view)):
        if row != robot:
            view[row, X] += frame_s * view[row, VX]
            view[row, Y] += frame_s * view[row, VY]
    own = view[robot]
    own[THETA] += 0.5 * frame_s * turn
    own[VX], own[VY], own[OMEGA] = ahead * math.cos(own[THETA]), ahead * math.sin(own[THETA]), turn
    own[X] += frame_s * own[VX]
    own[Y] += frame_s * own[VY]
    own[THETA] += 0.5 * frame_s * turn


@njit(cache=True, nogil=True, error_model="numpy")
def _rims(view: F64, robot: int, axle: float, rims: F64) -> None:
    """Write the speeds of a robot's rims, float64 [2], m/s."""
    own = view[robot]
    ahead = math.cos(own[THETA]) * own[VX] + math.sin(own[THETA]) * own[VY]
    rims[0], rims[1] = ahead - 0.5 * axle * own[OMEGA], ahead + 0.5 * axle * own[OMEGA]


@njit(cache=True, nogil=True, error_model="numpy")
def _roll_options(
    views: F64, robots: I64, codes: I64, change: float, packed: Records, action: Records, splitmix: SplitMix,
    out: F64,
) -> None:  # fmt: skip
    """Poses after each frame if robots do an option all the while; float64 [K, frames, 3] is written."""
    m, rims, own = packed[0], np.empty(2), action[0]
    roles = np.empty(views.shape[1] - 1, dtype=np.int64)
    wheels = np.zeros((len(roles) // 2, 2))
    for k in range(len(views)):
        view, robot = views[k].copy(), robots[k]
        _rims(view, robot, m.axle, rims)
        over = True
        for frame in range(out.shape[1]):
            if over:
                assign(view, m, roles)
                executors.start(codes[k], robot, view, roles, m, splitmix, own)
            over = executors.act(robot, view, m, own, wheels)
            go_on(view, robot, rims, wheels[robot - 1], change, m.axle, m.frame_s)
            out[k, frame] = view[robot, :3]


@njit(cache=True, nogil=True, error_model="numpy")
def _roll_told(views: F64, robots: I64, rims: F64, told: F64, change: float, packed: Records) -> None:
    """Go on by a frame from all moments; ``views`` and ``rims``, [K, 2], are written."""
    for k in range(len(views)):
        go_on(views[k], robots[k], rims[k], told[k], change, packed[0].axle, packed[0].frame_s)


@njit(cache=True, nogil=True, error_model="numpy")
def _see(views: F64, robots: I64, packed: Records, rims: F64, out: F64) -> None:
    """Write rims, [K, 2], and what is seen, [K, SEEN]."""
    for k in range(len(views)):
        see_all(views[k], robots[k], packed, out[k])
        _rims(views[k], robots[k], packed[0].axle, rims[k])


def by_option(now: Moments, codes: I64, packed: Records, settings: OptionSettings) -> F64:
    """Poses [K, H, 3] if each robot does an option."""
    out = np.empty((len(codes), FRAMES, 3))
    _roll_options(now.views, now.robot, codes, settings.wheel_acceleration / HZ, packed,
                  np.zeros(1, dtype=ACTION), seeded(np.random.default_rng(0)), out)
    return out[:, np.array(AHEAD) - 1]


def by_wheels(
    now: Moments, told: Callable[[F64, F64], F64], packed: Records, settings: OptionSettings
) -> F64:  # fmt: skip
    """Poses [K, H, 3] if wheels are told by what is seen, float64 [K, SEEN], and by rims, float64 [K, 2]."""
    views, found = now.views.copy(), []
    seen, rims = np.empty((len(views), SEEN)), np.empty((len(views), 2))
    for _ in range(FRAMES):
        _see(views, now.robot, packed, rims, seen)
        _roll_told(views, now.robot, rims, told(seen, rims), settings.wheel_acceleration / HZ, packed)
        found.append(views[np.arange(len(views)), now.robot][:, [X, Y, THETA]])
    return np.stack([found[ahead - 1] for ahead in AHEAD], axis=1)


def by_velocity(now: Moments) -> F64:
    """Poses [K, H, 3] if each robot keeps its velocity and its turn."""
    own = now.views[np.arange(len(now.robot)), now.robot]
    seconds = np.array(AHEAD)[:, None] / HZ
    poses: F64 = own[:, None, [X, Y, THETA]] + seconds * own[:, None, [VX, VY, OMEGA]]
    return poses
