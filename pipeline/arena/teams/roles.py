"""Roles of robots, goalkeeper, midfield and striker, by distance to the own goal (paper, section 4)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from pipeline.arena.teams.measures import Measures
from pipeline.bodies import F64, X, Y

I64 = npt.NDArray[np.int64]

GOALKEEPER, MIDFIELD, STRIKER = range(3)


@njit(cache=True, nogil=True, error_model="numpy")
def rank(view: F64, robot: int, goal_x: float) -> int:
    """Number of robots of a robot's team that are nearer to their own goal; the lower row wins ties.

    Args:
        view: float64 [1 + 2 N, 6], a team's view.
        robot: its row, 1 to 2 N; the second team's goal is at +goal_x.
        goal_x: of the goal lines, metres.
    """
    count = (view.shape[0] - 1) // 2
    first, goal = (1, -goal_x) if robot <= count else (count + 1, goal_x)
    mine = (view[robot, X] - goal) ** 2 + view[robot, Y] ** 2
    nearer = 0
    for other in range(first, first + count):
        distance = (view[other, X] - goal) ** 2 + view[other, Y] ** 2
        if distance < mine or (distance == mine and other < robot):
            nearer += 1
    return nearer


@njit(cache=True, nogil=True, error_model="numpy")
def assign(view: F64, m: Measures, roles: I64) -> None:
    """Fill in the roles of all robots, as :func:`pipeline.trajectories.kinematics.assign_roles` gives them.

    Args:
        view: float64 [1 + 2 N, 6], a team's view.
        m: measures.
        roles: int64 [2 N], written: of the robots of rows 1 to 2 N, GOALKEEPER, MIDFIELD or STRIKER.
    """
    mates = len(roles) // 2 - 1
    for i in range(len(roles)):
        place = rank(view, i + 1, m.goal_x)
        roles[i] = GOALKEEPER if place == 0 else (MIDFIELD if place <= mates // 2 else STRIKER)
