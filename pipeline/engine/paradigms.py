"""The noun paradigms: a piece of work for each sweep of curves, then a report for each figure."""

from collections.abc import Callable
from pathlib import Path

import polars as pl
from pydantic import BaseModel

from pitchlore.pipeline.engine.outputs import digests, need, refusing, table_of
from pitchlore.pipeline.engine.placement.executors import executors
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.tasks import run_pieces
from pitchlore.pipeline.stages.paradigms.claims import verdicts
from pitchlore.pipeline.stages.paradigms.experiments import Design, FigureNumber, Sweep, sweeps
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.schemas import Paradigms, Verdicts

NOUN = "paradigms"

#: Order of the rows of schema Paradigms.
SORTED = ("study", "figure", "game", "learner", "reading", "decay", "k", "runs", "seed")

#: Plots of a figure's points (schema Paradigms) as PNG, by name.
DrawPoints = Callable[[pl.DataFrame, FigureNumber], dict[str, bytes]]


class FigureReport(BaseModel):
    """Inputs of the report on a figure.

    Attributes:
        name: name of the output.
        figure: figure of the paper; 6 stands for Figures 6 and 7.
        sweeps: names of the sweeps.
    """

    name: str
    figure: FigureNumber
    sweeps: tuple[str, ...]


def reports(design: Design) -> list[FigureReport]:
    """Reports of a design, one for each figure."""
    suffix = "-quick" if design.quick else ""
    every = sweeps(design)
    return [
        FigureReport(name=f"report-{figure}-r{design.runs_of(figure)}-s{design.seed}{suffix}", figure=figure,
               sweeps=tuple(sweep.name for sweep in every if sweep.curves[0].figure == figure))
        for figure in design.figures
    ]


def sweeps_of(store: Store, report: FigureReport) -> list[Receipt]:
    """Receipts of a report's sweeps."""
    return [need(store, NOUN, name) for name in report.sweeps]


def points_of(store: Store, report: FigureReport) -> pl.DataFrame:
    """All points of a report's sweeps, schema Paradigms."""
    return pl.concat(
        table_of(store, receipt, Paradigms) for receipt in sweeps_of(store, report)
    ).sort(*SORTED)


def sweep_work(sweep: Sweep) -> Work:
    """A sweep as a piece of work."""
    return STAGES[NOUN].work(sweep.name, sweep, {})


def report_work(store: Store, report: FigureReport) -> Work:
    """A report as a piece of work.

    Raises:
        NotFound: if one of its sweeps has not been made.
    """
    return STAGES[NOUN].work(report.name, report, digests({NOUN: sweeps_of(store, report)}))


def make_sweep(data: Path, sweep: Sweep) -> None:
    """Play and store all points of a sweep's curves."""
    store = Store(data)
    with refusing(store, NOUN, sweep.name):
        points = [
            curve.play(k, decay, runs=sweep.runs, seed=sweep.seed)
            for curve in sweep.curves for k, decay in curve.points()
        ]
        table = pl.concat(points).sort(*SORTED)
        store.commit(sweep_work(sweep), Made(
            tables=[(table, Paradigms)], details={"diverged": int(table["diverged"].sum())}))


def make_report(data: Path, report: FigureReport, draw: DrawPoints) -> None:
    """Store the verdicts on a figure's claims, and its plots."""
    store = Store(data)
    with refusing(store, NOUN, report.name):
        points = points_of(store, report)
        store.commit(report_work(store, report), Made(
            tables=[(verdicts(points), Verdicts)],
            blobs={name: ("png", plot) for name, plot in draw(points, report.figure).items()},
        ))


def bring_curves_up_to_date(store: Store, design: Design, draw: DrawPoints) -> StageReport:
    """Play the missing curves of a design, then report on its figures."""
    every, data = sweeps(design), executors.get().path(store.root)
    todo = [sweep for sweep in every if store.holding(sweep_work(sweep)) is None]
    played = run_pieces(make_sweep, NOUN, {
        sweep.name: {"data": data, "sweep": sweep} for sweep in todo}, at_once=1)
    played.kept += len(every) - len(todo)
    for report in reports(design):
        if set(report.sweeps) & set(played.failed):
            continue
        if store.holding(report_work(store, report)) is None:
            arguments = {"data": data, "report": report, "draw": draw}
            played.add(run_pieces(make_report, NOUN, {report.name: arguments}, task="paradigms-report"))
        else:
            played.kept += 1
    return played
