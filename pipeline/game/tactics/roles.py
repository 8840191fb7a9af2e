"""Roles of robots, goalkeeper, midfield and striker, by distance to the own goal (paper, section 4)."""

from __future__ import annotations

from pitchlore.pipeline.game.bodies import X, Y
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.kernels import njit

GOALKEEPER, MIDFIELD, STRIKER = range(3)


@njit(cache=True, nogil=True, error_model="numpy")
def assign(view: F64, m: Measures, roles: I64) -> None:
    """Fill in all robots' roles, as :func:`pipeline.stages.trajectories.kinematics.assign_roles` gives them.

    Args:
        view: float64 [1 + 2 N, 6], a team's view.
        m: measures.
        roles: int64 [2 N], written: of the robots of rows 1 to 2 N, GOALKEEPER, MIDFIELD or STRIKER.
    """
    count = len(roles) // 2
    for robot in range(1, 2 * count + 1):
        first, goal = (1, -m.goal_x) if robot <= count else (count + 1, m.goal_x)
        mine = (view[robot, X] - goal) ** 2 + view[robot, Y] ** 2
        nearer = 0
        for other in range(first, first + count):
            distance = (view[other, X] - goal) ** 2 + view[other, Y] ** 2
            if distance < mine or (distance == mine and other < robot):
                nearer += 1
        mid = nearer <= (count - 1) // 2
        roles[robot - 1] = GOALKEEPER if nearer == 0 else (MIDFIELD if mid else STRIKER)
