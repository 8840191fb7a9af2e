"""Occasions: the states in which behaviours began."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.behaviours import behaviour_id
from pitchlore.schemas.table import KEYS, ROLES, Table


class Occasions(Table):
    """One behaviour of one team in one state of one version of the knowledge.

    Unique by team, kind, role, key, state and behaviour_id, and sorted so. The keys after the first (from fine to
    coarse) hold the same occasions again with fewer elements of the state. State numbers of different
    keys are unrelated.
    """

    NAME: ClassVar[str] = "occasions"
    VERSION: ClassVar[int] = 3
    SINCE: ClassVar[int] = 2

    version = dy.Int32(min=1, description="version of the knowledge")
    role = dy.Enum(ROLES, description="role of the robot")
    key = dy.Enum(KEYS, description="which elements of the state are kept")
    state = dy.Int64(min=0, description="state in mixed radix, by its key")
    behaviour_id = behaviour_id()
    count = dy.Int64(min=0, description=(
        "number of times that the behaviour began in the state; 0 only for moves randomly, which every "
        "state offers in which a player decided"
    ))
    value = dy.Float64(
        nullable=True, description="mean of those instances' values, in (-1, 1); null if there are none"
    )
    initial = dy.Float64(description=(
        "optimistic first action value of the behaviour in the state: the greatest value of the behaviours "
        "seen there in this role, or the settings' least value if that is greater"
    ))
    team = dy.String(nullable=True, description="team or pool of teams that showed it; null before teams were told apart")
    kind = dy.String(nullable=True, description="league that it was shown in: vsss, ssl, 2d or human")
