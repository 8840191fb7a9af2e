"""Flow of the noun trajectories: one task a match."""

from flows.stage import Made, Scope, Stage, flow_of, need, task_of
from pipeline import matches as log
from pipeline.settings import TrajectorySettings
from pipeline.store import Store
from pipeline.trajectories.derive import trajectories
from schemas import Quality, Trajectories


def compute(store: Store, match: str, settings: TrajectorySettings, _: Scope) -> Made:
    """Trajectories of one match from its log."""
    receipt = need(store, "matches", match)
    where = str(store.root / receipt.files["log"].path)
    table, quality = trajectories(log.read(store.read(receipt, "log"), where=where), settings)
    return Made(tables=[(table, Trajectories), (quality, Quality)])


STAGE = Stage(
    "trajectories", (Trajectories, Quality), lambda store, match, _: [need(store, "matches", match)], compute
)


make_trajectories = task_of(STAGE)
trajectories_flow = flow_of(STAGE, make_trajectories, lambda scope: scope.matches)
