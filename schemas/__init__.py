"""The contracts: one dataframely schema a public table, one `.msg` file a streamed message."""

from __future__ import annotations

from schemas import lean  # noqa: F401 (before any other: see there)
from schemas.behaviours import Behaviours, Patterns
from schemas.decisions import Decisions
from schemas.evaluations import Evaluations
from schemas.goals import Goals
from schemas.grams import Grams
from schemas.knowledge import Occasions
from schemas.matches import Matches, Quality, Referee
from schemas.paradigms import Paradigms, Verdicts
from schemas.policies import Policies
from schemas.seasons import Claims, Games, Growth, StatesPlayed
from schemas.situations import Situations
from schemas.table import BODIES, KEYS, ROLES, STAND_IN, TEAMS, Table, note_on
from schemas.trajectories import Trajectories

#: The tables a user sees in the catalogue, by name.
PUBLIC: dict[str, type[Table]] = {
    table.NAME: table
    for table in (
        Matches, Referee, Quality, Trajectories, Situations, Goals, Grams,
        Behaviours, Occasions, Decisions, Policies, Paradigms, Verdicts, Games,
        Growth, Claims, Evaluations,
    )
}

__all__ = [
    "BODIES", "KEYS", "PUBLIC", "ROLES", "STAND_IN", "TEAMS", "Behaviours", "Claims", "Decisions", "Evaluations",
    "Games", "Goals", "Grams", "Growth", "Matches", "Occasions", "Paradigms", "Patterns", "Policies", "Quality",
    "Referee", "Situations", "StatesPlayed", "Table", "Trajectories", "Verdicts", "note_on",
]
