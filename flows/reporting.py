"""The report on a data folder's seasons, as a piece of work."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel

from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.tasks import runner
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.report import write_report


class Reported(BaseModel):
    """Outcome of a report.

    Attributes:
        page: path of its web page.
    """

    page: Path


def report(data: Path, on: str | None = None) -> Reported:
    """Report on the seasons of a data folder.

    Args:
        data: the data folder.
        on: where the report is made, as for :func:`pipeline.engine.placement.places.place_of`.

    Raises:
        NotFound: if no season has been played.
        CorruptFile: if a file of a policy is gone or its bytes have changed.
    """
    with placed(on, data) as executors:
        page = executors.for_pieces(1).run(write_report, Store(executors.path(data))).page
    runner.get().show(lambda: f"[The report]({page})", key="report", description="where the report is")
    return Reported(page=page)
