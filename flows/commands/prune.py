"""The command prune: remove superseded files."""

from __future__ import annotations

from flows.catalog import refresh
from flows.commands.common import DEFAULTS, Common
from flows.commands.printing import console
from flows.stages import STAGES


def prune(*, common: Common = DEFAULTS) -> None:
    """Remove superseded files: those that no receipt names any more.

    Args:
        common: Options of every command.
    """
    store = common.existing
    refresh(store)
    left = [path for noun in STAGES.receipted for path in store.prune(noun)]
    console().print(f"{len(left)} superseded files removed")
