"""Places where pieces of work are done, by the words that name them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.system import cores
from pitchlore.pipeline.engine.child import VARIABLE
from pitchlore.pipeline.engine.placement.executors import Executors, Here, executors
from pitchlore.pipeline.engine.placement.processes import Processes, WhenWorthwhile
from pitchlore.pipeline.settings import PLACE


class Place(NamedTuple):
    """Where pieces of work are done.

    Attributes:
        kind: threads, processes, dask:local or dask.
        width: number of threads, processes or workers; of a cluster, which has its own, 0.
        address: address of the scheduler of a cluster, else empty.
    """

    kind: str
    width: int
    address: str = ""


def place_of(word: str | None) -> Place:
    """The place that a word names: threads:N, processes:N, dask:local:N or dask://HOST:PORT.

    Args:
        word: without ``:N`` there are as many as this machine has cores. None: what the environment says in
            :data:`VARIABLE`, else processes.

    Raises:
        BadSettings: if it names none.
    """
    said = word or os.environ.get(VARIABLE) or "processes"
    found = PLACE.fullmatch(said)
    if found is None:
        raise BadSettings(
            f"{said!r} is no place to work", where="--on" if word else VARIABLE,
            next_step="Name threads:N, processes:N, dask:local:N or dask://HOST:PORT")
    if found["address"]:
        return Place("dask", 0, f"tcp://{found['address']}")
    return Place(found["kind"], int(found["width"] or cores()))


@contextmanager
def executors_at(word: str | None, root: Path, *, here: bool = False) -> Iterator[Executors]:
    """The executors of a place, while the body runs.

    Args:
        word: as for :func:`place_of`; None: processes, which start once the work is long enough.
        root: the data folder, which the workers of a cluster have to see.
        here: one of several processes is this; for work of little memory.

    Raises:
        BadSettings: if the word names no place.
        ClusterFailed: if a cluster cannot be reached, or its workers cannot do this work.
    """
    place = place_of(word)
    if place.kind == "threads":
        yield Here(place.width)
        return
    with ExitStack() as stack:
        if place.kind == "processes":
            chosen = here or word or os.environ.get(VARIABLE)
            own = Processes(place.width, here=here) if chosen else WhenWorthwhile(place.width)
            yield stack.enter_context(own)
        else:
            from pitchlore.pipeline.engine.placement.cluster import open_cluster  # noqa: PLC0415 (an extra)

            yield stack.enter_context(open_cluster(place.address, place.width, root))


@contextmanager
def placed(word: str | None, root: Path) -> Iterator[Executors]:
    """The executors of a place (:func:`executors_at`) as those of the running flow, while the body runs."""
    with executors_at(word, root) as own:
        token = executors.set(own)
        try:
            yield own
        finally:
            executors.reset(token)
