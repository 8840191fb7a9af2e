"""Flow of the noun grams: one task a match and round.

An output is named ``<match>.n4``: the grams of four situations, and so on down to one. Those of a
shorter length are counted in what the behaviours of the longer ones have left.
"""

import polars as pl

from flows.stage import Made, Scope, Stage, flow_of, need, task_of
from pipeline.grams.count import cover, grams, value
from pipeline.settings import GramSettings
from pipeline.store import Store
from pipeline.store.receipts import Receipt
from schemas import Goals, Grams, Patterns, Situations


def output(match: str, n: int) -> str:
    """The name of a match's grams of length ``n``."""
    return f"{match}.n{n}"


def of(name: str) -> tuple[str, int]:
    """Match and length of an output's name."""
    match, n = name.rsplit(".n", 1)
    return match, int(n)


def earlier_rounds(store: Store, n: int, scope: Scope) -> list[Receipt]:
    """The receipts of the behaviours longer than ``n``, longest first."""
    return [need(store, "behaviours", scope.round(longer)) for longer in scope.longer(n)]


def sources(store: Store, name: str, scope: Scope) -> list[Receipt]:
    """What a match's grams are made from."""
    match, n = of(name)
    return [need(store, "situations", match), need(store, "goals", match), *earlier_rounds(store, n, scope)]


def compute(store: Store, name: str, settings: GramSettings, scope: Scope) -> Made:
    """Grams of one match and length."""
    match, n = of(name)
    situations = store.read_table(need(store, "situations", match), "situations", Situations)
    goals = store.read_table(need(store, "goals", match), "goals", Goals)
    rounds = [store.read_table(receipt, "patterns", Patterns) for receipt in earlier_rounds(store, n, scope)]
    valued = value(situations, goals, settings)
    taken = cover(valued, pl.concat(rounds), settings) if rounds else None
    table = grams(valued, n, taken, settings)
    return Made(tables=[(table, Grams)], details={"windows": int(table["count"].sum())})


STAGE = Stage("grams", (Grams,), sources, compute)


make_grams = task_of(STAGE)
grams_flow = flow_of(
    STAGE, make_grams, lambda scope: [output(match, n) for n in scope.lengths for match in scope.matches]
)
