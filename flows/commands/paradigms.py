"""The command paradigms: section 5 of the paper, played again."""

from __future__ import annotations

import json as encoder
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

import polars as pl
from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json, On, UserPath
from pitchlore.flows.commands.performing import perform
from pitchlore.flows.commands.playing import Many, Seed
from pitchlore.flows.commands.printing import console, print_frame, print_json, warn
from pitchlore.flows.paradigms import play_paradigms
from pitchlore.pipeline.engine.outputs import need, table_of
from pitchlore.pipeline.engine.paradigms import FigureReport, points_of, reports
from pitchlore.pipeline.engine.placement.places import place_of
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.numbers.statistics import wilson
from pitchlore.pipeline.stages.paradigms.claims import PEAK
from pitchlore.pipeline.stages.paradigms.experiments import (
    COMPARED,
    LEARNERS,
    Beside,
    Design,
    FigureNumber,
    sweeps,
)
from pitchlore.pipeline.stages.paradigms.measures import PRINTED, fresh_leads
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Verdicts

FigureName = Literal["4", "5", "6", "7"]

#: Column: the share of trainings that ended in any pure equilibrium of a matrix game.
EQUILIBRIUM = "any equilibrium"

#: Runs of a quick look.
QUICK_RUNS = 20

#: Figure 7 shows the runs of Figure 6.
POINTS: dict[FigureName, FigureNumber] = {"4": 4, "5": 5, "6": 6, "7": 6}


