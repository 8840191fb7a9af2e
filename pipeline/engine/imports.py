"""Recordings become matches: one piece of work a recording."""

from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

from pitchlore.pipeline.base.system import share_folder
from pitchlore.pipeline.engine.arrivals import Arrivals, stamps_of
from pitchlore.pipeline.engine.lacking import remarks
from pitchlore.pipeline.engine.matches import standing, take_in
from pitchlore.pipeline.engine.outputs import need
from pitchlore.pipeline.engine.placement.executors import executors
from pitchlore.pipeline.engine.progress import StageReport
from pitchlore.pipeline.engine.recordings import Recording, inbox, strangers, useless
from pitchlore.pipeline.engine.tasks import run_pieces
from pitchlore.pipeline.settings import ImportSettings
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt

#: Words on a recording of which a part was taken for the whole.
GROWN = "a part of it was imported"


class Taken(NamedTuple):
    """A recording that was imported, or was here: stamps of its files before, and SHA-256 of its content."""

    stamps: str
    sha256: str


def make_match(data: Path, recording: Recording, limits: ImportSettings) -> Taken:
    """Import one recording."""
    store = Store(data)
    stamps = stamps_of(recording.at(store.here).files())
    return Taken(stamps, take_in(store, recording, limits).sha256)


def import_all(
    store: Store, recordings: list[Recording] | None = None, limits: ImportSettings = ImportSettings()
) -> StageReport:
    """Import files, a piece of work each. A file whose match is already stored counts as kept.

    Args:
        store: receives the matches.
        recordings: files to import. None takes the :func:`inbox`, and removes the logs of matches that were
            killed before anything was logged.
        limits: bounds of the cost of reading a recording.
    """
    notes, others = [], {}
    if recordings is None:
        notes = [f"{file}: removed, for its match was killed before anything of it was logged"
                 for file in useless(store)]
        recordings, others = inbox(store), strangers(store)
    arrivals, work, halves, kept = Arrivals(store), {}, dict[str, str](), 0
    path, root = executors.get().path, executors.get().path(store.root)
    for recording in recordings:
        content = arrivals.content(recording.files())
        there = None if content is None else standing(store, recording, content)
        if there is None:
            work[recording.label(store)] = recording
            if (half := arrivals.before_it_grew(recording.files())) is not None:
                halves[recording.label(store)] = half
        else:
            store.release("matches", there.name)
            kept += 1

    taken_in: set[str] = set()

    def ended(label: str, taken: Taken) -> None:
        arrivals.note(work[label].files(), *taken)
        taken_in.add(taken.sha256)

    if work and limits.isolate:
        share_folder()
    before = _keys(store) if work else {}
    report = run_pieces(make_match, "matches", {
        label: {"data": root, "recording": recording.at(path), "limits": limits}
        for label, recording in work.items()
    }, task="import", ended=ended)
    arrivals.keep()
    after = _keys(store) if work else {}
    done = len(report.made)
    report.made = sorted(name for name, key in after.items() if before.get(name) != key)
    made = [need(store, "matches", name) for name in report.made]
    sources = {receipt.inputs.get("source") for receipt in made}
    report.kept = kept + done - len(taken_in & sources)  # a recording may have several matches
    grown = {source: label for label, source in halves.items() if label not in report.failed}
    notes += [f"{grown[source]}: {GROWN} as {name}, before it was whole: "
              f"`pitchlore forget {name}` removes that."
              for name, source in _sources(store, grown) if source not in sources]
    report.notes = notes + remarks(store, made)
    report.failed |= others
    return report


def _sources(store: Store, wanted: Collection[str]) -> list[tuple[str, str]]:
    """Names and contents of the matches that were made from these contents."""
    found = store.tried("matches") if wanted else ()
    return [(name, receipt.inputs["source"]) for name, receipt in found
            if isinstance(receipt, Receipt) and receipt.inputs.get("source") in wanted]


def _keys(store: Store) -> dict[str, str]:
    """The keys of the matches, by id; one with a damaged receipt counts as new once it is whole."""
    return {name: found.key for name, found in store.tried("matches") if isinstance(found, Receipt)}
