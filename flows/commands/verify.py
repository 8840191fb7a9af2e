"""The command verify: check the data folder, restore what is damaged."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

from pitchlore.flows.commands.common import DEFAULTS, Common, Json, UserPath
from pitchlore.flows.commands.printing import console, print_json
from pitchlore.pipeline.base.errors import CorruptFile
from pitchlore.pipeline.engine.catalog import distrust
from pitchlore.pipeline.engine.verify import backup_at, mend, verify_all, verify_knowledge
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.verification import Verification


def verify(*, restore_from: UserPath | None = None, json: Json = False, common: Common = DEFAULTS) -> None:
    """Check every byte: logs, outputs, receipts, versions, what they were made from, the seasons' folders.

    Args:
        restore_from: A copy of the data folder. Files that are damaged here and whole there are restored.
        json: Print JSON.
        common: Options of every command.
    """
    _conclude(verify_all, restore_from, json=json, common=common)


def verify_versions(
    version: int | None, restore_from: Path | None, *, json: bool, common: Common
) -> None:
    """Check the versions of the knowledge, or one of them, as ``kb verify`` does."""
    _conclude(lambda store: verify_knowledge(store, version), restore_from, json=json, common=common)


def _conclude(
    check: Callable[[Store], Verification], restore_from: Path | None, *, json: bool, common: Common
) -> None:
    """Check, restore, print what was found, and exit with 1 if a problem is left."""
    store = common.existing
    backup = None if restore_from is None else backup_at(restore_from)
    if backup is not None:
        store.sweep()  # half files of one who was killed while he restored
    begun = time.perf_counter()
    found = check(store)
    seconds = time.perf_counter() - begun
    if any(isinstance(damage.error, CorruptFile) for damage in found.damages):
        distrust(store)
    left, restored = found, list[str]()
    while backup is not None and (mended := mend(left, store, backup)):
        restored += map(store.named, mended)
        left = check(store)  # a manifest that was restored names files that may be damaged, too
    if json:
        print_json({"files": left.files, "bytes": left.size, "unsealed": left.unsealed,
                    "restored": restored, "problems": left.problems})
        sys.exit(1 if left.problems else 0)
    out = console()
    for path in restored:
        out.print(f"{path}: restored from {backup.where if backup else ''}", soft_wrap=True)
    for line in left.problems:
        out.print(line, soft_wrap=True)
    if left.unsealed:
        out.print(f"{left.unsealed} receipts of an earlier version have no checksum of themselves")
    speed = found.size / 1e6 / max(seconds, 1e-3)
    out.print(f"{left.files} files, {left.size / 1e6:.1f} MB checked ({speed:.0f} MB/s), "
              f"{len(restored)} restored, {len(left.problems)} problems")
    sys.exit(1 if left.problems else 0)
