"""Sequences: the situations of robots one after the other, with what grams of them are valued by."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from schemas.table import ROLES, SIDES, Table, match_id, unit


class Sequences(Table):
    """One situation of one robot, in the order of the table situations, and its values."""

    NAME: ClassVar[str] = "sequences"
    VERSION: ClassVar[int] = 1
    PUBLIC: ClassVar[bool] = False

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    role = dy.Enum(ROLES, description="the robot's role when the situation starts")
    code = dy.Int16(min=1, max=194, description="the paper's code (Table 1)")
    follows = dy.Bool(description="whether it follows the situation of the row before without a break")
    value = dy.Float64(min=-1, max=1, description="value by the next goal (paper section 3.2.2)")
    change = dy.Float64(nullable=True, min=-2, max=2, description=(
        "what it changes of V, goals included; null if groups are valued by the next goal (outcome = 'paper')"
    ))
    x = dy.Float32(nullable=True, description="the robot's place at the start, along the pitch, its team attacks +x", metadata=unit("m"))
    y = dy.Float32(nullable=True, description="the same across the pitch, to the left of +x", metadata=unit("m"))
