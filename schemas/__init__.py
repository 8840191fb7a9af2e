"""The contracts: a dataframely schema for each public table, a `.msg` file for each streamed message."""

from __future__ import annotations

from pitchlore.schemas import lean  # noqa: F401 (before any other: see there)
from pitchlore.schemas.acts import Acts as Acts
from pitchlore.schemas.acts import Answers as Answers
from pitchlore.schemas.analysis import Efforts as Efforts
from pitchlore.schemas.analysis import PassAttempts as PassAttempts
from pitchlore.schemas.analysis import Phases as Phases
from pitchlore.schemas.analysis import Pressing as Pressing
from pitchlore.schemas.analysis import Space as Space
from pitchlore.schemas.analysis import Stamina as Stamina
from pitchlore.schemas.appraisals import Appraisals as Appraisals
from pitchlore.schemas.behaviours import Behaviours as Behaviours
from pitchlore.schemas.behaviours import Patterns as Patterns
from pitchlore.schemas.chances import Chances as Chances
from pitchlore.schemas.commands import Commands as Commands
from pitchlore.schemas.decisions import Decisions as Decisions
from pitchlore.schemas.evaluations import Evaluations as Evaluations
from pitchlore.schemas.events import Passes as Passes
from pitchlore.schemas.events import Possession as Possession
from pitchlore.schemas.events import Pressure as Pressure
from pitchlore.schemas.events import Shots as Shots
from pitchlore.schemas.goals import Goals as Goals
from pitchlore.schemas.grams import Grams as Grams
from pitchlore.schemas.knowledge import Occasions as Occasions
from pitchlore.schemas.matches import Matches as Matches
from pitchlore.schemas.matches import Quality as Quality
from pitchlore.schemas.matches import Referee as Referee
from pitchlore.schemas.matches import Sides as Sides
from pitchlore.schemas.neurons import Neurons as Neurons
from pitchlore.schemas.options import Clues as Clues
from pitchlore.schemas.options import Habits as Habits
from pitchlore.schemas.options import HabitTrees as HabitTrees
from pitchlore.schemas.options import Options as Options
from pitchlore.schemas.paradigms import Paradigms as Paradigms
from pitchlore.schemas.paradigms import Verdicts as Verdicts
from pitchlore.schemas.policies import Policies as Policies
from pitchlore.schemas.policies import Returns as Returns
from pitchlore.schemas.policies import States as States
from pitchlore.schemas.restarts import Restarts as Restarts
from pitchlore.schemas.seasons import Claims as Claims
from pitchlore.schemas.seasons import Games as Games
from pitchlore.schemas.seasons import Growth as Growth
from pitchlore.schemas.seasons import StatesPlayed as StatesPlayed
from pitchlore.schemas.sequences import Choices as Choices
from pitchlore.schemas.sequences import Sequences as Sequences
from pitchlore.schemas.sights import Sights as Sights
from pitchlore.schemas.situations import Situations as Situations
from pitchlore.schemas.ssl import GameEvents as GameEvents
from pitchlore.schemas.ssl import Kicks as Kicks
from pitchlore.schemas.table import AWAY as AWAY
from pitchlore.schemas.table import BODIES as BODIES
from pitchlore.schemas.table import HOME as HOME
from pitchlore.schemas.table import KEYS as KEYS
from pitchlore.schemas.table import ROLES as ROLES
from pitchlore.schemas.table import SIDES as SIDES
from pitchlore.schemas.table import STAND_IN as STAND_IN
from pitchlore.schemas.table import Side as Side
from pitchlore.schemas.table import Table as Table
from pitchlore.schemas.table import called as called
from pitchlore.schemas.table import note_on as note_on
from pitchlore.schemas.trajectories import Trajectories as Trajectories
from pitchlore.schemas.values import Moments as Moments
from pitchlore.schemas.values import Values as Values
from pitchlore.schemas.values import Worths as Worths

#: The tables a user sees in the catalogue, by name: all that are imported here and are public.
PUBLIC: dict[str, type[Table]] = {
    table.NAME: table
    for table in sorted(
        (it for it in list(vars().values()) if isinstance(it, type) and issubclass(it, Table)
         and it is not Table and it.PUBLIC),
        key=lambda table: table.NAME,
    )
}
