"""Flow of the noun goals: one task a match."""

from flows.stage import Made, Scope, Stage, flow_of, need, task_of
from pipeline.goals import attribute
from pipeline.pitch import Pitch
from pipeline.settings import GoalSettings
from pipeline.store import Store
from schemas import Goals, Referee, Situations, Trajectories

NOUNS = ("matches", "trajectories", "situations")


def compute(store: Store, match: str, settings: GoalSettings, _: Scope) -> Made:
    """Goals of one match, attributed."""
    log, trajectories, situations = (need(store, noun, match) for noun in NOUNS)
    table = attribute(
        store.read_table(log, "referee", Referee),
        store.read_table(trajectories, "trajectories", Trajectories),
        store.read_table(situations, "situations", Situations),
        Pitch.model_validate(log.details["pitch"]),
        settings,
    )
    return Made(tables=[(table, Goals)], details={"goals": table.height})


STAGE = Stage(
    "goals", (Goals,), lambda store, match, _: [need(store, noun, match) for noun in NOUNS], compute
)


make_goals = task_of(STAGE)
goals_flow = flow_of(STAGE, make_goals, lambda scope: scope.matches)
