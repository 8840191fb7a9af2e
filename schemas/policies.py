"""Policies: action values of behaviours in states."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from schemas.behaviours import behaviour_id
from schemas.table import KEYS, ROLES, Table


class Policies(Table):
    """One state-behaviour pair of one policy version.

    Unique by role, key, state and behaviour_id, and sorted so.
    """

    NAME: ClassVar[str] = "policies"
    VERSION: ClassVar[int] = 3

    version = dy.Int32(min=1, description="version of the policy")
    knowledge_version = dy.Int32(min=1, description="version of the knowledge whose pairs it values")
    role = dy.Enum(ROLES, description="role of the robot")
    key = dy.Enum(KEYS, description="which elements of the state are kept")
    state = dy.Int64(min=0, description="state in mixed radix, by its key")
    behaviour_id = behaviour_id()
    q = dy.Float64(description="action value")
    visits = dy.Int64(min=0, description="visits to the pair in the batches that the policy and its ancestors learned from")
    evidence = dy.Float64(min=0, description="number of episodes that the value is the mean of, its start included; at most one over the step size")
