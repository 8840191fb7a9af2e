"""Controllers that change the distance to the ball, a goal or a robot."""

from __future__ import annotations

import math

from numba import njit

from pipeline.arena.teams.executors.actions import ADVERSARY_GOAL, OWN_GOAL, THE_BALL, Aim
from pipeline.arena.teams.executors.to_ball import reach
from pipeline.arena.teams.goalkeeping import OFF_LINE, keep_line
from pipeline.arena.teams.measures import Measures
from pipeline.arena.teams.steering import EITHER, FRONT, along_walls, drive_to, steer
from pipeline.bodies import F64, X, Y


@njit(cache=True, nogil=True, error_model="numpy")
def approach(view: F64, robot: int, aim: Aim, m: Measures, wheels: F64) -> None:
    """046, 088, 118, 138 to 140, 162, 163: drive straight to the aim.

    To a ball that is close already, to the place behind it; to the own goal, into its mouth and there to
    where the ball will cross the line.
    """
    thing = aim.thing
    dx, dy = aim.x - view[robot, X], aim.y - view[robot, Y]
    if thing == OWN_GOAL:
        # so that the goal's middle remains close
        close = math.sqrt(m.close * m.close - (OFF_LINE * m.radius) ** 2) * 0.95
        keep_line(view, robot, min(m.half_goal, close), m, wheels)
    elif thing == ADVERSARY_GOAL:
        drive_to(view, robot, aim.x, aim.y, m.top, EITHER, m, wheels)
    elif thing == THE_BALL and dx * dx + dy * dy < m.close * m.close:
        reach(view, robot, m, wheels)
    else:
        steer(view, robot, dx, dy, m.top, FRONT if thing == THE_BALL else EITHER, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def recede(view: F64, robot: int, aim: Aim, m: Measures, wheels: F64) -> None:
    """033, 034, 098, 128, 150 to 152, 173, 174: drive straight away from the aim, along walls."""
    dx, dy = along_walls(view, robot, view[robot, X] - aim.x, view[robot, Y] - aim.y, m)
    steer(view, robot, dx, dy, m.top, EITHER, m, wheels)
