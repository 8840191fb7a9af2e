"""Flow of the noun matches: one task a recording."""

from pathlib import Path

from flows.matches import Recording, import_recording, inbox, useless
from flows.progress import StageReport
from flows.tasks import conclude, data_folder, our_flow, run_tasks, stage_task
from pipeline.store import Store


@stage_task(name="import")
def make_match(data: Path, name: str, recording: Recording) -> tuple[str, bool]:
    """Import one file; the match id and whether it is new."""
    receipt, new = import_recording(Store(data), recording)
    return receipt.name, new


def import_all(store: Store, recordings: list[Recording] | None = None) -> StageReport:
    """Import files, one task each. A file whose match is already stored counts as kept.

    Args:
        store: receives the matches.
        recordings: files to import. None takes the :func:`inbox`, and removes the logs of matches that were
            killed before anything was logged.
    """
    notes = []
    if recordings is None:
        notes = [f"{file}: removed, for its match was killed before anything of it was logged"
                 for file in useless(store)]
        recordings = inbox(store)
    before = {receipt.name: receipt.key for receipt in store.receipts("matches")}
    work = {
        str(r.file): {"data": store.root, "name": r.file.name, "recording": r} for r in recordings
    }
    report = run_tasks(make_match, "matches", work)
    after = {receipt.name: receipt.key for receipt in store.receipts("matches")}
    done = len(report.made)
    report.made = sorted(name for name, key in after.items() if before.get(name) != key)
    report.kept = done - len(report.made)
    report.notes = notes
    return report


@our_flow(name="matches")
def matches_flow(data: Path, recordings: list[Recording] | None = None) -> dict[str, object]:
    """Import the recordings, by default those in the inbox."""
    store = data_folder(data)
    return conclude(store, import_all(store, recordings))
