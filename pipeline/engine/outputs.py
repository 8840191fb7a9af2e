"""Outputs that stages are made from, and outputs that fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import polars as pl

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt
from pitchlore.schemas import Table


class refusing:  # noqa: N801 (a context manager is used like a function)
    """Put an output in quarantine if the body fails, and take it out if the body succeeds.

    An error that may vanish when tried again, or a missing input, puts nothing in quarantine.

    Args:
        store: store of the output.
        noun: the stage.
        name: name of the output.

    Raises:
        Exception: whatever the body raised.
    """

    def __init__(self, store: Store, noun: str, name: str) -> None:
        self._store, self._noun, self._name = store, noun, name

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if error is None:
            self._store.release(self._noun, self._name)
        elif (isinstance(error, Exception) and not isinstance(error, NotFound)
              and not getattr(error, "transient", False)):
            self._store.quarantine(self._noun, self._name, error)


def digests(receipts: Mapping[str, Sequence[Receipt]]) -> dict[str, str]:
    """SHA-256 of all files of some outputs, labelled ``noun/name/role``."""
    return {label: sha256 for each in receipts.values() for receipt in each
            for label, sha256 in receipt.digests().items()}


def need(store: Store, noun: str, name: str) -> Receipt:
    """The receipt of an output that a stage is made from.

    Raises:
        NotFound: if it has not been made.
    """
    receipt = store.receipt(noun, name)
    if receipt is None:
        raise NotFound(f"{noun} of {name} have not been made", where=store.where,
                       next_step=f"Run the stage {noun} first (`pitchlore run` runs them all)")
    return receipt


def table_of(store: Store, receipt: Receipt, schema: type[Table]) -> pl.DataFrame:
    """The table of an output or a version; errors as for :meth:`pipeline.store.Store.read_table`."""
    return store.read_table(receipt, schema.NAME, schema)


def find_match(store: Store, match: str) -> Receipt:
    """The receipt of the match with this id or beginning of an id.

    Raises:
        NotFound: if the id is empty, or fits no match or several. If it fits a match of a season, the error
            names the season's data folder.
        CorruptFile: if its receipt is damaged.
    """
    if not match:
        raise NotFound("no match is named", next_step="Give the id of a match, or its beginning")
    names = match_names(store)
    found = _called(names, match)
    if not found:
        for season in store.receipts("seasons"):
            own = store.root / season.details["store"]
            if _called(match_names(Store(own)), match):
                raise NotFound(f"is a match of the season {season.name}", where=match,
                               next_step=f"Add `--data {store.named(own)}`")
    if len(found) != 1:
        there = ", ".join((found or names)[:8]) or "none yet"
        what = "several matches begin so" if found else "there is no such match"
        raise NotFound(f"{what} (there are: {there})", where=match, next_step="Name one of them")
    return need(store, "matches", found[0])


def _called(names: Sequence[str], match: str) -> list[str]:
    """The match of this name, or else those whose names begin with it."""
    return [match] if match in names else [name for name in names if name.startswith(match)]


def match_names(store: Store) -> list[str]:
    """The ids of all matches in the store, sorted, those with a damaged receipt among them."""
    return store.names("matches")
