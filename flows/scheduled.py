"""The flows that a schedule runs. Each prints one line on the outcome; its state tells success."""

from datetime import datetime
from pathlib import Path
from typing import Any

from prefect import runtime
from prefect.client.schemas.objects import State
from prefect.states import Completed, Failed

from pitchlore.flows.flow import our_flow
from pitchlore.flows.runner import tell_assets
from pitchlore.flows.work import run
from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.engine.child import belong
from pitchlore.pipeline.engine.history import log
from pitchlore.pipeline.engine.imports import GROWN
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.engine.run import train_policy
from pitchlore.pipeline.settings import HistorySettings, ImportSettings, ScoutSettings, Settings
from pitchlore.pipeline.store import Store

# Prefect runs the flow in a process of its own, which loads this module first, and then asks the server: if
# `serve` is killed, there is none any more, and it would ask for minutes
belong()

#: Name of the state in which a run ends that put something into quarantine.
QUARANTINED = "Quarantined"


@our_flow(name="run")
def scheduled_run(
    data: Path, settings: Settings = Settings(), train: bool = True,
    limits: ImportSettings = ImportSettings(), on: str | None = None,
    history: HistorySettings = HistorySettings(), scout: ScoutSettings = ScoutSettings(),
) -> State[dict[str, Any]]:
    """Import the new recordings of the inbox, and bring every stage up to date.

    Nobody watches: unless the settings say otherwise, each recording is read in a process of its own.

    Args:
        data: the data folder.
        settings: settings of the stages.
        train: whether to train a policy when the knowledge is new.
        limits: bounds of the cost of reading a recording.
        on: where work is done, as for :func:`pipeline.engine.placement.places.place_of`.
        history: how much of past runs is remembered.
        scout: whether the scout's pages follow.

    Returns:
        Completed; or Failed with the name Quarantined, if something went into quarantine that was not there,
        or failed otherwise than in the run before: so what is bad is an alert once, not every night.
        (`pitchlore run` exits with 1 each time.) Everything else is made in either case.
    """
    if limits.isolate is None:
        limits = limits.isolated()
    store = Store(data)
    store.catch_up()
    quarantined, failed = set(store.quarantined()), _last_failures(store)
    report = run(data, None, settings, train, limits, on, history, scout)
    tell_assets(data, report)
    now = store.quarantined()
    known = {record.reason for record in now if record in quarantined}
    new = {what for what, why in report.failures.items() if why not in known and failed.get(what) != why}
    new |= {record.name for record in now if record not in quarantined}
    line = said_of(report)
    if report.failures and not new:
        line += " (as before)"
    _say("run", line)
    if new:
        return Failed(name=QUARANTINED, message=line)
    return Completed(message=line, data=report.model_dump())


def _last_failures(store: Store) -> dict[str, str]:
    """The failures of the last run in the log, as far as it has them; what failed there, and why."""
    runs = [entry for entry in log(store).entries if entry.what == "run"]
    return dict(runs[-1].failures) if runs else {}


@our_flow(name="train")
def scheduled_training(
    data: Path, settings: Settings = Settings(), history: HistorySettings = HistorySettings(),
) -> State[dict[str, Any]]:
    """Train the next policy version on the newest knowledge, unless a version has learned all of it.

    Args:
        data: the data folder.
        settings: settings of the stages.
        history: how much of past runs is remembered.

    Returns:
        Completed; or Failed, if there is no knowledge yet, or the catalogue could not be brought up to date.
    """
    try:
        done = train_policy(data, settings, history)
    except NotFound as error:
        _say("train", str(error))
        return Failed(message=str(error))
    line = f"policy version {done.version} is new" if done.new else "nothing new"
    line += "".join(f", {what}: {why}" for what, why in done.failed.items())
    _say("train", line)
    return Failed(message=line) if done.failed else Completed(message=line, data=done.model_dump())


def _say(what: str, line: str) -> None:
    """Print a line for who watches `serve` or a worker."""
    now = f"{datetime.now().astimezone():%Y-%m-%d %H:%M:%S}"
    print(f"{now} {what} {runtime.flow_run.name}: {line}", flush=True)  # noqa: T201 (see above)


def said_of(report: RunReport) -> str:
    """One line on the outcome of a run."""
    if not report.made and not report.failures:
        return "nothing new"
    line = f"{report.made} made, {sum(stage.unchanged for stage in report.stages)} kept"
    if report.policy_is_new:
        line += f", policy version {report.policy} is new"
    if report.failures:
        line += f", {len(report.failures)} not made: {', '.join(sorted(report.failures))}"
    return line + "".join(f"; {note}" for note in report.stage("matches").notes if GROWN in note)
