"""Commands that make something: import, run, train, serve."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import polars as pl
from cyclopts import Parameter
from prefect.client.schemas.schedules import CronSchedule
from prefect.settings import PREFECT_API_URL
from pydantic import ValidationError

from flows.catalog import catalog_path, refresh
from flows.commands.common import (
    DEFAULTS,
    SURE_AND_GOOD,
    Common,
    Json,
    bars,
    console,
    print_frame,
    print_json,
    spelt,
)
from flows.matches import Recording, matches_flow, with_map
from flows.progress import RunReport, StageReport, listener
from flows.run import run_flow
from flows.tasks import FLOWS
from pipeline.errors import BadSettings, NotFound
from pipeline.importers.readers import FORMATS
from pipeline.store import Store
from schemas import Behaviours


def import_files(
    *files: Annotated[Path, Parameter(help=f"Recordings, plain or gzipped: {FORMATS}.")],
    mapping: Annotated[Path | None, Parameter(name="--map")] = None,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Import recordings of matches, as logs or tracking tables.

    Args:
        files: Recordings of any supported format.
        mapping: A TOML file that names a tracking table's columns, units, axes and teams; by default
            FILE.toml or map.toml beside the file, if there is one.
        json: Print the report as JSON.
        common: Options of every command.
    """
    if not files:
        raise NotFound("no file was named", next_step="Name one or more recordings: pitchlore import FILE…")
    recordings = [Recording(file=f, mapping=mapping) if mapping else with_map(f) for f in files]
    store = common.store
    with bars() as progress:
        listener.set(progress)
        report = StageReport.model_validate(matches_flow(store.root, recordings))
    refresh(store)
    if json:
        print_json(report.model_dump())
    else:
        _print_matches(store, report)
    sys.exit(1 if report.failed else 0)


def run(
    *,
    settings: Path | None = None,
    train: bool = True,
    json: Json = False,
    common: Common = DEFAULTS,
) -> None:
    """Bring every stage up to date with what is new: the inbox, all matches, knowledge, policy.

    Args:
        settings: A TOML file with the settings that differ from the defaults.
        train: Whether to train a policy when the knowledge is new.
        json: Print the report as JSON.
        common: Options of every command.
    """
    store, chosen = common.store, common.settings(settings)
    with bars() as progress:
        listener.set(progress)
        report = RunReport.model_validate(run_flow(store.root, None, chosen, train))
    if json:
        print_json(report.model_dump())
    else:
        _print_run(store, report)
    sys.exit(1 if report.failures else 0)


def train(*, settings: Path | None = None, json: Json = False, common: Common = DEFAULTS) -> None:
    """Train the next policy version on the newest knowledge.

    Args:
        settings: A TOML file with the settings that differ from the defaults.
        json: Print the report as JSON.
        common: Options of every command.
    """
    store, chosen = common.store, common.settings(settings)
    with bars() as progress:
        listener.set(progress)
        done = FLOWS["policies"](store.root, chosen)
    refresh(store)
    if json:
        print_json(done)
    elif done["new"]:
        console().print(f"policy version {done['version']} trained")
        _print_training(store)
    else:
        console().print(f"nothing to learn that policy version {done['version']} has not learned")


def serve(*, cron: str = "0 6 * * 1", settings: Path | None = None, common: Common = DEFAULTS) -> None:
    """Stay and run everything new on a schedule; needs a Prefect server (PREFECT_API_URL).

    Args:
        cron: When to run, as minute, hour, day of month, month, day of week.
        settings: A TOML file with the settings that differ from the defaults.
        common: Options of every command.
    """
    store, chosen = common.store, common.settings(settings)
    if not PREFECT_API_URL.value():
        raise BadSettings("no Prefect server is named", where="PREFECT_API_URL",
                          next_step="Start one with `prefect server start` and set it to its address")
    try:
        CronSchedule(cron=cron)
    except ValidationError as error:
        raise BadSettings(f"{cron!r} is not a schedule", where="--cron",
                          next_step='Write minute, hour, day, month and weekday, as "0 6 * * 1"') from error
    run_flow.serve(
        name="pitchlore", cron=cron,
        parameters={"data": str(store.root.resolve()), "settings": chosen.model_dump(mode="json")},
    )


