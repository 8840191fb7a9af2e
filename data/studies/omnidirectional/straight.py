"""Executors of VSSS, driven straight: a robot that needs no turn goes to where an executor aims."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from pitchlore.pipeline.game.bodies import BALL, VX, VY, Records, X, Y
from pitchlore.pipeline.game.tactics import executors
from pitchlore.pipeline.game.tactics.ball import soon
from pitchlore.pipeline.game.tactics.executors import actions
from pitchlore.pipeline.game.tactics.executors.actions import ACTION
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.game.tactics.splitmix import SplitMix, seeded
from pitchlore.pipeline.numbers.arrays import F64, I64

#: How long a robot goes on between two looks at its aim, s.
STEP_S = 0.1


@njit(cache=True, nogil=True, error_model="numpy")
def aim(code: int, robot: int, view: F64, other: int, m: Measures) -> tuple[float, float]:
    """The way from a robot to where the executor of a code wants it, metres; it stands at (0, 0)."""
    verb, thing = actions.VERB[code], actions.THING[code]
    dx, dy = actions.to_aim(view, robot, thing, other, m)
    if verb in (actions.STAND, actions.FACE, actions.WANDER) or (thing >= actions.OPPONENT and other < 0):
        return 0.0, 0.0
    if verb in (actions.LEAVE, actions.RECEDE):
        return -dx, -dy
    if verb == actions.LEVEL_X:
        return dx, 0.0
    if verb == actions.LEVEL_Y:
        return 0.0, dy
    if verb == actions.BLOCK:
        gx, gy = -m.goal_x - view[BALL, X], -view[BALL, Y]
        length = math.hypot(gx, gy)
        bx, by = view[BALL, X] - view[robot, X], view[BALL, Y] - view[robot, Y]
        aside = (bx * gy - by * gx) / length
        return aside * gy / length, -aside * gx / length
    if verb == actions.APPROACH and thing != actions.THE_BALL:
        return dx, dy
    x, y = soon(view, robot, m)
    return x - view[robot, X], y - view[robot, Y]


@njit(cache=True, nogil=True, error_model="numpy")
def _others(
    view: F64, robot: int, codes: I64, packed: Records, splitmix: SplitMix, action: Records, out: I64
) -> None:  # fmt: skip
    """Write for each code the row of the robot that it is done to, -1 without one."""
    roles = np.empty(len(view) - 1, dtype=np.int64)
    assign(view, packed[0], roles)
    for each in range(len(codes)):
        executors.start(codes[each], robot, view, roles, packed[0], splitmix, action[0])
        out[each] = action[0]["other"]


@njit(cache=True, nogil=True, error_model="numpy")
def driven(
    seen: F64, robot: int, codes: I64, others: I64, top: float, acceleration: float, packed: Records,
    ahead: I64, hz: float, out: F64,
) -> None:  # fmt: skip
    """Write the way of a robot that goes straight to its aim, float64 [codes, ahead, 2], metres.

    It wants the velocity from which it can still stop at its aim, and changes its own towards that as fast as
    it can. All other bodies keep their velocities.
    """
    m = packed[0]
    for each in range(len(codes)):
        view = seen.copy()
        own = view[robot]
        sx, sy, place = own[X], own[Y], 0
        for step in range(ahead[-1]):
            if step % max(1, round(STEP_S * hz)) == 0:
                dx, dy = aim(codes[each], robot, view, others[each], m)
                away = math.hypot(dx, dy)
                speed = min(top, math.sqrt(2 * acceleration * away))
                ux, uy = (speed * dx / away, speed * dy / away) if away > 1e-6 else (0.0, 0.0)
            cx, cy = ux - own[VX], uy - own[VY]
            change = math.hypot(cx, cy)
            part = min(1.0, acceleration / hz / change) if change > 0.0 else 0.0
            own[VX] += part * cx
            own[VY] += part * cy
            for row in range(len(view)):
                view[row, X] += view[row, VX] / hz
                view[row, Y] += view[row, VY] / hz
            if step + 1 == ahead[place]:
                out[each, place, 0], out[each, place, 1] = own[X] - sx, own[Y] - sy
                place += 1


def ways(
    views: F64, robots: I64, codes: I64, packed: Records, top: float, acceleration: float, ahead: I64,
    hz: float,
) -> F64:  # fmt: skip
    """Ways of robots by the executor of each code, float64 [W, codes, ahead, 2], metres.

    Args:
        views: float64 [W, 1 + 2 N, 6], what the team saw.
        robots: int64 [W], rows of robots.
        codes: int64 [A], codes of options.
        packed: ``Measures.packed()``.
        top: greatest speed of robots, m/s.
        acceleration: greatest change of it, m/s².
        ahead: int64 [H], ascending, samples ahead.
        hz: samples a second.
    """
    out = np.zeros((len(views), len(codes), len(ahead), 2))
    action, other = np.zeros(1, dtype=ACTION), np.zeros(len(codes), dtype=np.int64)
    splitmix = seeded(np.random.default_rng(0))
    for place in range(len(views)):
        _others(views[place], robots[place], codes, packed, splitmix, action, other)
        driven(views[place], robots[place], codes, other, top, acceleration, packed, ahead, hz, out[place])
    return out
