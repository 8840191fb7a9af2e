"""The noun paradigms: a piece of work for each sweep of curves, then a report for each figure."""

from pathlib import Path

from pitchlore.pipeline.engine import paradigms
from pitchlore.pipeline.engine.paradigms import NOUN, FigureReport, report_work, reports, sweep_work
from pitchlore.pipeline.engine.placement.crew import crew
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.run import concluded, suspecting
from pitchlore.pipeline.engine.tasks import run_pieces
from pitchlore.pipeline.paradigms.experiments import Design, Sweep, sweeps
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.views.plots.paradigms import plots_of_points


def make_sweep(data: Path, sweep: Sweep) -> None:
    """Play a sweep's curves."""
    paradigms.make_sweep(Store(data), sweep)


def make_report(data: Path, report: FigureReport) -> None:
    """Judge a figure's claims and draw its plots."""
    paradigms.make_report(Store(data), report, plots_of_points)


def play_paradigms(data: Path, design: Design = Design(), on: str | None = None) -> StageReport:
    """Play the missing curves of a design, then report on its figures."""
    store = suspecting(data)
    with placed(on, store.root):
        return concluded(store, _bring_up_to_date(store, design))


def _bring_up_to_date(store: Store, design: Design) -> StageReport:
    every, data = sweeps(design), crew.get().path(store.root)
    todo = [sweep for sweep in every if store.holding(sweep_work(sweep)) is None]
    played = run_pieces(make_sweep, NOUN, {
        sweep.name: {"data": data, "sweep": sweep} for sweep in todo}, at_once=1)
    played.kept += len(every) - len(todo)
    for report in reports(design):
        if set(report.sweeps) & set(played.failed):
            continue
        if store.holding(report_work(store, report)) is None:
            arguments = {"data": data, "report": report}
            played.add(run_pieces(make_report, NOUN, {report.name: arguments}, task="paradigms-report"))
        else:
            played.kept += 1
    return played
