"""Flow of the noun behaviours: one small task a round, over the grams of all matches."""

from pathlib import Path

from flows.stage import (
    Made,
    Stage,
    conclude,
    data_folder,
    need,
    our_flow,
    run_stage,
    sound_matches,
    stage_task,
)
from pipeline.behaviours import select
from pipeline.grams import merge
from pipeline.receipts import Receipt
from pipeline.settings import BehaviourSettings
from pipeline.som import to_bytes
from pipeline.store import Store
from schemas import Grams, Patterns


def round_name(n: int) -> str:
    """The name of the output of the round over grams of length ``n``."""
    return f"n{n}"


def gram_receipts(store: Store, name: str) -> list[Receipt]:
    """The receipts of the grams that a round is over."""
    return [need(store, "grams", f"{match}.{name}") for match in sound_matches(store)]


def sources(store: Store, name: str) -> list[Receipt]:
    """What a round is made from: the grams, and the situations whose number they are a share of."""
    situations = [need(store, "situations", match) for match in sound_matches(store)]
    return [*gram_receipts(store, name), *situations]


def compute(store: Store, name: str, settings: BehaviourSettings) -> Made:
    """Behaviours of one length over all matches."""
    round_ = next(r for r in settings.rounds if round_name(r.n) == name)
    merged = merge(store.read_table(receipt, "grams", Grams) for receipt in gram_receipts(store, name))
    recognised = sum(
        int(need(store, "situations", match).details["situations"]) for match in sound_matches(store)
    )
    selection = select(merged, recognised, settings, round_)
    return Made(
        tables=[(selection.patterns, Patterns)],
        blobs={"map": ("npz", to_bytes({round_.n: selection.map}))} if selection.map else {},
        details={"report": {k: _plain(v) for k, v in selection.report._asdict().items()}},
    )


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value


STAGE = Stage("behaviours", (Patterns,), sources, compute)


@stage_task(name="behaviours")
def make_behaviours(data: Path, name: str, settings: BehaviourSettings) -> str:
    """Select the behaviours of one length; the key of the receipt."""
    return STAGE.perform(Store(data), name, settings).key


@our_flow(name="behaviours")
def behaviours_flow(
    data: Path, n: int = 4, settings: BehaviourSettings = BehaviourSettings()
) -> dict[str, object]:
    """Select the behaviours of length ``n`` if the grams have changed."""
    store = data_folder(data)
    return conclude(run_stage(make_behaviours, STAGE, store, [round_name(n)], settings))
