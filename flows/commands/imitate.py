"""The command imitate: a team rebuilt from its recordings."""

from __future__ import annotations

import shlex
import sys

from pitchlore.flows.commands.common import DEFAULTS, Common, Flag, Json, On, UserPath
from pitchlore.flows.commands.printing import console, print_failed, print_json
from pitchlore.flows.commands.run import bring_up_to_date
from pitchlore.pipeline.engine.imitations import PREFIX, settings_of, work_of
from pitchlore.pipeline.engine.progress import RunReport


def imitate(
    team: str, /, *, settings: UserPath | None = None, flow: Flag = False, on: On = None, json: Json = False,
    common: Common = DEFAULTS,
) -> None:  # fmt: skip
    """Rebuild a team from its recordings, by poses alone.

    It plays as `imitated:TEAM` wherever a team is named. The imitation has a data folder of its own, in
    imitations/. Called again, it learns from new matches, too.

    Args:
        team: The team's name in its matches.
        settings: TOML file with the settings that differ from the defaults.
        flow: Run as a Prefect flow. Without a server the imitation's is started, and ends with the run.
        on: Where work is done.
        json: Print the report as JSON.
        common: Options of every command.
    """
    store, chosen = common.existing, common.settings(settings)
    work = work_of(store, team)
    report = bring_up_to_date(
        work.store, settings_of(chosen, team), chosen.imports, on=on or chosen.placement.on,
        history=chosen.history, as_flow=flow, recordings=work.recordings)
    if json:
        print_json(report.model_dump())
    else:
        where = "" if store.root == DEFAULTS.data else f" --data {store.where}"
        _print(report, team, len(work.recordings), where)
    sys.exit(1 if report.failures else 0)


def _print(report: RunReport, team: str, matches: int, where: str) -> None:
    print_failed(report.failures)
    out = console()
    for note in report.notes:
        out.print(note, soft_wrap=True, highlight=False, markup=False)
    if report.policy is not None:
        name = shlex.quote(f"{PREFIX}{team}")
        out.print(f"{PREFIX}{team} is rebuilt from {matches} of its matches "
                  f"(policy version {report.policy}, {'new' if report.policy_is_new else 'unchanged'}).",
                  soft_wrap=True)
        out.print(f"try: pitchlore evaluate --policy {name} --against static{where}", soft_wrap=True)
