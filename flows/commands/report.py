"""The command report: results of all seasons beside those of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import polars as pl

from pitchlore.flows.commands.common import DEFAULTS, Common, Json, On, UserPath
from pitchlore.flows.commands.performing import perform
from pitchlore.flows.commands.printing import console, print_frame, print_json, print_stand_in
from pitchlore.flows.reporting import Reported
from pitchlore.flows.reporting import report as make_report
from pitchlore.pipeline.engine.catalog import renew
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.placement.places import place_of
from pitchlore.pipeline.stages.report.claims import BEST, LEAST_SEASONS, PAPER
from pitchlore.pipeline.stages.report.kickoffs import kick_offs
from pitchlore.pipeline.stages.report.preferences import side_by_side
from pitchlore.pipeline.stages.report.sensitivity import sensitivity, varied_settings
from pitchlore.pipeline.stages.report.summary import ablated, measured, seasons_played, settings_compared
from pitchlore.pipeline.stages.report.table3 import GAMES
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.pipeline.views.report import NAME, damaged, sources, tables
from pitchlore.schemas import Claims, note_on


def report(
    *, on: On = None, export: UserPath | None = None, json: Json = False, common: Common = DEFAULTS
) -> None:
    """Report on all seasons: Table 3 and Figures 8 to 10 beside the paper's, claims with verdicts, plots.

    Args:
        on: Where the report is made.
        export: Also write the tables, the plots and the report as Markdown into this folder.
        json: Print the games, the claims, the comparison of settings, the evaluations and the preferences
            as JSON.
        common: Options of every command.
    """
    place_of(on)  # so that a word that names none is refused at once
    store = common.existing
    for noun in ("seasons", "evaluations"):
        for error in store.unreadable_receipts(noun).values():
            store.go_on_without(error)
    for file in damaged(store):
        store.go_on_without(file.error)
    page = perform(store, "report_flow", Reported, make_report)(store.root, on).page
    games, growth, evaluations, left_out, prefer = tables(store, sources(store))
    receipt = store.receipt("report", NAME)
    assert receipt is not None
    claims = table_of(store, receipt, Claims)
    if json:
        print_json({"page": str(page), "played": seasons_played(games).to_dicts(),
                    "claims": claims.to_dicts(),
                    "compared": _compared(games).to_dicts(), "ablated": _changes(games).to_dicts(),
                    "kick_offs": kick_offs(games).to_dicts(),
                    "sensitivity": sensitivity(games, growth, PAPER).to_dicts(),
                    "measured": measured(games, evaluations).to_dicts(), "left_out": left_out,
                    "preferences": prefer.to_dicts(), "note": note_on(*games["opponent"].unique())})
    else:
        print_frame(seasons_played(games), title="what was played")
        print_frame(_intervals(_compared(games), ("settings", "opponent", "seasons")),
                    title="settings beside each other (last games, 95 %)")
        if (changes := _changes(games)).height:
            print_frame(_intervals(changes, ("settings", "base", "opponent", "last")),
                        title="effect of each change (last games minus those of the base, 95 %)")
        if evaluations.height:
            print_frame(_intervals(measured(games, evaluations), (
                "settings", "opponent", "games", "against", "seasons", "matches")),
                title="evaluations of the apprentices and of constant teams (95 %)")
        if prefer.height:
            print_frame(side_by_side(prefer), title="preferred behaviours of the best apprentices")
        if left_out:
            console().print(f"{left_out} pairs of matches of apprentices are left out; the page says why.")
        print_frame(_shown(claims), title="claims and measurements")
        print_stand_in(*games["opponent"].unique())
        if "not judged" in claims["verdict"]:
            console().print(f"not judged: fewer than {LEAST_SEASONS} seasons of {GAMES} games; the page says"
                            " what the other verdicts mean.")
        console().print(f"page: {page}", soft_wrap=True)
    if export:
        _export(store, receipt, {"games": games, "growth": growth, "evaluations": evaluations,
                                 "claims": claims, "preferences": prefer,
                                 "kick-offs": kick_offs(games),
                                 "sensitivity": sensitivity(games, growth, PAPER)}, export)
        if not json:
            console().print(f"{export}: written", soft_wrap=True)
    renew(store)


def _interval(of: str, low: str, high: str) -> pl.Expr:
    """A number with its 95 % interval, for people; the number alone where there is none."""
    ends = [pl.col(name).round(2).cast(pl.String) for name in (of, low, high)]
    return pl.coalesce(pl.format("{} [{}, {}]", *ends), ends[0]).alias(of)


def _intervals(rows: pl.DataFrame, first: tuple[str, ...]) -> pl.DataFrame:
    """Columns as they are, then what was measured with its interval."""
    names = ("difference", "other", "brief", "won", "lost")
    return rows.select(*first, *(_interval(name, f"{name}_low", f"{name}_high")
                                 for name in names if name in rows.columns))


def _compared(games: pl.DataFrame) -> pl.DataFrame:
    return settings_compared(games.filter(~varied_settings()))


def _changes(games: pl.DataFrame) -> pl.DataFrame:
    return ablated(games.filter(~varied_settings()), (PAPER, BEST))


def _shown(claims: pl.DataFrame) -> pl.DataFrame:
    return claims.select("item", "claim", "quantity", "opponent", "stated", "table_3",
                         _interval("measured", "low", "high"), "seasons", "verdict")


def _export(
    store: Store, receipt: Receipt, tables: Mapping[str, pl.DataFrame], folder: Path
) -> None:
    """Write tables as CSV, plots as PNG, the report as Markdown: small, readable, to be kept in git."""
    for name, table in tables.items():
        store.write_bytes(folder / f"{name}.csv", table.write_csv(float_precision=4).encode())
    for role, record in receipt.files.items():
        if record.path.endswith(".png"):
            store.write_bytes(folder / f"{role}.png", store.read(receipt, role))
    store.write_bytes(folder / "README.md", store.read(receipt, "text"))
