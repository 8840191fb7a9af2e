"""The contracts: a dataframely schema for each public table, a `.msg` file for each streamed message."""

from __future__ import annotations

from schemas import lean  # noqa: F401 (before any other: see there)
from schemas.appraisals import Appraisals as Appraisals
from schemas.behaviours import Behaviours as Behaviours
from schemas.behaviours import Patterns as Patterns
from schemas.chances import Chances as Chances
from schemas.commands import Commands as Commands
from schemas.decisions import Decisions as Decisions
from schemas.evaluations import Evaluations as Evaluations
from schemas.events import Passes as Passes
from schemas.events import Possession as Possession
from schemas.events import Pressure as Pressure
from schemas.events import Shots as Shots
from schemas.goals import Goals as Goals
from schemas.grams import Grams as Grams
from schemas.knowledge import Occasions as Occasions
from schemas.matches import Matches as Matches
from schemas.matches import Quality as Quality
from schemas.matches import Referee as Referee
from schemas.matches import Sides as Sides
from schemas.neurons import Neurons as Neurons
from schemas.paradigms import Paradigms as Paradigms
from schemas.paradigms import Verdicts as Verdicts
from schemas.policies import Policies as Policies
from schemas.policies import Returns as Returns
from schemas.policies import States as States
from schemas.restarts import Restarts as Restarts
from schemas.seasons import Claims as Claims
from schemas.seasons import Games as Games
from schemas.seasons import Growth as Growth
from schemas.seasons import StatesPlayed as StatesPlayed
from schemas.sequences import Choices as Choices
from schemas.sequences import Sequences as Sequences
from schemas.sights import Sights as Sights
from schemas.situations import Situations as Situations
from schemas.table import BODIES as BODIES
from schemas.table import KEYS as KEYS
from schemas.table import ROLES as ROLES
from schemas.table import SIDES as SIDES
from schemas.table import STAND_IN as STAND_IN
from schemas.table import Side as Side
from schemas.table import Table as Table
from schemas.table import called as called
from schemas.table import note_on as note_on
from schemas.trajectories import Trajectories as Trajectories
from schemas.values import Moments as Moments
from schemas.values import Values as Values
from schemas.values import Worths as Worths

#: The tables a user sees in the catalogue, by name: all that are imported here and are public.
PUBLIC: dict[str, type[Table]] = {
    table.NAME: table
    for table in sorted(
        (it for it in list(vars().values()) if isinstance(it, type) and issubclass(it, Table)
         and it is not Table and it.PUBLIC),
        key=lambda table: table.NAME,
    )
}
