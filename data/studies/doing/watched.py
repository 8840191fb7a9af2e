"""Recordings without draws: what robots were seen in, probably did, and saw, and what V did after.

A *moment* is each fifth of a second of a robot in play. It is seen in a situation; what it did is its option,
recovered from poses. V is the model that the package ships, as in the trials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
from doing.trial import CELLS, Game
from harness import command, log_of
from looking.decisions import cells

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.engine.outputs import table_of
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.update import scope_of
from pitchlore.pipeline.numbers.arrays import F32, F64, I64
from pitchlore.pipeline.settings import GramSettings, OptionSettings, Settings
from pitchlore.pipeline.stages.behaviours.grams import grams, merge, spelt
from pitchlore.pipeline.stages.behaviours.shrinkage import valued
from pitchlore.pipeline.stages.options.runs import as_done
from pitchlore.pipeline.stages.sequences.sights import sights
from pitchlore.pipeline.stages.values.models import shipped
from pitchlore.pipeline.stages.values.worths import values
from pitchlore.pipeline.store import Store
from pitchlore.schemas import Decisions, Moments, Options, Sequences
from pitchlore.schemas.options import OPTIONS

NOUNS = frozenset({"sides", "trajectories", "situations", "options", "goals", "events", "moments", "models",
                   "values", "sequences"})
#: A behaviour counts if it was seen so often, and a cell if so many moments of the role lie in it.
SUPPORT, MOMENTS = 30, 50


class Watched(NamedTuple):
    """Moments of a team's robots in recordings.

    Attributes:
        match: int64 [n], number of the match.
        role: int64 [n], index in ROLES.
        cell: int64 [n], :func:`looking.decisions.cells`.
        sight: float32 [n, 30].
        seen: int64 [n], situation, index in OPTIONS; -1 if it is none of them.
        did: int64 [n], recovered option, index in OPTIONS.
        change: float64 [n], V a second later less V.
    """

    match: I64
    role: I64
    cell: I64
    sight: F32
    seen: I64
    did: I64
    change: F64


def league_of(data: Path, games: Sequence[Game]) -> Store:
    """Recordings of a team's matches against itself, with the tables that are needed."""
    team, files = games[0].team, []
    for game in games:
        files.append(path := data / "recordings" / team / f"{game.seed}.mcap")
        if not path.exists():
            recipe = game.recipe()
            log = matches.read(log_of(MatchInPlay(recipe, game.controllers(recipe))), where=recipe.match_id)
            bare = replace(log, decisions=Decisions.empty())
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("wb") as file:
                matches.write(bare, file)
    store = Store(data / "leagues" / team)
    if not (store.root / "matches").exists():
        command("import", *files, "--data", store.root)
    STAGES.make(store, Settings(options=OptionSettings(recover=True)), scope_of(store), NOUNS)
    return store


def watched(store: Store) -> Watched:
    """The moments of a team."""
    parts = []
    settings = GramSettings(watched_s=0.2)
    for number, receipt in enumerate(store.receipts("sequences")):
        named = {noun: each for noun in ("matches", "moments", "options")
                 for each in store.receipts(noun) if each.name == receipt.name}
        log = matches.read(store.read(named["matches"], "log"), where=receipt.name)
        known = values(table_of(store, named["moments"], Moments), shipped())
        sequences = table_of(store, receipt, Sequences)
        rows = sights(log, known, settings, sequences)
        done = as_done(table_of(store, named["options"], Options)).select(
            "team", "robot", "end_ns", did="code", t_ns="start_ns")
        rows = rows.sort("t_ns").join_asof(
            done.sort("t_ns"), on="t_ns", by=["team", "robot"], check_sortedness=False,
        ).with_columns(did=pl.when(pl.col("t_ns") < pl.col("end_ns")).then("did"))
        parts.append(rows.drop_nulls(["change", "did"]).with_columns(match=pl.lit(number)))
    rows = pl.concat(parts)
    place = {code: index for index, code in enumerate(OPTIONS)}
    sight = np.ascontiguousarray(rows["sight"].to_numpy(), dtype=np.float32)
    seen, did = (np.array([place.get(code, -1) for code in rows[name]]) for name in ("code", "did"))
    return Watched(
        rows["match"].to_numpy().astype(np.int64), rows["role"].to_physical().to_numpy().astype(np.int64),
        cells(sight), sight, seen, did, rows["change"].to_numpy())


def today(store: Store) -> pl.DataFrame:
    """Role, code, support, value as the product has it, and the paper's, of behaviours of one situation."""
    tables = [table_of(store, receipt, Sequences) for receipt in store.receipts("sequences")]
    found = valued(spelt(merge(grams(table, 1) for table in tables), 1), shrink=True)
    return found.select(
        pl.col("role").cast(pl.String), pl.col("codes").list.first().alias("code"), "count", "value",
        paper=pl.col("paper_sum") / pl.col("count"),
    ).filter(pl.col("count") >= SUPPORT, pl.col("code").is_in(OPTIONS))


def where_seen(moments: Watched, label: I64, role: int, option: int) -> I64:
    """Cells in which a share of a role's moments is labelled so that is at least that of all cells."""
    own = moments.role == role
    count = np.bincount(moments.cell[own], minlength=CELLS)
    seen = np.bincount(moments.cell[own & (label == option)], minlength=CELLS)
    often = (count > MOMENTS) & (seen / np.maximum(count, 1) >= seen.sum() / max(count.sum(), 1)) & (seen > 0)
    found: I64 = np.flatnonzero(often)
    return found
