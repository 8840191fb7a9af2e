"""Flow of the noun matches: one task a recording."""

from pathlib import Path

from pitchlore.flows.jobs import run_pieces
from pitchlore.flows.pruning import prune_or_say
from pitchlore.flows.tasks import conclude, data_folder, our_flow
from pitchlore.pipeline.engine.history import LOG, noted
from pitchlore.pipeline.engine.lacking import remarks
from pitchlore.pipeline.engine.matches import Recording, import_recording, inbox, strangers, useless
from pitchlore.pipeline.engine.placement.crew import crew
from pitchlore.pipeline.engine.placement.places import placed
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.settings import HistorySettings, ImportSettings
from pitchlore.pipeline.store import Store


def make_match(data: Path, recording: Recording, limits: ImportSettings) -> tuple[str, bool]:
    """Import one file; the match id and whether it is new."""
    receipt, new = import_recording(Store(data), recording, limits)
    return receipt.name, new


def import_all(
    store: Store, recordings: list[Recording] | None = None, limits: ImportSettings = ImportSettings()
) -> StageReport:
    """Import files, one task each. A file whose match is already stored counts as kept.

    Args:
        store: receives the matches.
        recordings: files to import. None takes the :func:`inbox`, and removes the logs of matches that were
            killed before anything was logged.
        limits: what reading a recording may cost.
    """
    notes, others = [], {}
    if recordings is None:
        notes = [f"{file}: removed, for its match was killed before anything of it was logged"
                 for file in useless(store)]
        recordings, others = inbox(store), strangers(store)
    before = {receipt.name: receipt.key for receipt in store.receipts("matches")}
    path = crew.get().path
    data = path(store.root)
    work = {r.label(store): {"data": data, "recording": r.at(path), "limits": limits} for r in recordings}
    report = run_pieces(make_match, "matches", work, task="import")
    after = {receipt.name: receipt.key for receipt in store.receipts("matches")}
    done = len(report.made)
    report.made = sorted(name for name, key in after.items() if before.get(name) != key)
    report.kept = done - len(report.made)
    new = {*report.made}
    report.notes = notes + remarks(store, (match for match in store.receipts("matches") if match.name in new))
    report.failed |= others
    return report


@our_flow(name="matches")
def matches_flow(
    data: Path, recordings: list[Recording] | None = None, limits: ImportSettings = ImportSettings(),
    on: str | None = None, history: HistorySettings = HistorySettings(),
) -> dict[str, object]:
    """Import the recordings, by default those in the inbox."""
    store = data_folder(data)
    with noted(store, "import", history) as note, placed(on, store.root):
        report = import_all(store, recordings, limits)
        note.report.stages.append(report)
    report.failed |= note.report.stage(LOG).failed
    prune_or_say(history)
    return conclude(store, report)
