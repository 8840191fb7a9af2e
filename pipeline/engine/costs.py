"""The cost of work: seconds, and bytes read and written. No receipt and no output holds any of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

from pydantic import BaseModel

from pitchlore.pipeline.store.meter import metered


class Spent(NamedTuple):
    """Cost of a piece of work. It is measured where the piece is done, and comes back with its result.

    Attributes:
        seconds: wall-clock time.
        bytes_in: read from the data folder, and of recordings; a table that an earlier stage of the same
            match has read is not read again.
        bytes_out: written to the data folder.
    """

    seconds: float = 0.0
    bytes_in: int = 0
    bytes_out: int = 0

    def plus(self, other: Spent) -> Spent:
        """The sum of both, as of a piece that was tried twice."""
        return Spent(self.seconds + other.seconds, self.bytes_in + other.bytes_in,
                     self.bytes_out + other.bytes_out)


class Cost(BaseModel):
    """Cost of a stage in a run: the sum over its pieces, wherever they were done.

    Attributes:
        pieces: outputs that were worked on.
        seconds: wall-clock time, piece by piece: pieces that are done at once count each.
        bytes_in: read.
        bytes_out: written.
        slowest: name of the piece that took longest, None if there was no piece.
        slowest_s: its seconds.
    """

    pieces: int = 0
    seconds: float = 0.0
    bytes_in: int = 0
    bytes_out: int = 0
    slowest: str | None = None
    slowest_s: float = 0.0

    def add(self, name: str, spent: Spent) -> None:
        """Count a piece."""
        self.include(Cost(pieces=1, seconds=spent.seconds, bytes_in=spent.bytes_in, bytes_out=spent.bytes_out,
                          slowest=name, slowest_s=spent.seconds))

    def include(self, other: Cost) -> None:
        """Count the pieces of another cost, too."""
        if other.slowest is not None and (self.slowest is None or other.slowest_s > self.slowest_s):
            self.slowest, self.slowest_s = other.slowest, other.slowest_s
        self.pieces += other.pieces
        self.seconds += other.seconds
        self.bytes_in += other.bytes_in
        self.bytes_out += other.bytes_out


@contextmanager
def spending() -> Iterator[Callable[[], Spent]]:
    """Measure the body: a function that says what it has cost until now."""
    begun = time.perf_counter()
    with metered() as meter:
        yield lambda: Spent(time.perf_counter() - begun, meter.read, meter.written)


class Costed(NamedTuple):
    """A result, and what it has cost."""

    result: Any
    spent: Spent


def costed(function: Callable[..., Any], arguments: Mapping[str, Any]) -> Costed:
    """Do a piece of work, and measure it."""
    with spending() as spent:
        result = function(**arguments)
        return Costed(result, spent())


def mebibytes(size: int) -> str:
    """A size for people, in MiB."""
    return f"{size / (1 << 20):,.1f}"
