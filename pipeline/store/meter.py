"""Bytes that a piece of work reads from a data folder, and writes to it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass
class Meter:
    """Bytes of whole files.

    Attributes:
        read: bytes of inputs and recordings; receipts are not counted.
        written: bytes of outputs, their receipts and versions. A file that is there already is not written.
    """

    read: int = 0
    written: int = 0


_meter: ContextVar[Meter | None] = ContextVar("meter", default=None)


@contextmanager
def metered() -> Iterator[Meter]:
    """The bytes that this thread reads and writes while the body runs."""
    meter = Meter()
    token = _meter.set(meter)
    try:
        yield meter
    finally:
        _meter.reset(token)


def count_read(size: int) -> None:
    """Count bytes that were read, if somebody wants to know."""
    meter = _meter.get()
    if meter is not None:
        meter.read += size


def count_written(size: int) -> None:
    """Count bytes that were written, if somebody wants to know."""
    meter = _meter.get()
    if meter is not None:
        meter.written += size
