"""The catalogue: views over the files that receipts and manifests name."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from pitchlore.pipeline.base.errors import CorruptFile, PitchloreError
from pitchlore.pipeline.engine import freshness
from pitchlore.pipeline.engine.progress import RunReport, StageReport
from pitchlore.pipeline.engine.stage import Per
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.store import Store, catalog
from pitchlore.pipeline.store.outputs import RECEIPT
from pitchlore.pipeline.store.paths import SAFE_NAME, listed
from pitchlore.pipeline.store.reading import remedy_for
from pitchlore.pipeline.store.receipts import FileRecord, Receipt
from pitchlore.schemas import PUBLIC

_log = logging.getLogger(__name__)


def forget_match(store: Store, match: str) -> int:
    """Remove a match and the outputs made from it, the last stage first. Returns their number."""
    return forget_outputs(store, match, STAGES.nouns(Per.MATCH))


def forget_outputs(store: Store, name: str, nouns: Sequence[str]) -> int:
    """Remove the outputs of a name, that of the last noun first. Returns their number."""
    if not SAFE_NAME.match(name):  # no output can have it
        return 0
    with store.removing():
        return sum(store.forget(noun, name) for noun in reversed(nouns))


def catalog_path(store: Store) -> Path:
    """Path of the catalogue."""
    return store.root / "catalog.duckdb"


#: Among the files of a catalogue, what it was made by; only where all files were whole.
_RECORDS = "."


class Vouched(NamedTuple):
    """A file that a receipt or manifest vouches for.

    Attributes:
        receipt: the receipt or manifest.
        path: path of the file, absolute and without links.
        record: its stored record.
        seen: its size and time of change when it was looked at.
    """

    receipt: Receipt
    path: str
    record: FileRecord
    seen: catalog.Glance

    @property
    def advice(self) -> str:
        """The advice if it is damaged, a line."""
        return f"{self.path}: is lost or damaged. {remedy_for(self.receipt)}."


class Look(NamedTuple):
    """A look at the files of a data folder.

    Attributes:
        whole: the whole files; none if the catalogue stands, for then nobody needs them.
        damaged: the files that are damaged or lost.
    """

    whole: list[Vouched]
    damaged: list[Vouched]


def check_files(store: Store) -> Look:
    """Check the files that are new, or were touched since the catalogue was made, against their SHA-256.

    The store suspects the damaged files from now on: outputs that have one of them are not done, so that they
    are made again. A file whose bytes changed while its size and time did not is not noticed here, but by
    ``pitchlore verify``.
    """
    with store.keeping():
        listing = catalog.listing(catalog_path(store))
        if _stands(listing, _records(store)):
            store.suspect = frozenset()
            return Look([], [])
        return _look(store, _receipts(store), listing)


def _receipts(store: Store) -> list[Receipt]:
    """All receipts and manifests, as they are at one moment; folders are never listed."""
    with store.snapshot():
        return [*(receipt for noun in STAGES.receipted for receipt in store.receipts(noun)),
                *(manifest for noun in STAGES.versioned for manifest in store.manifests(noun))]


def _records(store: Store) -> dict[str, catalog.Glance]:
    """The glance at each receipt, manifest and record of quarantine: what the catalogue is made by."""
    paths = [path for noun in STAGES.receipted for path in listed(store.root / noun, RECEIPT)]
    paths += [str(store.version_folder(noun, version) / "manifest.json")
              for noun in STAGES.versioned for version in store.versions(noun)]
    paths += listed(store.root / "quarantine", ".json")
    there, root = len(str(store.root)), str(store.root.resolve())
    return {root + path[there:]: catalog.glance(path) for path in paths}


def _stands(listing: catalog.Listing | None, records: dict[str, catalog.Glance]) -> bool:
    """True if nothing has changed since the catalogue was made, when all files were whole.

    This takes no reading: so a question about thousands of matches is answered at once.
    """
    if listing is None:
        return False
    made_by = {path: seen for (name, path), seen in listing.items() if name == _RECORDS}
    return made_by == records and all(
        catalog.glance(path) == seen for (name, path), seen in listing.items() if name != _RECORDS)


def _look(store: Store, receipts: Iterable[Receipt], listing: catalog.Listing | None) -> Look:
    known = {path: glance for (_, path), glance in (listing or {}).items()}
    found, root = Look([], []), store.root.resolve()
    for receipt in receipts:
        folder = store.folder(receipt)
        resolved = root / folder.relative_to(store.root) if folder != store.root else root
        for record in receipt.files.values():
            path = f"{resolved}/{record.path}"
            seen = catalog.glance(path)
            trusted = seen is not None and known.get(path) == seen
            whole = trusted or store.whole(record, folder)
            (found.whole if whole else found.damaged).append(Vouched(receipt, path, record, seen))
    store.suspect = frozenset(store.folder(file.receipt) / file.record.path for file in found.damaged)
    return found


def _views(
    store: Store, receipts: Iterable[Receipt], files: Iterable[Vouched]
) -> dict[str, dict[str, catalog.Glance]]:
    """The files with rows of each public table; under ``""`` all other files.

    A removed match has no rows. A match or group in quarantine has no rows of the stage that refused it or of
    later stages: such rows would come from other settings than those of the other matches.
    """
    names = {tag: name for name, schema in PUBLIC.items() for tag in schema.readable()}
    out = {(record.noun, record.name) for record in store.quarantined()}
    there = {receipt.name for receipt in receipts if receipt.noun == "matches"}
    standing: dict[str, set[str]] = {}
    refused: dict[str, set[str]] = {}
    gone = set[str]()
    for noun in STAGES.of_matches:
        gone = gone | {name for stage, name in out if stage == noun and noun != "matches"}
        if STAGES[noun].per is Per.MATCH:
            standing[noun] = there - gone
        else:
            refused[noun] = gone
    views: dict[str, dict[str, catalog.Glance]] = {}
    for receipt, path, record, seen in files:
        noun, name = receipt.noun, receipt.name
        shown = record.rows and name in standing.get(noun, {name}) and name not in refused.get(noun, ())
        if noun in refused and name in there and receipt.versions.get(noun) != STAGES[noun].version:
            shown = False  # once, decisions had an output for each match
        views.setdefault(names.get(record.table or "", "") if shown else "", {})[path] = seen
    return views


def refresh_into(store: Store, report: StageReport) -> None:
    """Bring the catalogue up to date (:func:`renew`). If that fails, it is one more failure of a report."""
    try:
        renew(store)
    except PitchloreError as error:
        report.failed["catalog.duckdb"] = str(error)


def refresh_after(store: Store, report: RunReport) -> None:
    """Bring the catalogue up to date after a run. If that fails, it is one more failure of the run."""
    catalogue = StageReport(noun="catalogue")
    refresh_into(store, catalogue)
    if catalogue.failed:
        report.stages.append(catalogue)


def renew(store: Store) -> None:
    """Bring the catalogue up to date after a change.

    That of a bucket is a cache, which is made where somebody asks: it takes the files of all tables.
    """
    if store.mirror is None:
        refresh(store)


def refresh(store: Store) -> tuple[Path, list[Vouched]]:
    """Build the catalogue aside and move it into place, if it is not up to date.

    A catalogue that another version of Pitchlore made, with other tables, is not. Damaged files are left
    out, so that the others can be queried (:func:`check_files`).

    Returns:
        The catalogue's path, and the files that were left out.
    """
    path = catalog_path(store)
    with store.keeping():
        listing = catalog.listing(path)
        try:
            damaged = _bring_up_to_date(store, path, listing)
        except CorruptFile:  # the bytes of a file changed, while its size and time did not
            damaged = _bring_up_to_date(store, path, None)
    return path, damaged


def _bring_up_to_date(store: Store, path: Path, listing: catalog.Listing | None) -> list[Vouched]:
    """Build the catalogue unless it has the listing; the files that are left out."""
    records = _records(store)
    if _stands(listing, records):
        return []
    receipts = _receipts(store)
    store.bring(receipts, PUBLIC)
    whole, damaged = _look(store, receipts, listing)
    views = _views(store, receipts, whole)
    if not damaged and not any(store.unreadable(noun) for noun in STAGES):
        views[_RECORDS] = records  # made before they were read: if one has changed since, it does not stand
    wanted = {(name, path): seen for name, files in views.items() for path, seen in files.items()}
    if wanted != listing:
        with store.aside(path) as temporary:
            catalog.build(temporary, views, frozenset(
                schema.NAME for noun in STAGES.nouns(Per.GROUP) for schema in STAGES[noun].schemas
                if "match_id" in schema.columns()))
    return damaged


def files_of(store: Store, table: str) -> list[str]:
    """Paths of the files with rows of a public table, as the catalogue has them; absolute, sorted."""
    listing = catalog.listing(catalog_path(store)) or {}
    return sorted(path for name, path in listing if name == table)


def distrust(store: Store) -> None:
    """Forget which files were whole, and which outputs were done.

    What looks next reads every byte, and no notebook gets damaged rows.
    """
    with suppress(OSError):
        catalog_path(store).unlink(missing_ok=True)
    freshness.forget_freshness(store)
