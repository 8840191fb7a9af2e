"""A controller for each situation of Table 1, by its code.

An action is begun with :func:`start` and carried on with :func:`act`, frame by frame, until its final
condition holds or its time is up. :func:`has_ended` says beforehand if that would be at its first frame.

==============  ==============================================================
actions         controller, aim and time limit of each code; the memory of an action
controllers     ``control``: a frame of an action, by the controller of its code
endings         when it is over; of each code the condition in words
==============  ==============================================================
"""

from __future__ import annotations

import math

import numpy as np

from pitchlore.pipeline.game.bodies import BALL, Record
from pitchlore.pipeline.game.tactics.ball import has_ball, touches_ball
from pitchlore.pipeline.game.tactics.executors import actions
from pitchlore.pipeline.game.tactics.executors.endings import is_over
from pitchlore.pipeline.game.tactics.executors.motions import control
from pitchlore.pipeline.game.tactics.geometry import distance, offset, unit_vector
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.splitmix import SplitMix, uniform
from pitchlore.pipeline.game.tactics.steering import set_wheels
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.kernels import njit


@njit(cache=True, nogil=True, error_model="numpy")
def start(
    code: int, robot: int, view: F64, roles: I64, m: Measures, splitmix: SplitMix, own: Record
) -> None:
    """Begin an action.

    Args:
        code: code of Table 1.
        robot: row of the robot in the view, 1 to N.
        view: float64 [1 + 2 N, 6], the team's.
        roles: int64 [2 N], of the robots of rows 1 to 2 N (:func:`pipeline.game.tactics.roles.assign`); they
            decide whom codes 138 to 174 are done to. Of several the nearest is; if nobody has the role,
            the nearest of the nearest role.
        m: measures.
        splitmix: draws the wheels of 194; other codes draw nothing.
        own: the robot's record of ``actions.ACTION``, written.
    """
    _begin(code, robot, view, roles, m, own)
    if actions.VERB[code] == actions.WANDER:
        own["left"] = m.top * (2.0 * uniform(splitmix) - 1.0)
        own["right"] = m.top * (2.0 * uniform(splitmix) - 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def has_ended(code: int, robot: int, view: F64, roles: I64, m: Measures, own: Record) -> bool:
    """True if an action would be over at its first frame.

    Its final condition holds already, or the robot that is its aim does not exist. A condition that has to
    last begins with the action, so it never holds already.

    Args:
        code: code of Table 1.
        robot: row of the robot in the view, 1 to N.
        view: float64 [1 + 2 N, 6], the team's.
        roles: int64 [2 N], see :func:`start`.
        m: measures.
        own: a record of ``actions.ACTION``, written over.
    """
    _begin(code, robot, view, roles, m, own)
    verb, thing = actions.VERB[code], actions.THING[code]
    if thing >= actions.OPPONENT and own["other"] < 0:
        return True
    dx, dy = actions.to_aim(view, robot, thing, own["other"], m)
    return is_over(view, robot, verb, dx, dy, m, own)


@njit(cache=True, nogil=True, error_model="numpy")
def _begin(code: int, robot: int, view: F64, roles: I64, m: Measures, own: Record) -> None:
    """Begin an action but for what is left to chance."""
    verb, thing = actions.VERB[code], actions.THING[code]
    own["code"], own["frames"], own["lasted"] = code, 0, 0
    own["level"], own["left"], own["right"] = np.nan, 0.0, 0.0
    own["other"] = _whom(view, robot, thing, actions.ROLE[code], roles)
    own["had_ball"] = has_ball(view, robot, m)
    if verb in (actions.APPROACH, actions.RECEDE):
        dx, dy = actions.to_aim(view, robot, thing, own["other"], m)
        away = math.hypot(dx, dy)
        if verb == actions.RECEDE:
            farthest = m.far if away < m.far and thing < actions.OPPONENT else np.nan
            own["level"] = m.close if away < m.close else (m.near if away < m.near else farthest)
        elif away > m.far and thing < actions.OPPONENT:
            own["level"] = m.far
        else:
            own["level"] = m.near if away > m.near else (m.close if away > m.close else m.contact)


@njit(cache=True, nogil=True, error_model="numpy")
def act(robot: int, view: F64, m: Measures, own: Record, wheels: F64) -> bool:
    """Carry on an action for a frame.

    Args:
        robot: row of the robot in the view, 1 to N.
        view: float64 [1 + 2 N, 6], the team's, at this frame.
        m: measures.
        own: the robot's record of ``actions.ACTION``, as :func:`start` and the frames since left it.
        wheels: float64 [N, 2], the robot's row is written: its left and right wheel, m/s. They are good
            for this frame also when the action is over.

    Returns:
        Whether the action is over: its final condition holds, its time is up after this frame, or the
        robot that is its aim does not exist.
    """
    code = own["code"]
    verb, thing = actions.VERB[code], actions.THING[code]
    if thing >= actions.OPPONENT and own["other"] < 0:
        set_wheels(0.0, 0.0, robot, m, wheels)
        return True
    if has_ball(view, robot, m) or (verb == actions.KICK and touches_ball(view, robot, m)):
        own["had_ball"] = True
    dx, dy = actions.to_aim(view, robot, thing, own["other"], m)
    control(view, robot, verb, thing, dx, dy, m, own, wheels)
    over = is_over(view, robot, verb, dx, dy, m, own)
    own["frames"] += 1
    return over or (own["frames"] + 0.5) * m.frame_s >= actions.LIMIT_S[code]


@njit(cache=True, nogil=True, error_model="numpy")
def _whom(view: F64, robot: int, thing: int, role: int, roles: I64) -> int:
    """Row of the robot that an action is done to, -1 if none."""
    if thing < actions.OPPONENT:
        return -1
    count = len(roles) // 2
    first = 1 if thing == actions.TEAMMATE else count + 1
    wanted = role
    if thing == actions.TEAMMATE and role >= 0:
        wanted = (roles[robot - 1] + role) % 3
    bx, by = offset(view, robot, BALL)
    ux, uy = unit_vector(bx, by)
    best, best_rank, best_cost = -1, 3, np.inf
    for other in range(first, first + count):
        if other == robot:
            continue
        if role < 0:
            dx, dy = offset(view, BALL, other)
            off, cost = 0, 2.0 * distance(view, other, BALL) - ux * dx - uy * dy
        else:
            off, cost = abs(roles[other - 1] - wanted), distance(view, other, robot)
        if off < best_rank or (off == best_rank and cost < best_cost):
            best, best_rank, best_cost = other, off, cost
    return best
