"""Flow of the noun situations: one task a match."""

import polars as pl

from flows.stage import Made, Scope, Stage, flow_of, need, task_of
from pipeline.pitch import Pitch
from pipeline.settings import SituationSettings
from pipeline.situations.recognise import recognise
from pipeline.store import Store
from schemas import TEAMS, Situations, Trajectories


def compute(store: Store, match: str, settings: SituationSettings, _: Scope) -> Made:
    """Situations of one match from its trajectories."""
    pitch = Pitch.model_validate(need(store, "matches", match).details["pitch"])
    table = store.read_table(need(store, "trajectories", match), "trajectories", Trajectories)
    found = recognise(table, pitch, settings)
    counts = {team: found.filter(pl.col("team") == team).height for team in TEAMS}
    return Made(tables=[(found, Situations)], details={"situations": counts})


STAGE = Stage(
    "situations", (Situations,),
    lambda store, match, _: [need(store, "matches", match), need(store, "trajectories", match)], compute,
)


make_situations = task_of(STAGE)
situations_flow = flow_of(STAGE, make_situations, lambda scope: scope.matches)
