"""Work that tests of buckets do, and what another machine does meanwhile."""

import os
import re
from collections.abc import Callable
from pathlib import Path

from support import at_once

from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.store import Store
from pitchlore.pipeline.store.work import Made, Work

ROUNDS = int(os.environ.get("PITCHLORE_ROUNDS", "1"))


def brought(store: Store, recordings: Path) -> None:
    """Import the recordings, and run every stage."""
    store.catch_up()
    for file in sorted(recordings.iterdir()):
        take_in(store, Recording(file=file))
    at_once.run(store)


def plain(objects: dict[str, bytes]) -> dict[str, bytes]:
    """The objects of a bucket by the names of a local folder's files, without the log of runs."""
    return {re.sub(r"(/v\d{4,}/)[0-9a-f]{12}\.", r"\1", key): data for key, data in objects.items()
            if not key.startswith("runs/")}


def work(noun: str = "goals", name: str = "m-1", version: int = 1) -> Work:
    return Work(noun=noun, name=name, settings={}, version=version)


def made(text: str) -> Made:
    return Made(blobs={"note": ("txt", text.encode())})


def between(monkeypatch, mirror, method: str, happens: Callable[[], object]) -> None:
    """Let something happen before a mirror's next call of a method."""
    before = getattr(mirror, method)

    def call(*arguments, **named):
        monkeypatch.setattr(mirror, method, before)
        happens()
        return before(*arguments, **named)

    monkeypatch.setattr(mirror, method, call)
