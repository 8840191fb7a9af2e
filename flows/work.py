"""Pieces of work by name: what commands call, and what flows hand to Prefect. Nothing here loads Prefect."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from pitchlore.pipeline.engine import run as engine
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.settings import HistorySettings, ImportSettings, ScoutSettings, Settings
from pitchlore.pipeline.store import Store


def run(
    data: Path, recordings: list[Recording] | None = None, settings: Settings = Settings(),
    train: bool = True, limits: ImportSettings = ImportSettings(), on: str | None = None,
    history: HistorySettings = HistorySettings(), scout: ScoutSettings = ScoutSettings(),
) -> RunReport:
    """Import the new recordings of the inbox (or ``recordings``), and bring every stage up to date.

    The scout's pages follow where the settings say so. For arguments and errors see
    :func:`pipeline.engine.run.run`.
    """
    return engine.run(data, recordings, settings, train, limits, on, history,
                      partial(_write_pages, scout.mine) if scout.refresh else None)


def _write_pages(mine: str, store: Store, report: RunReport) -> None:
    from pitchlore.pipeline.views.scout.content.write import write_after  # noqa: PLC0415 (only who asks for pages waits)

    write_after(store, report, mine)
