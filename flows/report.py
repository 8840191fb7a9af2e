"""The report on all seasons that were played: claims with verdicts, plots, one page."""

from collections.abc import Iterable
from pathlib import Path

import polars as pl

from flows.catalog import refresh
from flows.stage import Made, Scope, Stage
from pipeline.document import to_html, to_markdown
from pipeline.errors import NotFound
from pipeline.plots import seasons as plots
from pipeline.plots.style import png
from pipeline.receipts import SOFTWARE, Receipt
from pipeline.seasons.claims import BEST, LEARNED, PAPER, STATIC
from pipeline.seasons.judging import judged
from pipeline.seasons.measures import DIFFERENCE, EFFECTIVE, OTHER
from pipeline.seasons.report import Report, document
from pipeline.seasons.summary import beside_table_3, curves
from pipeline.seasons.table3 import CHANGE
from pipeline.settings import Frozen
from pipeline.store import Store
from schemas import Claims, Games, Growth

#: The one output of the noun report.
NAME = "seasons"
TITLE = "Pitchlore: seasons"

#: It is made of all seasons there are, in one way.
NO_SETTINGS = Frozen()
NOTHING = Scope(matches=(), lengths=())


def seasons(store: Store) -> list[Receipt]:
    """The receipts of all seasons, by name."""
    return [receipt for receipt in store.receipts("seasons") if {"games", "growth"} <= receipt.files.keys()]


def tables(store: Store) -> tuple[pl.DataFrame, pl.DataFrame]:
    """The games and the growth of all seasons, schemas Games and Growth.

    Raises:
        NotFound: if no season has been played.
        CorruptFile: if a file is gone or its bytes are others.
    """
    receipts = seasons(store)
    if not receipts:
        raise NotFound("no season has been played", where=str(store.root),
                       next_step="Play one with `pitchlore season`")
    games = pl.concat(store.read_table(receipt, "games", Games) for receipt in receipts)
    growth = pl.concat(store.read_table(receipt, "growth", Growth) for receipt in receipts)
    return games.sort("season", "game"), growth.sort("season", "game", "role")


def drawn(games: pl.DataFrame, growth: pl.DataFrame) -> dict[str, bytes]:
    """Plots as PNG, by the names that the report knows; of what there are seasons for.

    Args:
        games: schema Games.
        growth: schema Growth.
    """
    found = {}
    paper, known = (table.filter(pl.col("settings") == PAPER) for table in (games, growth))
    if paper.height:
        goals = {"effective": EFFECTIVE, "cumulative": EFFECTIVE.cum_sum(), "difference": DIFFERENCE}
        actions = {name: pl.col(name) for name in ("behaviours", "pairs")}
        printed = beside_table_3(games, PAPER)
        found["table-3"] = plots.table_3(curves(paper, {"other": OTHER}), printed, CHANGE)
        found["figure-8"] = plots.states(curves(known, {"states": pl.col("states")}, ["role"]))
        found["figure-9"] = plots.actions(curves(known, actions, ["role"]))
        found["figure-10"] = plots.goals(curves(paper, goals))
    both = {"difference": DIFFERENCE, "other": OTHER}
    best = games.filter(pl.col("settings") == BEST)
    if best.height:
        found["best"] = plots.progress(curves(best, both), LEARNED)
    for base in (PAPER, BEST):
        mine = (pl.col("settings") == base) | pl.col("settings").str.starts_with(f"{base}-")
        variants = games.filter(mine & (pl.col("opponent") == STATIC))
        if variants["settings"].n_unique() > 1:
            found[f"ablations-{base}"] = plots.settings(curves(variants, both), CHANGE)
    return {name: png(figure) for name, figure in found.items()}


def compute(store: Store, _: str, __: Frozen, ___: Scope) -> Made:
    """Claims, plots, and the page in both forms."""
    games, growth = tables(store)
    claims, pictures = judged(games, growth), drawn(games, growth)
    blocks = document(Report(games, claims, pictures, SOFTWARE.split("+")[0]))
    return Made(
        tables=[(claims, Claims)],
        blobs={"page": ("html", to_html(TITLE, blocks)), "text": ("md", to_markdown(blocks).encode())}
        | {name: ("png", data) for name, data in pictures.items()},
    )


def _sources(store: Store, _: str, __: Scope) -> Iterable[Receipt]:
    return seasons(store)


STAGE = Stage("report", (Claims,), _sources, compute)


def write_report(store: Store) -> tuple[Receipt, Path]:
    """Make the report unless it is there, made of these very seasons.

    Not a flow: it is one piece of work of a few seconds, and needs no server.

    Returns:
        The receipt of its files (claims, page, text, and the plots), and where the page is.

    Raises:
        NotFound: if no season has been played.
        CorruptFile: if a season's file is gone or its bytes are others.
    """
    receipt = store.receipt("report", NAME) if STAGE.done(store, NAME, NO_SETTINGS, NOTHING) else None
    if receipt is None:
        tables(store)  # what is missing is said before anything is put in quarantine for it
        receipt = STAGE.perform(store, NAME, NO_SETTINGS, NOTHING)
        refresh(store)
    path = store.root / "report" / "index.html"
    store.write_bytes(path, store.read(receipt, "page"))
    return receipt, path
