"""The command prune: remove superseded files."""

from __future__ import annotations

from contextlib import suppress

from pitchlore.flows.commands.common import DEFAULTS, Common
from pitchlore.flows.commands.printing import console
from pitchlore.pipeline.base.errors import StorageFailed
from pitchlore.pipeline.engine.catalog import renew
from pitchlore.pipeline.engine.stages import STAGES


def prune(*, common: Common = DEFAULTS) -> None:
    """Remove superseded files: those that no receipt names any more, and those that a kill left half-written.

    Args:
        common: Options of every command.
    """
    store = common.existing
    with suppress(StorageFailed):  # what is removed may make room
        renew(store)
    swept = store.sweep()
    left = [path for noun in STAGES.receipted for path in store.prune(noun)]
    left += store.prune_versions()
    temporary = f", {swept} temporary ones of commands that were killed" if swept else ""
    console().print(f"{len(left)} superseded files removed{temporary}")
    renew(store)
