"""Leftovers in a bucket of makers of versions that ended before their manifest."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

from pitchlore.pipeline.base.errors import CorruptFile
from pitchlore.pipeline.store.claims import CLAIM, GONE_S, at_work, claimed
from pitchlore.pipeline.store.mirrors import Mirror, key_of
from pitchlore.pipeline.store.receipts import Manifest
from pitchlore.pipeline.store.sealed import read_model

#: A file without a manifest is that of a maker at work, perhaps, until it is so old, seconds.
_OLD_S = 24 * 3600.0
_OF_MAKER = re.compile(rf"(.+)/(?:v\d{{4,}}/[^/]+|{re.escape(CLAIM)})$")


def prune_versions(mirror: Mirror) -> list[Path]:
    """Remove files of versions that no manifest names, and claims of the dead, from a bucket.

    Two that make the same version put their files side by side; those of the loser are named by no manifest.
    A file stays for a day, a claim as long as others would wait for it, both by the bucket's clock. Nothing
    of a folder goes while somebody makes a version there.

    Returns:
        The paths that the removed files have in the copy.

    Raises:
        BucketFailed: if the bucket cannot be reached.
    """
    removed = []
    for folder, keys in _old(mirror).items():
        path = mirror.folder / folder
        if at_work(mirror, path):
            continue
        with claimed(mirror, path):  # it takes over what is dead, and nobody makes a version meanwhile
            mirror.sync()
            unnamed = {key for key in keys if not _named(mirror, key)}
            for key in sorted(unnamed - {f"{folder}/{CLAIM}"}):
                mirror.remove(mirror.folder / key)
        removed += [mirror.folder / key for key in sorted(unnamed)]
    return removed


def _old(mirror: Mirror) -> dict[str, set[str]]:
    """The keys of old files without a manifest, and of old claims, by the folder of their versions."""
    found = defaultdict[str, set[str]](set)
    for entry in mirror.bucket.listing():
        match = _OF_MAKER.match(entry.key)
        limit = GONE_S if entry.key.endswith(f"/{CLAIM}") else _OLD_S
        if match and mirror.now() - entry.modified > limit and not _named(mirror, entry.key):
            found[match[1]].add(entry.key)
    return found


def _named(mirror: Mirror, key: str) -> bool:
    """True if a key is that of a manifest, or of a file that one names; or its manifest cannot be read."""
    folder, _, name = key.rpartition("/")
    if name == CLAIM:
        return False
    try:
        manifest = read_model(str(mirror.folder / folder / "manifest.json"), Manifest)
    except CorruptFile:
        return True
    names = {"manifest.json"}
    for record in manifest.files.values() if manifest else ():
        names |= {record.path, key_of(f"{folder}/{record.path}", record.sha256).rpartition("/")[2]}
    return name in names