def _print_matches(store: Store, report: StageReport) -> None:
    out = console()
    out.print(f"{len(report.made)} imported, {report.kept} already here, {len(report.failed)} not imported")
    rows = []
    for name in report.made:
        receipt = store.receipt("matches", name)
        assert receipt is not None
        flaws = receipt.details.get("flaws", {})
        rows.append({"match": name, "teams": f"{receipt.details['home']} - {receipt.details['away']}",
                     "s": receipt.details["duration_s"], "frames": receipt.details["frames"],
                     "complete": "yes" if receipt.details["complete"] else "no",
                     "flaws": ", ".join(flaw if n == receipt.details["frames"] else f"{flaw} {n}"
                                        for flaw, n in flaws.items())})
    if rows:
        print_frame(pl.DataFrame(rows))
    for name, why in report.failed.items():
        out.print(f"[bold red]quarantined[/] {name}: ", end="")
        out.print(why, markup=False, soft_wrap=True)


def _print_run(store: Store, report: RunReport) -> None:
    out = console()
    idle = not report.made and not report.failures
    if report.knowledge is not None and idle:
        out.print("Nothing new: every receipt holds, nothing was recomputed.")
    elif not idle:
        print_frame(pl.DataFrame(
            [{"stage": s.noun, "made": len(s.made), "kept": s.kept, "failed": len(s.failed)}
             for s in report.stages]
        ))
    for what, why in report.failures.items():
        out.print(f"[bold red]quarantined[/] {what}: ", end="")
        out.print(why, markup=False, soft_wrap=True)
    for note in report.stage("matches").notes:
        out.print(note, markup=False, soft_wrap=True)
    _print_quarantine(store, report)
    if report.knowledge is None:
        out.print(f"No match yet: drop recordings into {store.root / 'inbox'} or `pitchlore import` them.")
        return
    if not idle:
        _print_behaviours(store, report.knowledge)
        _print_rounds(store)
    new = {True: "new", False: "unchanged"}
    out.print(f"knowledge version {report.knowledge} ({new[report.knowledge_is_new]}): "
              f"{store.version_folder('knowledge', report.knowledge)}")
    if report.policy is not None:
        if not idle:
            _print_training(store)
        out.print(f"policy version {report.policy} ({new[report.policy_is_new]}): "
                  f"{store.version_folder('policies', report.policy)}")
    where = "" if store.root == DEFAULTS.data else f" --data {store.root}"
    out.print(f"catalogue: {catalog_path(store)} (try: pitchlore sql{where} \"from behaviours limit 20\")",
              soft_wrap=True)


def _print_quarantine(store: Store, report: RunReport) -> None:
    """What earlier runs could not take and this one did not try; what failed now has been said."""
    failures = report.failures
    refused = set(report.stage("matches").failed.values())  # there by file, in quarantine by match id
    left = [record for record in store.quarantined() if f"{record.noun} {record.name}" not in failures
            and not (record.noun == "matches" and record.reason in refused)]
    if left:
        out = console()
        out.print("[bold]still in quarantine[/]")
        for record in left:
            out.print(f"{record.noun} {record.name}: {record.reason}", markup=False, soft_wrap=True)


def _print_behaviours(store: Store, version: int) -> None:
    known = store.read_table(store.manifest("knowledge", version), "behaviours", Behaviours)
    best = known.sort(*SURE_AND_GOOD, descending=True).group_by("role", maintain_order=True).head(6)
    print_frame(best.select("behaviour_id", "support", "value", "spread", spelt("codes")),
                title=f"best of {known.height} behaviours, by value × √support")


def _print_rounds(store: Store) -> None:
    rows = []
    for receipt in store.receipts("behaviours"):
        report = receipt.details["report"]
        rows.append({"round": receipt.name, "distinct grams": report["distinct"],
                     "windows": report["windows"],
                     "neurons": len(report["activations"]), "kept neurons": report["neurons_kept"],
                     "behaviours": report["groups_kept"], "instances covered": report["instances_kept"]})
    print_frame(pl.DataFrame(rows).sort("round", descending=True), title="rounds")


def _print_training(store: Store) -> None:
    newest = store.latest("policies")
    assert newest is not None
    columns = ("pairs", "new_pairs", "decisions", "transitions", "first_error", "last_error")
    rows = [{"key": key, "role": role} | {c: counts[c] for c in columns}
            for key, roles in newest.details["tables"].items() for role, counts in roles.items()]
    if not rows:  # nothing is known yet: no match had a goal
        return
    print_frame(pl.DataFrame(rows).rename({c: c.replace("_", " ") for c in columns}),
                title=f"training of policy version {newest.version} (error: mean |TD error| of a sweep)")