def paradigms(
    *,
    figure: Annotated[tuple[FigureName, ...], Parameter(negative=(), show_default=False)] = (),
    runs: Many | None = None,
    quick: Flag = False,
    sensitivity: Flag = False,
    comparison: Flag = False,
    beside: Annotated[tuple[Beside, ...], Parameter(negative=(), show_default=False)] = (),
    seed: Seed = 0,
    on: On = None,
    export: UserPath | None = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Play the paper's three games with its learners and with others, and judge its claims.

    Args:
        figure: Figure of the paper; may be repeated (default: all). Figures 6 and 7 show the same runs.
        runs: Number of independent trainings per point (default: the paper's 100, and 3 in the grid world).
        quick: Play only a few points of each curve, with 20 runs. This takes seconds.
        sensitivity: Also play every reading of the paper's open details, and confirm the best ones.
        comparison: Also play printed IVQ and IQ on fresh seeds, 4,000 runs each, at the paper's best decay of
            Figure 5, and say how much likelier IVQ reaches the optimum.
        beside: Learner to play and draw beside those of the figures: team, one learner that commands all
            agents (section 2.3.1); may be repeated.
        seed: Seed of the runs.
        on: Where the curves are played.
        export: Also write tables, plots and settings into this folder.
        json: Print points and verdicts as JSON.
        common: Options of every command.
    """
    design = Design(
        figures=tuple(sorted({POINTS[name] for name in figure or POINTS})),
        runs=runs or (QUICK_RUNS if quick else None), quick=quick, sensitivity=sensitivity,
        comparison=comparison, beside=beside, seed=seed,
    )
    store = common.store
    place_of(on)  # so that a word that names none is refused at once
    done = perform(store, "paradigms_flow", StageReport, play_paradigms)(store.root, design, on)
    reported = [report for report in reports(design) if not {report.name, *report.sweeps} & set(done.failed)]
    if json:
        print_json([{"figure": report.figure, "points": points_of(store, report).to_dicts(),
                     "verdicts": _verdicts(store, report).to_dicts(), "leads": list(_leads(store, report))}
                    for report in reported])
    for report in reported:
        if not json:
            _print(store, report)
        if export:
            _export(store, report, design, export)
    for what, why in done.failed.items():
        warn(f"{what}: {why}")
    sys.exit(1 if done.failed else 0)


def _verdicts(store: Store, report: FigureReport) -> pl.DataFrame:
    receipt = need(store, "paradigms", report.name)
    return table_of(store, receipt, Verdicts)


def _print(store: Store, report: FigureReport) -> None:
    """Print a figure for people: its curves in few numbers, its claims, and the paths of its plots."""
    points = points_of(store, report).sort(pl.col("learner").cast(pl.Enum(LEARNERS)), maintain_order=True)
    name = "Figures 6 and 7" if report.figure == 6 else f"Figure {report.figure}"
    shown = points.filter(pl.col("study") == "figure")
    for (game,), curves in shown.partition_by("game", as_dict=True, maintain_order=True).items():
        print_frame(_climb(curves) if report.figure == 5 else _means(curves),
                    title=f"{name}: {game}, {curves['runs'][0]} trainings a point")
    for study, title, each in (("confirmation", "on fresh seeds", 9), ("sensitivity", "best readings", 3),
                               ("comparison", "on further fresh seeds", 1)):
        tried = points.filter(pl.col("study") == study)
        if tried.height:
            best = tried.sort("p_optimal", descending=True).group_by("learner").head(each).sort(
                pl.col("learner").cast(pl.Enum(LEARNERS)), maintain_order=True)
            print_frame(_with_equilibria(best).select(
                "learner", "reading", "k", "decay", "runs", _interval("p_optimal"), EQUILIBRIUM),
                title=f"{name}: {title} ({tried.height} points)")
    for lead in _leads(store, report):
        console().print(
            f"{lead['learner']} less {lead['other']}, {lead['runs']:,} trainings each, seed {lead['seed']}: "
            f"{lead['difference']:.4f} [{lead['low']:.4f}, {lead['high']:.4f}]")
    print_frame(_judged(_verdicts(store, report)), title=f"{name}: what the paper claims (details: verdicts)")
    receipt = need(store, "paradigms", report.name)
    for role, record in receipt.files.items():
        console().print(f"{role}: {store.named(store.root / record.path)}", soft_wrap=True)


def _judged(verdicts: pl.DataFrame) -> pl.DataFrame:
    """A row for each claim and line-up, its decays side by side.

    Of the line-ups those where all learners are read alike, or only IVQ not as printed.
    """
    alike = ~pl.col("reading").str.contains("; ", literal=True)
    printed = pl.col("reading").str.split("; ").list.eval(
        pl.element().str.ends_with(PRINTED) | pl.element().str.starts_with("IVQ ")).list.all()
    usual = verdicts.filter(alike | printed)
    verdict, decay = (pl.col(name).cast(pl.String) for name in ("verdict", "decay"))
    numbers = pl.col("measured").round(3).cast(pl.String).fill_null("–").str.join(" | ")
    rows = usual.group_by("claim", "quantity", "paper", "reading", maintain_order=True).agg(
        decay.drop_nulls().str.join(" | ").alias("at decay"),
        pl.when(pl.len() == 1).then(_interval("measured", "low", "high").first()).otherwise(numbers)
        .alias("measured"),
        pl.when(verdict.n_unique() == 1).then(verdict.first()).otherwise(verdict.str.join(" | "))
        .alias("verdict"),
    )
    return rows.select("claim", "reading", "paper", "at decay", "measured", "verdict")


def _interval(of: str, low: str = "p_low", high: str = "p_high") -> pl.Expr:
    """A number with its 95 % interval, for people."""
    ends = [pl.col(name).round(4).cast(pl.String) for name in (of, low, high)]
    return pl.format("{} [{}, {}]", *ends).alias(of)


def _leads(store: Store, report: FigureReport) -> Iterator[dict[str, object]]:
    """Differences of the compared learners on fresh seeds."""
    return fresh_leads(points_of(store, report), *COMPARED)


def _with_equilibria(points: pl.DataFrame) -> pl.DataFrame:
    """Points with a column of text: the share that ended in any equilibrium, with its interval."""
    texts = []
    for p, runs in points.select("p_equilibrium", "runs").iter_rows():
        low, high = (None, None) if p is None else wilson(p * runs, runs)
        texts.append("" if p is None else f"{p:.4g} [{low:.4g}, {high:.4g}]")
    return points.with_columns(pl.Series(EQUILIBRIUM, texts, dtype=pl.String))


def _climb(curves: pl.DataFrame) -> pl.DataFrame:
    """Figure 5 in few numbers: at the paper's best decay, and at the learner's own."""
    key = ["learner", "reading"]
    curves = _with_equilibria(curves)
    there = curves.filter(pl.col("decay") == PEAK.decay)
    best = curves.sort("p_optimal", descending=True).group_by(key, maintain_order=True).first()
    own = best.select(*key, pl.col("decay").alias("best decay"), _interval("p_optimal").alias("P there"),
                      "diverged")
    at_peak = there.select(*key, _interval("p_optimal").alias(f"P(optimal) at {PEAK.decay}"),
                           pl.col(EQUILIBRIUM).alias(f"{EQUILIBRIUM} at {PEAK.decay}"))
    return at_peak.join(own, on=key, maintain_order="left")


def _means(curves: pl.DataFrame) -> pl.DataFrame:
    """Figures over k in few numbers: the mean over k at each decay, and of the path's length."""
    other = {"steps": pl.col("path_length").mean().round(1)}
    if curves["game"][0] != "grid":
        other = {EQUILIBRIUM: pl.col("p_equilibrium").mean().round(3)}
    wide = curves.group_by("learner", "reading", "decay", maintain_order=True).agg(
        P=pl.col("p_optimal").mean().round(3), **other
    ).pivot("decay", index=["learner", "reading"], values=["P", *other], separator=" at ")
    return wide.select(column for column in wide.columns if wide[column].is_not_null().any())


def _export(store: Store, report: FigureReport, design: Design, folder: Path) -> None:
    """Write tables as CSV, plots as PNG, settings as JSON: small, readable, to be kept in git."""
    receipt = need(store, "paradigms", report.name)
    runs = report.name.removeprefix(f"report-{report.figure}-").removesuffix("-s0")
    stem = f"figure-{report.figure}-{runs}"
    for (study,), rows in points_of(store, report).partition_by("study", as_dict=True).items():
        kind = "points" if study == "figure" else str(study)
        text = rows.drop("study").write_csv(float_precision=4)
        store.write_bytes(folder / f"{stem}.{kind}.csv", text.encode())
    leads = list(_leads(store, report))
    if leads:
        text = pl.DataFrame(leads).write_csv(float_precision=4)
        store.write_bytes(folder / f"{stem}.leads.csv", text.encode())
    judged = _verdicts(store, report).write_csv(float_precision=4)
    store.write_bytes(folder / f"{stem}.verdicts.csv", judged.encode())
    for role in sorted(set(receipt.files) - {"verdicts"}):
        figure, _, game = role.removeprefix("figure-").partition("-")
        plot = f"figure-{figure}-{runs}{game and f'.{game}'}" if figure.isdigit() else f"{stem}.{role}"
        store.write_bytes(folder / f"{plot}.png", store.read(receipt, role))
    curves = [curve for sweep in sweeps(design) if sweep.name in report.sweeps for curve in sweep.curves]
    lines = [{"design": design.model_dump(mode="json"), "software": receipt.software}]
    lines += [curve.model_dump(mode="json", exclude_defaults=True) for curve in curves]
    text = "\n".join(encoder.dumps(line, sort_keys=True) for line in lines)
    store.write_bytes(folder / f"{stem}.settings.jsonl", f"{text}\n".encode())
    console().print(f"{folder}: {stem} written", soft_wrap=True)
