"""Policies: action values of behaviours in states."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from schemas.behaviours import behaviour_id
from schemas.table import ROLES, Table


class Policies(Table):
    """One state-behaviour pair of one policy version. Sorted by role, state, behaviour_id."""

    NAME: ClassVar[str] = "policies"
    VERSION: ClassVar[int] = 1

    version = dy.Int32(min=1, description="version of the policy")
    knowledge_version = dy.Int32(min=1, description="version of the knowledge whose pairs it values")
    role = dy.Enum(ROLES, description="role of the robot")
    state = dy.Int64(min=0, description="36-element state in mixed radix (or the state key of the settings)")
    behaviour_id = behaviour_id()
    q = dy.Float64(description="action value")
    visits = dy.Int64(min=0, description="how often the batch visited the pair")
