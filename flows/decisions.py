"""Flow of the noun decisions: one task a match, once all behaviours are known."""

from pathlib import Path

import polars as pl

from flows.stage import (
    Made,
    Scope,
    Stage,
    conclude,
    data_folder,
    need,
    our_flow,
    run_stage,
    scope_of,
    stage_task,
)
from pipeline.decisions import observe
from pipeline.grams import value
from pipeline.pitch import Pitch
from pipeline.receipts import Receipt
from pipeline.settings import DecisionSettings, Settings
from pipeline.store import Store
from schemas import Decisions, Goals, Patterns, Referee, Situations, Trajectories

NOUNS = ("matches", "trajectories", "situations", "goals")


def sources(store: Store, match: str, scope: Scope) -> list[Receipt]:
    """What a match's decisions are made from: its own tables and the behaviours of every length."""
    rounds = [need(store, "behaviours", f"n{n}") for n in scope.lengths]
    return [*(need(store, noun, match) for noun in NOUNS), *rounds]


def compute(store: Store, match: str, settings: DecisionSettings, scope: Scope) -> Made:
    """Decisions seen in one match."""
    log, trajectories, situations, goals, *rounds = sources(store, match, scope)
    table = observe(
        value(
            store.read_table(situations, "situations", Situations),
            store.read_table(goals, "goals", Goals),
            settings.grams,
        ),
        store.read_table(trajectories, "trajectories", Trajectories),
        store.read_table(log, "referee", Referee),
        pl.concat([store.read_table(receipt, "patterns", Patterns) for receipt in rounds]),
        Pitch.model_validate(log.details["pitch"]),
        settings.grams,
        settings.knowledge,
    )
    return Made(tables=[(table, Decisions)], details={"decisions": table.height})


STAGE = Stage("decisions", (Decisions,), sources, compute)


@stage_task(name="decisions")
def make_decisions(data: Path, name: str, settings: DecisionSettings, scope: Scope) -> str:
    """Find the decisions of one match; the key of the receipt."""
    return STAGE.perform(Store(data), name, settings, scope).key


@our_flow(name="decisions")
def decisions_flow(data: Path, settings: Settings = Settings()) -> dict[str, object]:
    """Find the decisions of all matches that need it."""
    store = data_folder(data)
    scope = scope_of(store, settings)
    report = run_stage(make_decisions, STAGE, store, list(scope.matches), settings.decisions, scope)
    return conclude(store, report)
