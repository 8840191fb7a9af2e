"""Flow of the noun decisions: one task a match, once all behaviours are known."""

from pathlib import Path

import polars as pl

from flows.stage import Made, Stage, conclude, data_folder, match_names, need, our_flow, run_stage, stage_task
from pipeline.decisions import observe
from pipeline.grams import value
from pipeline.pitch import Pitch
from pipeline.receipts import Receipt
from pipeline.settings import DecisionSettings
from pipeline.store import Store
from schemas import Decisions, Goals, Patterns, Referee, Situations, Trajectories

NOUNS = ("matches", "trajectories", "situations", "goals")
ROUNDS = ("n4", "n3", "n2", "n1")


def sources(store: Store, match: str) -> list[Receipt]:
    """What a match's decisions are made from."""
    return [*(need(store, noun, match) for noun in NOUNS), *(need(store, "behaviours", r) for r in ROUNDS)]


def compute(store: Store, match: str, settings: DecisionSettings) -> Made:
    """Decisions seen in one match."""
    log, trajectories, situations, goals, *rounds = sources(store, match)
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
def make_decisions(data: Path, name: str, settings: DecisionSettings) -> str:
    """Find the decisions of one match; the key of the receipt."""
    return STAGE.perform(Store(data), name, settings).key


@our_flow(name="decisions")
def decisions_flow(data: Path, settings: DecisionSettings = DecisionSettings()) -> dict[str, object]:
    """Find the decisions of all matches that need it."""
    store = data_folder(data)
    return conclude(run_stage(make_decisions, STAGE, store, match_names(store), settings))
