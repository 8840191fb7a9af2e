"""Flow of the noun situations: one task a match."""

from pathlib import Path

from flows.stage import Made, Stage, conclude, data_folder, match_names, need, our_flow, run_stage, stage_task
from pipeline.pitch import Pitch
from pipeline.settings import SituationSettings
from pipeline.situations import recognise
from pipeline.store import Store
from schemas import Situations, Trajectories


def compute(store: Store, match: str, settings: SituationSettings) -> Made:
    """Situations of one match from its trajectories."""
    pitch = Pitch.model_validate(need(store, "matches", match).details["pitch"])
    table = store.read_table(need(store, "trajectories", match), "trajectories", Trajectories)
    found = recognise(table, pitch, settings)
    return Made(tables=[(found, Situations)], details={"situations": found.height})


STAGE = Stage(
    "situations", (Situations,),
    lambda store, match: [need(store, "matches", match), need(store, "trajectories", match)], compute,
)


@stage_task(name="situations")
def make_situations(data: Path, name: str, settings: SituationSettings) -> str:
    """Recognise the situations of one match; the key of the receipt."""
    return STAGE.perform(Store(data), name, settings).key


@our_flow(name="situations")
def situations_flow(data: Path, settings: SituationSettings = SituationSettings()) -> dict[str, object]:
    """Recognise the situations of all matches that need it."""
    store = data_folder(data)
    return conclude(run_stage(make_situations, STAGE, store, match_names(store), settings))
