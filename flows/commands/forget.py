"""The command forget: remove a match and everything made from it."""

from __future__ import annotations

from pitchlore.flows.commands.common import DEFAULTS, Common
from pitchlore.flows.commands.printing import console
from pitchlore.pipeline.engine.catalog import forget_match, renew
from pitchlore.pipeline.engine.outputs import find_match


def forget(match: str, *, common: Common = DEFAULTS) -> None:
    """Remove a match and everything made from it. Knowledge and policies keep what they learned from it.

    Args:
        match: Id of the match, or its beginning.
        common: Options of every command.
    """
    store = common.existing
    removed = forget_match(store, match)
    if not removed:
        match = find_match(store, match).name
        removed = forget_match(store, match)
    for record in store.quarantined():
        if record.name == match:
            store.release(record.noun, record.name)
    console().print(f"{match}: {removed} outputs removed; the next run emits knowledge without it")
    renew(store)
