"""Flow of the noun decisions: one task a match, once all behaviours are known."""

import polars as pl

from flows.stage import Made, Scope, Stage, flow_of, need, task_of
from pipeline.decisions import observe
from pipeline.grams import value
from pipeline.pitch import Pitch
from pipeline.receipts import Receipt
from pipeline.settings import DecisionSettings
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


make_decisions = task_of(STAGE)
decisions_flow = flow_of(STAGE, make_decisions, lambda scope: scope.matches)
