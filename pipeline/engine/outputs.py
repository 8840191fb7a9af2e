"""Outputs that stages are made from, and outputs that fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt


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
    found: dict[str, str] = {}
    for each in receipts.values():
        for receipt in each:
            found |= receipt.digests()
    return found


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


def match_names(store: Store) -> list[str]:
    """The ids of all matches in the store, sorted."""
    return [receipt.name for receipt in store.receipts("matches")]
