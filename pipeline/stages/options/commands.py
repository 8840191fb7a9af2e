"""Wheels that each option commands to each robot at each sample of a match."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.game.bodies import OMEGA, THETA, VX, VY, Records
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.executors.actions import ACTION
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.game.tactics.splitmix import SplitMix, seeded
from pitchlore.pipeline.numbers.arrays import F32, F64, I8, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.schemas.options import OPTIONS

_OPTIONS = np.array(OPTIONS, dtype=np.int64)


class Commanded(NamedTuple):
    """The motion of a team's robots, and what options command them.

    Attributes:
        wheels: float32 [T, N, A, 2], left and right wheel by each option, m/s; of an unknown robot NaN.
        rims: float64 [T, N, 2], speeds at which the wheels' places move over the floor, m/s.
        aims: int8 [T, N, A], row of the robot that the option is done to, in the team's view; -1 without one.
    """

    wheels: F32
    rims: F64
    aims: I8


def commanded(views: F64, begins: Bools, packed: Records) -> Commanded:
    """Run all executors at each sample of a match.

    Args:
        views: float64 [T, 1 + 2 N, 6], bodies as the team sees them; NaN where a body is not seen.
        begins: bool [T], samples at which executors start anew: the first of each window.
        packed: ``Measures.packed()``; its ``frame_s`` is the time between samples.

    Returns:
        The commands of the team's robots.
    """
    samples, robots = len(views), (views.shape[1] - 1) // 2
    wheels = np.full((samples, robots, len(OPTIONS), 2), np.nan, dtype=np.float32)
    rims = np.full((samples, robots, 2), np.nan)
    aims = np.full((samples, robots, len(OPTIONS)), -1, dtype=np.int8)
    own = np.zeros((robots, len(OPTIONS)), dtype=ACTION)
    _run(views, begins, packed, own, seeded(np.random.default_rng(0)), wheels, rims, aims)
    return Commanded(wheels, rims, aims)


@njit(cache=True, nogil=True, error_model="numpy")
def _run(
    views: F64, begins: Bools, packed: Records, own: Records, splitmix: SplitMix, wheels: F32, rims: F64,
    aims: I8,
) -> None:  # fmt: skip
    m = packed[0]
    robots = own.shape[0]
    roles = np.empty(2 * robots, dtype=np.int64)
    driven = np.zeros((robots, 2))
    for t in range(len(views)):
        view = views[t]
        assign(view, m, roles)
        for robot in range(1, robots + 1):
            if math.isnan(view[robot, THETA] + view[robot, VX]):
                continue
            c, s = math.cos(view[robot, THETA]), math.sin(view[robot, THETA])
            ahead, turn = c * view[robot, VX] + s * view[robot, VY], 0.5 * m.axle * view[robot, OMEGA]
            rims[t, robot - 1, 0], rims[t, robot - 1, 1] = ahead - turn, ahead + turn
            for place in range(len(_OPTIONS)):
                action = own[robot - 1, place]
                if begins[t] or action["code"] == 0:
                    executors.start(_OPTIONS[place], robot, view, roles, m, splitmix, action)
                aims[t, robot - 1, place] = action["other"]
                over = executors.act(robot, view, m, action, driven)
                for side in range(2):
                    wheels[t, robot - 1, place, side] = driven[robot - 1, side]
                if over:
                    executors.start(_OPTIONS[place], robot, view, roles, m, splitmix, action)
