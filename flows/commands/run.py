"""The command run: every stage brought up to date."""

from __future__ import annotations

import shlex
import sys
from typing import TYPE_CHECKING, Annotated, Literal

import polars as pl
from cyclopts import Parameter

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json, On, RunFile, UserPath
from pitchlore.flows.commands.performing import perform
from pitchlore.flows.commands.printing import (
    console,
    print_cards,
    print_failed,
    print_frame,
    print_json,
    print_training,
    spelt,
)
from pitchlore.pipeline.base.errors import BadSettings, NotFound
from pitchlore.pipeline.base.text import number_of
from pitchlore.pipeline.engine.catalog import catalog_path
from pitchlore.pipeline.engine.knowledge import imitates, of_imitated
from pitchlore.pipeline.engine.placement.places import place_of
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.engine.stage import ALL
from pitchlore.pipeline.engine.versions import WITHOUT
from pitchlore.pipeline.game.pitch import Kind
from pitchlore.pipeline.settings import HistorySettings, ImportSettings, RunSettings, ScoutSettings, Settings
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Behaviours
from pitchlore.schemas.behaviours import SHOWN_FROM, for_people

if TYPE_CHECKING:
    from pitchlore.pipeline.engine.recordings import Recording


def run(
    *,
    settings: RunFile = None,
    kind: Literal["vsss", "ssl", "2d", "human"] | None = None,
    team: Annotated[tuple[str, ...], Parameter(negative=())] = (),
    train: bool = True,
    isolate: Flag = False,
    flow: Flag = False,
    verbose: Flag = False,
    plan: Flag = False,
    page: UserPath | None = None,
    on: On = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Bring everything up to date: import the inbox, run every stage, emit knowledge, train a policy.

    Args:
        settings: Named settings or a TOML file.
        kind: League that counts for the knowledge (default: what the settings say, else all, each by itself).
        team: Team or pool that counts for the knowledge; may be given several times (default: what the
            settings say, else all).
        train: Train a policy when the knowledge is new.
        isolate: Read each recording in a process of its own, with limits on its time and memory.
        flow: Run as a Prefect flow. Without a server the data folder's is started, and ends with the run.
        verbose: Also print the tables of stages, behaviours, rounds and training.
        plan: Change nothing: print which outputs would be made, why, and what they would cost by the log.
        page: With --plan: also write a web page with the graph of stages to this file.
        on: Where work is done.
        json: Print the report as JSON, or the plan.
        common: Options of every command.
    """
    chosen = _restricted(common.settings(settings), kind, team)
    if page is not None and not plan:
        raise BadSettings("a page is of a plan", where="--page", next_step="Say --plan, too")
    store = common.store
    if store.mirror is None:  # a bucket may have an inbox and nothing else yet
        store = common.existing
    if plan:
        from pitchlore.flows.commands.planned import print_plan  # noqa: PLC0415 (it loads the importers)

        print_plan(store, chosen, train=train, json=json, page=page)
        return
    limits = chosen.imports.isolated() if isolate else chosen.imports
    report = bring_up_to_date(
        store, chosen, limits, train=train, on=on or chosen.placement.on, history=chosen.history,
        scout=chosen.scout, as_flow=flow)
    if json:
        print_json(report.model_dump())
    else:
        _print_run(store, report, chosen.scout.mine, verbose=verbose)
    sys.exit(1 if report.failures else 0)


def _restricted(settings: RunSettings, kind: str | None, team: tuple[str, ...]) -> RunSettings:
    """Settings by which only a league, or only some teams, count for the knowledge."""
    asked = {name: value for name, value in (("kind", kind and Kind(kind)), ("teams", team)) if value}
    return settings.model_copy(update={"sides": settings.sides.model_copy(update=asked)})


def bring_up_to_date(
    store: Store, settings: Settings, limits: ImportSettings = ImportSettings(), *, train: bool = True,
    on: str | None = None, history: HistorySettings = HistorySettings(),
    scout: ScoutSettings = ScoutSettings(), as_flow: bool = False, recordings: list[Recording] | None = None,
) -> RunReport:
    """Run all stages, on the recordings of the inbox if none are given."""
    place_of(on)  # so that a word that names none is refused at once
    from pitchlore.flows import work  # noqa: PLC0415 (it loads numba, which --help does without)

    return perform(store, "run_flow", RunReport, work.run, as_flow=as_flow)(
        store.root, recordings, settings, train, limits, on, history, scout)


def _print_run(store: Store, report: RunReport, mine: str, *, verbose: bool) -> None:
    out = console()
    idle = not report.made and not report.failures
    if report.knowledge is not None and idle:
        again = sum(len(stage.same) for stage in report.stages)
        out.print(f"Nothing new. Outputs made again, with the same bytes: {again}." if again
                  else "Nothing new: every receipt holds, nothing was recomputed.")
    elif not idle and verbose:
        print_frame(pl.DataFrame(
            [{"stage": s.noun, "made": len(s.made), "kept": s.unchanged, "failed": len(s.failed)}
             for s in report.stages]
        ))
    elif not idle:
        kept = sum(stage.unchanged for stage in report.stages)
        made = number_of(report.made, "output")
        out.print(f"{made} made, {kept:,} kept, {len(report.failures):,} failed (--verbose: stage by stage)")
    print_failed(report.failures)
    for note in (*report.stage("matches").notes, *report.notes):
        out.print(note, soft_wrap=True, highlight=False, markup=False)
    _print_quarantine(store, report)
    if report.knowledge is None and report.failures:
        return
    if report.knowledge is None:
        if not report.notes:
            out.print(f"No match yet: drop recordings into {store.where}/inbox or `pitchlore import` them.")
        return
    if not idle and verbose:
        _print_behaviours(store, report.knowledge)
        _print_rounds(store)
    new = {True: "new", False: "unchanged"}
    out.print(f"knowledge version {report.knowledge} ({new[report.knowledge_is_new]}): "
              f"{store.named(store.version_folder('knowledge', report.knowledge))}{_lack(store, report)}",
              soft_wrap=True)
    if report.policy is not None:
        if not idle:
            print_training(store, tables=verbose)
        out.print(f"policy version {report.policy} ({new[report.policy_is_new]}): "
                  f"{store.named(store.version_folder('policies', report.policy))}")
    if store.mirror is None:
        _print_answer(store, report, mine)
    where = "" if store.root == DEFAULTS.data else f" --data {store.where}"
    there = f"catalogue: {catalog_path(store)}" if store.mirror is None else "catalogue: made when you ask"
    out.print(f"{there} (try: pitchlore sql{where} \"from behaviours limit 20\")", soft_wrap=True)


def _print_answer(store: Store, report: RunReport, mine: str) -> None:
    """Print what went with winning and losing, and the names of the teams that it leaves out."""
    from pitchlore.pipeline.views.card import answer  # noqa: PLC0415 (it loads what --help does without)

    refreshed = "catalogue catalog.duckdb" not in report.failures
    try:
        said = answer(store, mine, refreshed=refreshed)
    except NotFound as error:
        if str(error) not in report.failures.values():  # else it is printed
            raise
        return
    if not said.new:
        console().print("As before:")
    print_cards(said.cards)
    if said.others[0]:
        names, more = said.others
        rest = f" and {number_of(more, 'other')}" if more else ""
        call = f"`pitchlore scout --mine {shlex.quote(names[0])}`"
        console().print(f"Other teams: {', '.join(names)}{rest}. {call}", soft_wrap=True, highlight=False)


def _lack(store: Store, report: RunReport) -> str:
    """The matches and versions that the newest knowledge was made without, as the end of its line."""
    assert report.knowledge is not None
    without = store.manifest("knowledge", report.knowledge).details.get(WITHOUT, ())
    return f", made without {', '.join(without)}" if without else ""


def _print_quarantine(store: Store, report: RunReport) -> None:
    """Print what is in quarantine from earlier runs. Failures of this run are already printed."""
    failures = report.failures
    refused = set(report.stage("matches").failed.values())  # there by file, in quarantine by match id
    left = [record for record in store.quarantined() if f"{record.noun} {record.name}" not in failures
            and not (record.noun == "matches" and record.reason in refused)]
    if left:
        out = console()
        out.print("still in quarantine", style="bold")
        for record in left:
            out.print(f"{record.noun} {record.name}: {record.reason}", soft_wrap=True)


def _print_behaviours(store: Store, version: int) -> None:
    knowledge = store.manifest("knowledge", version)
    known, learner = store.read_table(knowledge, "behaviours", Behaviours), imitates(knowledge)
    shown = of_imitated(knowledge, known)
    whose = "" if learner is None else f" of {learner.team} ({learner.kind}), which policies imitate"
    often = for_people(shown.filter(pl.col("support") >= SHOWN_FROM))
    if often.is_empty():
        console().print(f"no behaviour{whose} was seen {SHOWN_FROM} times; see pitchlore kb show --support 1")
    best = often.group_by("role", better=pl.col("value") > 0, maintain_order=True).head(4)
    if best.height:
        print_frame(best.select("behaviour_id", "support", "value", "low", "high", "pays", spelt("codes")),
                    title=f"first of {often.height} behaviours{whose}, by what V changed with them in all "
                          f"(seen {SHOWN_FROM} times or more)")
    if known.height > shown.height:
        console().print(f"behaviours of other teams: {known.height - shown.height}; see pitchlore kb show")


def _print_rounds(store: Store) -> None:
    selected, rows = store.readable("behaviours", ALL), []
    if selected is not None:
        rows = [{"n": report["n"], "team": report["team"], "kind": report["kind"],
                  "distinct grams": report["distinct"], "windows": report["windows"],
                  "neurons": len(report["activations"]), "kept neurons": report["neurons_kept"],
                  "behaviours": report["groups_kept"], "instances covered": report["instances_kept"]}
                 for report in selected.details.get("reports", ())]
    if rows:
        print_frame(pl.DataFrame(rows).sort("team", "kind", "n", descending=[False, False, True]),
                    title="rounds")
