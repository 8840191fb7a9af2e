"""Flow of the noun paradigms: one task for each sweep of curves, then one report for each figure."""

from pathlib import Path

import polars as pl
from pydantic import BaseModel

from flows.stage import (
    Made,
    Scope,
    Stage,
    conclude,
    data_folder,
    need,
    our_flow,
    run_each,
    task_of,
)
from pipeline.store import Store
from pipeline.store.receipts import Receipt
from pipeline.studies.paradigms.claims import PEAK, verdicts
from pipeline.studies.paradigms.experiments import STOCHASTIC, Design, FigureNumber, Sweep, sweeps
from pipeline.studies.paradigms.readings import informative
from pipeline.views.plots.paradigms import curves, sensitivity
from pipeline.views.plots.style import png
from schemas import Paradigms, Verdicts

#: The noun is not made from matches.
NOTHING = Scope(matches=(), lengths=())

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


def compute_sweep(_: Store, __: str, sweep: Sweep, ___: Scope) -> Made:
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


def compute_report(store: Store, _: str, report: FigureReport, __: Scope) -> Made:
    """Verdicts on a figure's claims, and plots."""
    points = points_of(store, report)
    drawn = points.filter(pl.col("study") == "figure")
    plots = {f"figure-{figure}": curves(drawn, figure, paper=PEAK)
             for figure in ((6, 7) if report.figure == 6 else (report.figure,))}
    for game in sorted(set(drawn["game"]) & set(STOCHASTIC)):
        plots[f"figure-5-{game.split()[0]}"] = curves(drawn, 5, game=game)
    if points["study"].eq("sensitivity").any():
        plots["sensitivity"] = sensitivity(informative(points))
    return Made(
        tables=[(verdicts(points), Verdicts)],
        blobs={name: ("png", png(figure)) for name, figure in plots.items()},
    )


SWEEPS = Stage("paradigms", (Paradigms,), lambda *_: [], compute_sweep)
make_sweep = task_of(SWEEPS)


@our_flow(name="paradigms")
def paradigms_flow(data: Path, design: Design = Design()) -> dict[str, object]:
    """Play the missing curves of a design, then report on its figures."""
    store = data_folder(data)
    played = run_each(make_sweep, SWEEPS, store, {sweep.name: sweep for sweep in sweeps(design)}, NOTHING)
    for report in reports(design):
        if not set(report.sweeps) & set(played.failed):
            stage = report_stage(report)
            written = run_each(task_of(stage), stage, store, {report.name: report}, NOTHING)
            played.made += written.made
            played.kept += written.kept
            played.failed |= written.failed
    return conclude(store, played)


def report_stage(report: FigureReport) -> Stage[FigureReport]:
    """Stage that makes a report from its sweeps."""
    return Stage("paradigms", (Verdicts,), lambda store, _, __: sweeps_of(store, report), compute_report)
