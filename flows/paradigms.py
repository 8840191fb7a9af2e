"""Flow of the noun paradigms: one task for each sweep of curves, then one report for each figure."""

from pathlib import Path

import polars as pl
from pydantic import BaseModel

from pitchlore.flows.jobs import run_pieces
from pitchlore.flows.tasks import conclude, data_folder, our_flow
from pitchlore.pipeline.engine.outputs import digests, need, refusing
from pitchlore.pipeline.engine.placement.crew import crew
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.paradigms.claims import PEAK, verdicts
from pitchlore.pipeline.paradigms.experiments import OTHER_GAMES, Design, FigureNumber, Sweep, sweeps
from pitchlore.pipeline.paradigms.readings import informative
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.store.work import Made, Work
from pitchlore.pipeline.views.plots.paradigms import curves, sensitivity
from pitchlore.pipeline.views.plots.style import png
from pitchlore.schemas import Paradigms, Verdicts

NOUN = "paradigms"

#: Order of the rows of schema Paradigms.
SORTED = ("study", "figure", "game", "learner", "reading", "decay", "k", "runs", "seed")


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


def compute_sweep(sweep: Sweep) -> Made:
    """All points of a sweep's curves."""
    points = [
        curve.play(k, decay, runs=sweep.runs, seed=sweep.seed)
        for curve in sweep.curves for k, decay in curve.points()
    ]
    table = pl.concat(points).sort(*SORTED)
    return Made(tables=[(table, Paradigms)], details={"diverged": int(table["diverged"].sum())})


def sweeps_of(store: Store, report: FigureReport) -> list[Receipt]:
    """Receipts of a report's sweeps."""
    return [need(store, "paradigms", name) for name in report.sweeps]


def points_of(store: Store, report: FigureReport) -> pl.DataFrame:
    """All points of a report's sweeps, schema Paradigms."""
    return pl.concat(
        store.read_table(receipt, "paradigms", Paradigms) for receipt in sweeps_of(store, report)
    ).sort(*SORTED)


def compute_report(store: Store, report: FigureReport) -> Made:
    """Verdicts on a figure's claims, and plots."""
    points = points_of(store, report)
    drawn = points.filter(pl.col("study") == "figure")
    plots = {f"figure-{figure}": curves(drawn, figure, paper=PEAK)
             for figure in ((6, 7) if report.figure == 6 else (report.figure,))}
    for game in sorted(set(drawn["game"]) & set(OTHER_GAMES)):
        plots[f"figure-5-{game.split()[0]}"] = curves(drawn, 5, game=game)
    if points["study"].eq("sensitivity").any():
        plots["sensitivity"] = sensitivity(informative(points))
    return Made(
        tables=[(verdicts(points), Verdicts)],
        blobs={name: ("png", png(figure)) for name, figure in plots.items()},
    )


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
    """Play a sweep's curves."""
    store = Store(data)
    with refusing(store, NOUN, sweep.name):
        store.commit(sweep_work(sweep), compute_sweep(sweep))


def make_report(data: Path, report: FigureReport) -> None:
    """Judge a figure's claims and draw its plots."""
    store = Store(data)
    with refusing(store, NOUN, report.name):
        store.commit(report_work(store, report), compute_report(store, report))


@our_flow(name="paradigms")
def paradigms_flow(data: Path, design: Design = Design(), on: str | None = None) -> dict[str, object]:
    """Play the missing curves of a design, then report on its figures."""
    store = data_folder(data)
    with placed(on, store.root):
        return conclude(store, _bring_up_to_date(store, design))


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
