"""The command report: what all seasons show, beside what the paper says of its own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import polars as pl

from flows.commands.common import DEFAULTS, Common, Json, console, print_frame, print_json, warn
from flows.report import tables, write_report
from pipeline.receipts import Receipt
from pipeline.seasons.summary import compared, played
from pipeline.store import Store
from schemas import Claims


def report(*, export: Path | None = None, json: Json = False, common: Common = DEFAULTS) -> None:
    """Report on all seasons: Table 3 and Figures 8 to 10 beside the paper's, claims with verdicts, plots.

    Args:
        export: Write tables, plots and the report as Markdown into this folder, too.
        json: Print what was played, the claims and the settings beside each other as JSON.
        common: Options of every command.
    """
    store = common.store
    for name, why in store.unreadable_receipts("seasons").items():
        warn(f"season {name} is left out: {why}")
    receipt, page = write_report(store)
    games, growth = tables(store)
    claims = store.read_table(receipt, "claims", Claims)
    if json:
        print_json({"page": str(page), "played": played(games).to_dicts(), "claims": claims.to_dicts(),
                    "compared": compared(games).to_dicts()})
    else:
        print_frame(played(games), title="what was played")
        print_frame(_side_by_side(compared(games)), title="settings beside each other (last games, 95 %)")
        print_frame(_shown(claims), title="what is claimed, and what is seen")
        console().print(f"page: {page}", soft_wrap=True)
    if export:
        _export(store, receipt, {"games": games, "growth": growth, "claims": claims}, export)
        if not json:
            console().print(f"{export}: written", soft_wrap=True)


def _interval(of: str, low: str, high: str) -> pl.Expr:
    """A number with its 95 % interval, for people; the number alone where there is none."""
    ends = [pl.col(name).round(2).cast(pl.String) for name in (of, low, high)]
    return pl.coalesce(pl.format("{} [{}, {}]", *ends), ends[0]).alias(of)


def _side_by_side(rows: pl.DataFrame) -> pl.DataFrame:
    return rows.select("settings", "opponent", "seasons", *(
        _interval(name, f"{name}_low", f"{name}_high") for name in ("difference", "other", "won", "lost")))


def _shown(claims: pl.DataFrame) -> pl.DataFrame:
    return claims.select("item", "claim", "opponent", "stated", "table_3",
                         _interval("measured", "low", "high"), "seasons", "verdict")


def _export(
    store: Store, receipt: Receipt, tables: Mapping[str, pl.DataFrame], folder: Path
) -> None:
    """Tables as CSV, plots as PNG, the report as Markdown: small and readable, to be kept in git."""
    for name, table in tables.items():
        store.write_bytes(folder / f"{name}.csv", table.write_csv(float_precision=4).encode())
    for role, record in receipt.files.items():
        if record.path.endswith(".png"):
            store.write_bytes(folder / f"{role}.png", store.read(receipt, role))
    store.write_bytes(folder / "README.md", store.read(receipt, "text"))
