"""Flow of the noun trajectories: one task a match."""

from pathlib import Path

from flows.stage import Made, Stage, conclude, data_folder, match_names, need, our_flow, run_stage, stage_task
from pipeline import matches as log
from pipeline.settings import TrajectorySettings
from pipeline.store import Store
from pipeline.trajectories import trajectories
from schemas import Quality, Trajectories


def compute(store: Store, match: str, settings: TrajectorySettings) -> Made:
    """Trajectories of one match from its log."""
    receipt = need(store, "matches", match)
    where = str(store.root / receipt.files["log"].path)
    table, quality = trajectories(log.read(store.read(receipt, "log"), where=where), settings)
    return Made(tables=[(table, Trajectories), (quality, Quality)])


STAGE = Stage(
    "trajectories", (Trajectories, Quality), lambda store, match: [need(store, "matches", match)], compute
)


@stage_task(name="trajectories")
def make_trajectories(data: Path, name: str, settings: TrajectorySettings) -> str:
    """Make the trajectories of one match; the key of the receipt."""
    return STAGE.perform(Store(data), name, settings).key


@our_flow(name="trajectories")
def trajectories_flow(data: Path, settings: TrajectorySettings = TrajectorySettings()) -> dict[str, object]:
    """Make the trajectories of all matches that need it."""
    store = data_folder(data)
    return conclude(run_stage(make_trajectories, STAGE, store, match_names(store), settings))
