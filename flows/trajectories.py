"""Flow of the noun trajectories: one task a match."""

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
from pipeline import matches as log
from pipeline.settings import Settings, TrajectorySettings
from pipeline.store import Store
from pipeline.trajectories import trajectories
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


@stage_task(name="trajectories")
def make_trajectories(data: Path, name: str, settings: TrajectorySettings, scope: Scope) -> str:
    """Make the trajectories of one match; the key of the receipt."""
    return STAGE.perform(Store(data), name, settings, scope).key


@our_flow(name="trajectories")
def trajectories_flow(data: Path, settings: Settings = Settings()) -> dict[str, object]:
    """Make the trajectories of all matches that need it."""
    store = data_folder(data)
    scope = scope_of(store, settings)
    report = run_stage(make_trajectories, STAGE, store, list(scope.matches), settings.trajectories, scope)
    return conclude(store, report)
