"""Find a match by the beginning of its id."""

from __future__ import annotations

from collections.abc import Iterable

from pitchlore.pipeline.base.errors import NotFound
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.receipts import Receipt


def chain_of(store: Store, match: str, *nouns: str) -> tuple[Receipt, dict[str, Receipt]]:
    """The receipts of a match's log and of the outputs made from it.

    Raises:
        NotFound: if the id fits no match or several, or if one of the nouns has not been made.
    """
    log = find_match(store, match)
    made = {noun: receipt for noun in nouns if (receipt := store.receipt(noun, log.name)) is not None}
    if len(made) < len(nouns):
        missing = ", ".join(sorted(set(nouns) - set(made)))
        raise NotFound(f"{log.name} has no {missing} yet", next_step="Run `pitchlore run` first")
    return log, made


def find_match(store: Store, match: str) -> Receipt:
    """The receipt of the match with this id or beginning of an id.

    Raises:
        NotFound: if the id is empty, or fits no match or several. If it fits a match of a season, the error
            names the season's data folder.
    """
    if not match:
        raise NotFound("no match is named", next_step="Give the id of a match, or its beginning")
    receipts = list(store.receipts("matches"))
    found = _called(receipts, match)
    if not found:
        for season in store.receipts("seasons"):
            own = store.root / season.details["store"]
            if _called(Store(own).receipts("matches"), match):
                raise NotFound(f"is a match of the season {season.name}", where=match,
                               next_step=f"Add `--data {store.named(own)}`")
    if len(found) != 1:
        names = ", ".join(r.name for r in (found or receipts)[:8]) or "none yet"
        what = "several matches begin so" if found else "there is no such match"
        raise NotFound(f"{what} (there are: {names})", where=match, next_step="Name one of them")
    return found[0]


def _called(receipts: Iterable[Receipt], match: str) -> list[Receipt]:
    """The receipts with this name, or else those whose names begin with it."""
    every = list(receipts)
    return [r for r in every if r.name == match] or [r for r in every if r.name.startswith(match)]
