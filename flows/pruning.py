"""Our own old flow runs are removed from Prefect's database, so that it does not grow for ever.

The server of a data folder forgets by itself (`flows/server.py`). Every other one, above all that of
Prefect's own home, keeps flow runs until somebody removes them.
"""

from __future__ import annotations

from contextlib import suppress
from datetime import UTC, datetime, timedelta

from prefect import get_run_logger
from prefect.client.orchestration import get_client
from prefect.client.schemas.filters import (
    FlowRunFilter,
    FlowRunFilterEndTime,
    FlowRunFilterFlowVersion,
    FlowRunFilterState,
    FlowRunFilterStateType,
)
from prefect.client.schemas.objects import TERMINAL_STATES
from prefect.client.schemas.sorting import FlowRunSort
from prefect.exceptions import ObjectNotFound

from pitchlore.pipeline.base.errors import in_one_line
from pitchlore.pipeline.settings import HistorySettings

#: Version of all our flows, by which their runs are known in the database. Other people's have another.
OURS = "pitchlore"
#: Most runs that one run removes: a removal takes some milliseconds, or a second for one with many tasks.
AT_ONCE = 20


def prune(settings: HistorySettings) -> int:
    """Remove our flow runs that ended before the days of the settings, with their tasks; the oldest first.

    Returns:
        Number of runs that were removed, at most :data:`AT_ONCE`. Runs that have not ended are left.
    """
    if not settings.days:
        return 0
    old = FlowRunFilter(
        flow_version=FlowRunFilterFlowVersion(any_=[OURS]),
        state=FlowRunFilterState(type=FlowRunFilterStateType(any_=list(TERMINAL_STATES))),
        end_time=FlowRunFilterEndTime.model_validate(
            {"before_": _now() - timedelta(days=settings.days)}),
    )
    removed = 0
    with get_client(sync_client=True) as client:
        for run in client.read_flow_runs(flow_run_filter=old, sort=FlowRunSort.START_TIME_ASC, limit=AT_ONCE):
            with suppress(ObjectNotFound):  # another run has removed it
                client.delete_flow_run(run.id)
                removed += 1
    return removed


def prune_or_say(settings: HistorySettings) -> None:
    """Remove our old flow runs (:func:`prune`). If the server refuses, that is logged, and ends no flow."""
    try:
        prune(settings)
    except Exception as error:
        get_run_logger().warning("Old flow runs could not be removed (%s).", in_one_line(error))


def _now() -> datetime:
    return datetime.now(UTC)
