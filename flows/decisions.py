"""Flow of the noun decisions: one task a match, once all behaviours are known."""

import polars as pl

from flows.stage import Made, Scope, Stage, flow_of, need, task_of
from pipeline import matches
from pipeline.decisions import complete, observe
from pipeline.grams.count import value
from pipeline.pitch import Pitch
from pipeline.settings import GramSettings
from pipeline.store import Store
from pipeline.store.receipts import Receipt
from schemas import Decisions, Goals, Patterns, Referee, Situations, Trajectories

NOUNS = ("matches", "trajectories", "situations", "goals")


def sources(store: Store, match: str, scope: Scope) -> list[Receipt]:
    """What a match's decisions are made from: its own log and tables, the behaviours of every length."""
    rounds = [need(store, "behaviours", scope.round(n)) for n in scope.lengths]
    return [*(need(store, noun, match) for noun in NOUNS), *rounds]


def compute(store: Store, match: str, settings: GramSettings, scope: Scope) -> Made:
    """Decisions of one match: logged by the players, or seen."""
    log, trajectories, situations, scored, *rounds = sources(store, match, scope)
    goals = store.read_table(scored, "goals", Goals)
    seen = observe(
        value(store.read_table(situations, "situations", Situations), goals, settings),
        store.read_table(trajectories, "trajectories", Trajectories),
        store.read_table(log, "referee", Referee),
        pl.concat([store.read_table(receipt, "patterns", Patterns) for receipt in rounds]),
        Pitch.model_validate(log.details["pitch"]),
        settings,
    )
    table = complete(seen, value(logged(store, log), goals, settings, start="t_ns"))
    return Made(tables=[(table, Decisions)],
                details={"decisions": table.height, "chosen": int(table["chosen"].sum())})


def logged(store: Store, match: Receipt) -> pl.DataFrame:
    """The decisions in a match's log; one that is known to have none is not read."""
    if match.details.get("decisions") == 0:
        return Decisions.empty()
    where = str(store.root / match.files["log"].path)
    return matches.read(store.read(match, "log"), where=where).decisions


STAGE = Stage("decisions", (Decisions,), sources, compute)


make_decisions = task_of(STAGE)
decisions_flow = flow_of(STAGE, make_decisions, lambda scope: scope.matches)
