"""Flow of the noun goals: one task a match."""

from pathlib import Path

from flows.stage import (
    Made,
    Scope,
    Stage,
    conclude,
    data_folder,
    need,
    our_flow,
    run_stage,
    scope_of,
    stage_task,
)
from pipeline.goals import attribute
from pipeline.pitch import Pitch
from pipeline.settings import GoalSettings, Settings
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


@stage_task(name="goals")
def make_goals(data: Path, name: str, settings: GoalSettings, scope: Scope) -> str:
    """Attribute the goals of one match; the key of the receipt."""
    return STAGE.perform(Store(data), name, settings, scope).key


@our_flow(name="goals")
def goals_flow(data: Path, settings: Settings = Settings()) -> dict[str, object]:
    """Attribute the goals of all matches that need it."""
    store = data_folder(data)
    scope = scope_of(store, settings)
    report = run_stage(make_goals, STAGE, store, list(scope.matches), settings.goals, scope)
    return conclude(store, report)
