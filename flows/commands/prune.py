"""The command prune: superseded files removed."""

from __future__ import annotations

from flows.catalog import RECEIPTED, refresh
from flows.commands.common import DEFAULTS, Common
from flows.commands.printing import console


def prune(*, common: Common = DEFAULTS) -> None:
    """Remove the files of earlier settings or code that nothing refers to any more.

    Args:
        common: Options of every command.
    """
    store = common.existing
    refresh(store)
    left = [path for noun in RECEIPTED for path in store.prune(noun)]
    console().print(f"{len(left)} superseded files removed")
