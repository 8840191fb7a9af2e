"""The command prune: remove superseded files."""

from __future__ import annotations

from contextlib import suppress

from flows.catalog import renew
from flows.commands.common import DEFAULTS, Common
from flows.commands.printing import console
from flows.stages import STAGES
from pipeline.errors import StorageFailed


def prune(*, common: Common = DEFAULTS) -> None:
    """Remove superseded files: those that no receipt names any more.

    Args:
        common: Options of every command.
    """
    store = common.existing
    with suppress(StorageFailed):  # what is removed may make room
        renew(store)
    left = [path for noun in STAGES.receipted for path in store.prune(noun)]
    console().print(f"{len(left)} superseded files removed")
    renew(store)
