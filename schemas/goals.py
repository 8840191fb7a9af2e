"""Goals: their makers and kinds."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import SIDES, Table, match_id, unit

KINDS = ("direct", "indirect", "error")
#: What may tell goals: a referee (of a simulator, or in a log), or in a tracking table its score, its states of the
#: game, its kick-offs, or the ball alone.
ORIGINS = ("referee", "score", "state", "kick-off", "ball")


class Goals(Table):
    """One goal."""

    NAME: ClassVar[str] = "goals"
    VERSION: ClassVar[int] = 2
    SINCE: ClassVar[int] = 1

    match_id = match_id()
    t_ns = dy.Int64(description="time at which the referee gave it", metadata=unit("ns"))
    team = dy.Enum(SIDES, nullable=True, description="team that the goal counts for; null where the source does not say")
    robot = dy.Int16(nullable=True, description="number of the robot (of either team) that made it; null without a touch of the ball, and where the team is null")
    kind = dy.Enum(KINDS, nullable=True, description="direct action, indirect action, or error of the adversary; null where unknown")
    origin = dy.Enum(ORIGINS, nullable=True, description=(
        "what told it: a referee, or a tracking table's score, states, kick-offs or ball; null in files of before"
    ))
    confidence = dy.Float64(nullable=True, min=0, max=1, description=(
        "chance that it is a goal if it was found from the ball; null where the source tells it"
    ))
