"""Flow of the noun situations: one task a match."""

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
from pipeline.pitch import Pitch
from pipeline.settings import Settings, SituationSettings
from pipeline.situations import recognise
from pipeline.store import Store
from schemas import Situations, Trajectories


def compute(store: Store, match: str, settings: SituationSettings, _: Scope) -> Made:
    """Situations of one match from its trajectories."""
    pitch = Pitch.model_validate(need(store, "matches", match).details["pitch"])
    table = store.read_table(need(store, "trajectories", match), "trajectories", Trajectories)
    found = recognise(table, pitch, settings)
    return Made(tables=[(found, Situations)], details={"situations": found.height})


STAGE = Stage(
    "situations", (Situations,),
    lambda store, match, _: [need(store, "matches", match), need(store, "trajectories", match)], compute,
)


@stage_task(name="situations")
def make_situations(data: Path, name: str, settings: SituationSettings, scope: Scope) -> str:
    """Recognise the situations of one match; the key of the receipt."""
    return STAGE.perform(Store(data), name, settings, scope).key


@our_flow(name="situations")
def situations_flow(data: Path, settings: Settings = Settings()) -> dict[str, object]:
    """Recognise the situations of all matches that need it."""
    store = data_folder(data)
    scope = scope_of(store, settings)
    report = run_stage(make_situations, STAGE, store, list(scope.matches), settings.situations, scope)
    return conclude(store, report)
