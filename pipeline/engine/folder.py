"""A data folder that is there."""

from __future__ import annotations

from pathlib import Path

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.paths import check_root, listed

#: Any of these makes a folder a data folder.
_SIGNS = ("*/*.receipt.json", "*/*/manifest.json", "quarantine/*.json", "catalog.duckdb", "inbox", "playing",
          "watching", "runs", "seasons", "server")
_OTHERWISE = "Name the data folder with --data, or fill this one: `pitchlore import FILE`"


def existing(data: Path) -> Store:
    """The store in a data folder, for who looks at what is there.

    Args:
        data: the folder, or the URL of a bucket.

    Raises:
        BadSettings: if it is not a folder.
        NotFound: if it does not exist, or holds nothing of a data folder.
        ReadFailed: if the system refuses to read it.
        StorageFailed: if it is in a bucket that cannot be reached, and there is no copy.
    """
    store = Store(data)
    check_root(store.root)
    store.catch_up_or_say()
    if not store.root.exists():
        raise NotFound("there is no such folder", where=store.where, next_step=_OTHERWISE)
    listed(store.root)  # a folder that may not be read has no signs, and is not empty
    if not any(next(store.root.glob(sign), None) for sign in _SIGNS):
        raise NotFound("is not a data folder, or nothing has been imported into it",
                       where=store.where, next_step=_OTHERWISE)
    return store
