"""The catalogue over what receipts and manifests vouch for."""

from __future__ import annotations

from pathlib import Path

from pipeline import catalog
from pipeline.store import Store
from schemas import PUBLIC

#: The nouns whose receipts, and whose versions, hold public tables.
RECEIPTED = ("matches", "trajectories", "situations", "goals", "grams", "behaviours", "decisions")
VERSIONED = ("knowledge", "policies")


def catalog_path(store: Store) -> Path:
    """Where the catalogue is."""
    return store.root / "catalog.duckdb"


def sources(store: Store) -> dict[str, list[Path]]:
    """Public table to its files: by receipts and manifests, never by what lies in a folder."""
    tags = {schema.tag(): name for name, schema in PUBLIC.items()}
    files: dict[str, list[Path]] = {}
    for noun in RECEIPTED:
        for receipt in store.receipts(noun):
            for record in receipt.files.values():
                if record.table in tags and record.rows:
                    files.setdefault(tags[record.table], []).append(store.root / record.path)
    for noun in VERSIONED:
        for version in store.versions(noun):
            folder = store.version_folder(noun, version)
            for record in store.manifest(noun, version).files.values():
                if record.table in tags and record.rows:
                    files.setdefault(tags[record.table], []).append(folder / record.path)
    return files


def refresh(store: Store) -> Path:
    """Build the catalogue aside and move it into place, if it is not up to date; its path."""
    path, files = catalog_path(store), sources(store)
    if catalog.stale(path, files):
        with store.aside(path) as temporary:
            catalog.build(temporary, files)
    return path
