"""Occasions: the states in which behaviours were seen."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from schemas.behaviours import behaviour_id
from schemas.table import ROLES, Table


class Occasions(Table):
    """One behaviour in one state of one version of the knowledge. Sorted by role, state, behaviour_id."""

    NAME: ClassVar[str] = "occasions"
    VERSION: ClassVar[int] = 1

    version = dy.Int32(min=1, description="version of the knowledge")
    role = dy.Enum(ROLES, description="role of the robot")
    state = dy.Int64(min=0, description="36-element state in mixed radix (or the state key of the settings)")
    behaviour_id = behaviour_id()
    count = dy.Int64(min=1, description="how often the behaviour was started in the state")
    value = dy.Float64(description="mean of those instances' values, in (-1, 1)")
    initial = dy.Float64(description=(
        "optimistic action value that the behaviour enters the state with: the greatest value of the "
        "behaviours seen there in this role"
    ))
