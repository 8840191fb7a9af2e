"""Flow of the noun behaviours: one small task a round, over the grams of all matches of the scope."""

import polars as pl

from flows.stage import Made, Scope, Stage, flow_of, need, task_of
from pipeline.behaviours.select import select
from pipeline.behaviours.som import to_bytes
from pipeline.grams.count import merge
from pipeline.settings import BehaviourSettings
from pipeline.store import Store
from pipeline.store.receipts import Receipt
from schemas import Grams, Patterns


def gram_receipts(store: Store, name: str, scope: Scope) -> list[Receipt]:
    """The receipts of the grams that a round is over."""
    n = next(n for n in scope.lengths if scope.round(n) == name)
    return [need(store, "grams", f"{match}.n{n}") for match in scope.matches]


def situation_receipts(store: Store, scope: Scope) -> list[Receipt]:
    """The receipts of the situations whose number the thresholds are a share of."""
    return [need(store, "situations", match) for match in scope.matches]


def sources(store: Store, name: str, scope: Scope) -> list[Receipt]:
    """What a round is made from."""
    return [*gram_receipts(store, name, scope), *situation_receipts(store, scope)]


def compute(store: Store, name: str, settings: BehaviourSettings, scope: Scope) -> Made:
    """Behaviours of one length over all matches of the scope."""
    round_ = next(r for r in settings.rounds if scope.round(r.n) == name)
    counted = pl.col("team").is_in(settings.teams)
    merged = merge(store.read_table(receipt, "grams", Grams).filter(counted)
                   for receipt in gram_receipts(store, name, scope))
    recognised = sum(int(receipt.details["situations"][team])
                     for receipt in situation_receipts(store, scope) for team in settings.teams)
    selection = select(merged, recognised, settings, round_)
    return Made(
        tables=[(selection.patterns, Patterns)],
        blobs={"map": ("npz", to_bytes({round_.n: selection.map}))} if selection.map else {},
        details={"report": {k: _plain(v) for k, v in selection.report._asdict().items()}},
    )


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value


STAGE = Stage("behaviours", (Patterns,), sources, compute)


make_behaviours = task_of(STAGE)
behaviours_flow = flow_of(STAGE, make_behaviours, lambda scope: [scope.round(n) for n in scope.lengths])
