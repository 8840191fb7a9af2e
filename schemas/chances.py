"""Chances: what shots like each one were worth to others."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import SIDES, Table, match_id, unit


class Chances(Table):
    """Expected goals (xG) of one shot. One row a shot, in the order of the table shots.

    As in football, xG is the probability that a shot becomes a goal, by what is known at its last touch: the
    distance from the goal, the angle at which the ball sees it, and which adversaries are in the way. Speed
    and direction after the touch have no part in it (they would make it post-shot xG). All shots count, wide
    ones too. A shot is a goal if its outcome is `goal`, perhaps by a deflection.

    The model is a logistic regression on the league's own shots, without those of the shot's match.
    """

    NAME: ClassVar[str] = "chances"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team that shoots")
    t_ns = dy.Int64(description="last touch before the ball leaves: with match_id the key of the shot", metadata=unit("ns"))
    robot = dy.Int16(description="number of the robot that shoots")
    xg = dy.Float64(nullable=True, min=0, max=1, description=(
        "probability that the shot becomes a goal; null if the shots that it would rest on became fewer goals than "
        "goals_at_least (settings), or became goals without exception"
    ))
    goals = dy.Int32(min=0, description="number of goals among the shots that it rests on, of other matches of the league")
    shots = dy.Int32(min=0, description="number of these shots")
