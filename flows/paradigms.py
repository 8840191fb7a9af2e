"""Flow of the noun paradigms: one task a sheet of curves, then one report a figure."""

from pathlib import Path

import polars as pl
from pydantic import BaseModel

from flows.stage import digests, need, refusing
from flows.stages import STAGES
from flows.tasks import conclude, data_folder, our_flow, run_tasks, stage_task
from pipeline.store import Store
from pipeline.store.receipts import Receipt
from pipeline.store.work import Made, Work
from pipeline.studies.paradigms.claims import PEAK, verdicts
from pipeline.studies.paradigms.experiments import STOCHASTIC, Design, Figure, Sheet, sheets
from pipeline.studies.paradigms.readings import telling
from pipeline.views.plots.paradigms import curves, sensitivity
from pipeline.views.plots.style import png
from schemas import Paradigms, Verdicts

NOUN = "paradigms"

#: The order of schema Paradigms.
SORTED = ("study", "figure", "game", "learner", "reading", "decay", "k", "runs", "seed")


class Report(BaseModel):
    """What a report on a figure is made of.

    Attributes:
        name: of the output.
        figure: of the paper; 6 stands for Figures 6 and 7.
        sheets: names of the sheets.
    """

    name: str
    figure: Figure
    sheets: tuple[str, ...]


def reports(design: Design) -> list[Report]:
    """The reports of a design, one a figure."""
    suffix = "-quick" if design.quick else ""
    every = sheets(design)
    return [
        Report(name=f"report-{figure}-r{design.runs_of(figure)}-s{design.seed}{suffix}", figure=figure,
               sheets=tuple(sheet.name for sheet in every if sheet.curves[0].figure == figure))
        for figure in design.figures
    ]


def compute_sheet(sheet: Sheet) -> Made:
    """All points of a sheet's curves."""
    points = [
        curve.play(k, decay, runs=sheet.runs, seed=sheet.seed)
        for curve in sheet.curves for k, decay in curve.points()
    ]
    table = pl.concat(points).sort(*SORTED)
    return Made(tables=[(table, Paradigms)], details={"diverged": int(table["diverged"].sum())})


def sheets_of(store: Store, report: Report) -> list[Receipt]:
    """The receipts of a report's sheets."""
    return [need(store, "paradigms", name) for name in report.sheets]


def points_of(store: Store, report: Report) -> pl.DataFrame:
    """All points of a report's sheets, schema Paradigms."""
    return pl.concat(
        store.read_table(receipt, "paradigms", Paradigms) for receipt in sheets_of(store, report)
    ).sort(*SORTED)


def compute_report(store: Store, report: Report) -> Made:
    """Verdicts on a figure's claims, and its plots."""
    points = points_of(store, report)
    drawn = points.filter(pl.col("study") == "figure")
    plots = {f"figure-{figure}": curves(drawn, figure, paper=PEAK)
             for figure in ((6, 7) if report.figure == 6 else (report.figure,))}
    for game in sorted(set(drawn["game"]) & set(STOCHASTIC)):
        plots[f"figure-5-{game.split()[0]}"] = curves(drawn, 5, game=game)
    if points["study"].eq("sensitivity").any():
        plots["sensitivity"] = sensitivity(telling(points))
    return Made(
        tables=[(verdicts(points), Verdicts)],
        blobs={name: ("png", png(figure)) for name, figure in plots.items()},
    )


def sheet_work(sheet: Sheet) -> Work:
    """A sheet as a piece of work."""
    return STAGES[NOUN].work(sheet.name, sheet, {})


def report_work(store: Store, report: Report) -> Work:
    """A report as a piece of work.

    Raises:
        NotFound: if one of its sheets has not been made.
    """
    return STAGES[NOUN].work(report.name, report, digests({NOUN: sheets_of(store, report)}))


@stage_task(name="paradigms")
def make_sheet(data: Path, name: str, sheet: Sheet) -> None:
    """Play a sheet's curves."""
    store = Store(data)
    with refusing(store, NOUN, name):
        store.commit(sheet_work(sheet), compute_sheet(sheet))


@stage_task(name="paradigms-report")
def make_report(data: Path, name: str, report: Report) -> None:
    """Judge a figure's claims and draw its plots."""
    store = Store(data)
    with refusing(store, NOUN, name):
        store.commit(report_work(store, report), compute_report(store, report))


@our_flow(name="paradigms")
def paradigms_flow(data: Path, design: Design = Design()) -> dict[str, object]:
    """Play the curves of a design that are not there yet, then report on its figures."""
    store = data_folder(data)
    every = sheets(design)
    todo = [sheet for sheet in every if store.holding(sheet_work(sheet)) is None]
    played = run_tasks(make_sheet, NOUN, {
        sheet.name: {"data": store.root, "name": sheet.name, "sheet": sheet} for sheet in todo})
    played.kept += len(every) - len(todo)
    for report in reports(design):
        if set(report.sheets) & set(played.failed):
            continue
        if store.holding(report_work(store, report)) is None:
            arguments = {"data": store.root, "name": report.name, "report": report}
            played.add(run_tasks(make_report, NOUN, {report.name: arguments}))
        else:
            played.kept += 1
    return conclude(store, played)
