"""The command serve: call run on a schedule."""

from __future__ import annotations

from contextlib import ExitStack
from difflib import get_close_matches
from zoneinfo import available_timezones

from pitchlore.flows.commands.common import DEFAULTS, Common, On, RunFile
from pitchlore.flows.commands.printing import console
from pitchlore.flows.server import Keeper, named
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.text import without_password
from pitchlore.pipeline.engine.placement.places import place_of

#: Name of the deployment.
NAME = "pitchlore"
#: Most fields of a schedule: Prefect would take a sixth for seconds.
_FIELDS = 5


def serve(
    *, cron: str = "0 6 * * 1", timezone: str = "UTC", settings: RunFile = None, on: On = None,
    common: Common = DEFAULTS,
) -> None:
    """Call ``run`` on a schedule, until Ctrl-C.

    Without a Prefect server (see `pitchlore server start`), one runs as long as this does.

    Args:
        cron: Schedule: minute, hour, day of month, month, day of week.
        timezone: Time zone of the schedule by its IANA name, as Europe/Berlin.
        settings: Named settings or a TOML file.
        on: Where the runs' work is done.
        common: Options of every command.
    """
    store, chosen = common.store, common.settings(settings)
    place_of(on or chosen.placement.on)  # so that a word that names none is refused at once
    with store.committing():  # and so is a folder in which nothing can be written
        pass
    if timezone not in available_timezones():
        near = "".join(f", as {name}" for name in get_close_matches(timezone, available_timezones(), 1))
        raise BadSettings(f"{timezone!r} is no time zone", where="--timezone",
                          next_step=f"Name one of the IANA database{near or ', as Europe/Berlin'}")
    from prefect.client.schemas.schedules import CronSchedule  # noqa: PLC0415 (Prefect takes seconds to load)
    from prefect.schedules import Cron  # noqa: PLC0415 (as above)
    from prefect.types.entrypoint import EntrypointType  # noqa: PLC0415

    from pitchlore.flows.scheduled import scheduled_run  # noqa: PLC0415
    from pitchlore.flows.serving import serving  # noqa: PLC0415

    bad = BadSettings(f"{cron!r} is not a schedule", where="--cron",
                      next_step='Write minute, hour, day, month and weekday, as "0 6 * * 1"')
    if len(cron.split()) > _FIELDS:
        raise bad
    try:
        CronSchedule(cron=cron)
    except ValueError as error:
        raise bad from error
    with ExitStack() as stack:
        url = named(store.root)
        if url is None:
            server = stack.enter_context(Keeper(store.root).running())
            console().print(f"started {server.ui}, which ends with this", highlight=False)
            url = server.api
        stack.enter_context(serving(url))
        console().print(
            f"serving {store.where} at {cron!r}, time zone {timezone}; to run at once: "
            f"PREFECT_API_URL={without_password(url)} prefect deployment run {scheduled_run.name}/{NAME}",
            soft_wrap=True, highlight=False)
        scheduled_run.serve(
            # one at a time: after a sleep of the machine a hundred may be late
            name=NAME, schedule=Cron(cron, timezone=timezone), limit=1, print_starting_message=False,
            entrypoint_type=EntrypointType.MODULE_PATH,
            parameters={
                "data": store.where if store.mirror else str(store.root.resolve()),
                "settings": chosen.model_dump(
                    mode="json", exclude={"imports", "placement", "history", "scout"}),
                "limits": chosen.imports.model_dump(mode="json"),
                "on": on or chosen.placement.on,
                "history": chosen.history.model_dump(mode="json"),
                "scout": chosen.scout.model_dump(mode="json"),
            },
        )
