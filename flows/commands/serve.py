"""The command serve: runs on a schedule."""

from __future__ import annotations

from pathlib import Path

from prefect.client.schemas.schedules import CronSchedule
from prefect.settings import PREFECT_API_URL
from pydantic import ValidationError

from flows.commands.common import DEFAULTS, Common
from flows.run import run_flow
from pipeline.errors import BadSettings


def serve(*, cron: str = "0 6 * * 1", settings: Path | None = None, common: Common = DEFAULTS) -> None:
    """Stay and run everything new on a schedule; needs a Prefect server (PREFECT_API_URL).

    Args:
        cron: When to run, as minute, hour, day of month, month, day of week.
        settings: A TOML file with the settings that differ from the defaults.
        common: Options of every command.
    """
    store, chosen = common.store, common.settings(settings)
    if not PREFECT_API_URL.value():
        raise BadSettings("no Prefect server is named", where="PREFECT_API_URL",
                          next_step="Start one with `prefect server start` and set it to its address")
    try:
        CronSchedule(cron=cron)
    except ValidationError as error:
        raise BadSettings(f"{cron!r} is not a schedule", where="--cron",
                          next_step='Write minute, hour, day, month and weekday, as "0 6 * * 1"') from error
    run_flow.serve(
        name="pitchlore", cron=cron,
        parameters={"data": str(store.root.resolve()), "settings": chosen.model_dump(mode="json")},
    )
