"""The catalogue: views over the files that receipts and manifests name."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from flows.stage import Per
from flows.stages import STAGES
from pipeline.store import Store, catalog
from pipeline.store.receipts import FileRecord, digest
from schemas import PUBLIC


def match_of(output: str) -> str:
    """The match that an output is of, ``MATCH`` or ``MATCH.n4``."""
    return output.rsplit(".n", 1)[0]


def forget_match(store: Store, match: str, keep: Iterable[str] = ()) -> int:
    """Remove a match and the outputs made from it, the last stage first. Returns their number.

    Args:
        store: holds them.
        match: id of the match.
        keep: nouns whose outputs stay.
    """
    removed = 0
    for noun in reversed(STAGES.of_matches):
        if noun not in keep:
            names = [receipt.name for receipt in store.receipts(noun) if match_of(receipt.name) == match]
            removed += sum(store.forget(noun, name) for name in names)
    return removed


def catalog_path(store: Store) -> Path:
    """Path of the catalogue."""
    return store.root / "catalog.duckdb"


def sources(store: Store) -> dict[str, list[tuple[Path, FileRecord]]]:
    """Files of each public table, as receipts and manifests name them; folders are never listed.

    A removed match has no rows. A match in quarantine has no rows of the stage that refused it or of later
    stages: such rows would come from other settings than those of the other matches.
    """
    names = {tag: name for name, schema in PUBLIC.items() for tag in schema.readable()}
    files: dict[str, list[tuple[Path, FileRecord]]] = {}

    def add(folder: Path, records: Iterable[FileRecord]) -> None:
        for record in records:
            if record.table in names and record.rows:
                files.setdefault(names[record.table], []).append((folder / record.path, record))

    standing = {receipt.name for receipt in store.receipts("matches")}
    refused = {(record.noun, match_of(record.name)) for record in store.quarantined()}
    for noun in STAGES.of_matches:
        standing -= {match for stage, match in refused if stage == noun and noun != "matches"}
        for receipt in store.receipts(noun):
            if match_of(receipt.name) in standing:
                add(store.root, receipt.files.values())
    for noun in STAGES.nouns(Per.OWN):
        for receipt in store.receipts(noun):
            add(store.root, receipt.files.values())
    for noun in STAGES.versioned:
        for manifest in store.manifests(noun):
            add(store.version_folder(noun, manifest.version), manifest.files.values())
    return files


def refresh(store: Store) -> tuple[Path, list[Path]]:
    """Build the catalogue aside and move it into place, if it is not up to date.

    A catalogue that another version of Pitchlore made, with other tables, is not.

    New files, and files that were touched since, are checked against their SHA-256. A lost or damaged
    file is left out, so that the others can be queried.

    Returns:
        The catalogue's path, and the files that were left out.
    """
    path = catalog_path(store)
    known = catalog.listing(path)
    listed: dict[str, list[Path]] = {}
    left_out: list[Path] = []
    for name, files in sources(store).items():
        for file, record in files:
            seen = catalog.glance(file)
            trusted = seen is not None and (known or {}).get((name, str(file.resolve()))) == seen
            if trusted or (seen is not None and digest(store.foreign(file)) == record.sha256):
                listed.setdefault(name, []).append(file)
            else:
                left_out.append(file)
    wanted = {(name, str(f.resolve())): catalog.glance(f) for name, files in listed.items() for f in files}
    if wanted != known:
        with store.aside(path) as temporary:
            catalog.build(temporary, listed)
    return path, left_out
