"""The command prune: remove superseded files, and old versions."""

from __future__ import annotations

from contextlib import suppress

from pitchlore.flows.commands.common import DEFAULTS, Common
from pitchlore.flows.commands.printing import console
from pitchlore.pipeline.base.errors import BadSettings, StorageFailed
from pitchlore.pipeline.engine.catalog import renew
from pitchlore.pipeline.engine.stages import STAGES
from pitchlore.pipeline.engine.thinning import thin


def prune(*, newest: int | None = None, one_in: int | None = None, common: Common = DEFAULTS) -> None:
    """Remove superseded files: those that no receipt names any more, and those that a kill left half-written.

    Args:
        newest: Remove versions of the knowledge and of policies, but for so many newest ones and those that
            something names: see docs/how-to/backup.md (default: remove none).
        one_in: With --newest: keep one in so many of the older ones, too, by their number (default: none).
        common: Options of every command.
    """
    for name, number in (("newest", newest), ("one-in", one_in)):
        if number is not None and (number < 1 or newest is None):
            raise BadSettings(
                "goes with --newest" if newest is None else "must be 1 or more", where=f"--{name}",
                next_step="Say how many newest versions are kept: --newest 30")
    store = common.existing
    with suppress(StorageFailed):  # what is removed may make room
        renew(store)
    swept = store.sweep()
    left = [path for noun in STAGES.receipted for path in store.prune(noun)]
    left += store.prune_versions()
    temporary = f", {swept} temporary ones of commands that were killed" if swept else ""
    console().print(f"{len(left)} superseded files removed{temporary}")
    if newest is not None:
        for noun, versions in thin(store, newest, one_in).items():
            console().print(f"{noun}: {len(versions)} versions removed, {len(store.versions(noun))} kept")
    renew(store)
