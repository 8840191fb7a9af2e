"""Batches of MCAP's message records, as numpy arrays.

A message is a *head* of fixed layout (the record's framing and the payload's fixed fields) and a
*tail* of any length (the robots of a frame, the strings of an event). A whole chunk is assembled
from heads and tails, or split into them, without a Python loop over its messages.

Source: the MCAP specification, section Message.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.matches.records import FRAMING_BYTES, MESSAGE, McapRecords
from pitchlore.pipeline.numbers.arrays import I64, U8, Bools
from pitchlore.pipeline.numbers.kernels import njit

Heads = npt.NDArray[np.void]

#: First fields of every head: those of the record, and the first of a CDR payload.
RECORD = [
    ("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"),
    ("log_time", "<i8"), ("publish_time", "<i8"), ("encapsulation", "<u4"),
]


@dataclass(frozen=True, slots=True)
class Messages:
    """Messages of one channel.

    Attributes:
        heads: [K], dtype that begins with ``RECORD``; opcode and length are set by :func:`lay_out`.
        tails: uint8 [offsets[-1]], the tails one after another.
        offsets: int64 [K + 1]; the tail of message i is ``tails[offsets[i]:offsets[i + 1]]``.
    """

    heads: Heads
    tails: U8
    offsets: I64

    def __len__(self) -> int:
        return len(self.heads)

    def __getitem__(self, part: slice) -> Messages:
        """Consecutive messages; the step must be 1."""
        first, last, _ = part.indices(len(self))
        offsets = self.offsets[first:max(first, last) + 1]
        return Messages(self.heads[part], self.tails[offsets[0]:offsets[-1]], offsets - offsets[0])

    def tail_bytes(self) -> I64:
        """Length of each tail, int64 [K]."""
        return np.diff(self.offsets)

    def keep(self, mask: Bools) -> Messages:
        """Messages where ``mask`` [K] is true; the same object if all are."""
        if mask.all():
            return self
        offsets = np.concatenate(([0], np.cumsum(self.tail_bytes()[mask])))
        return Messages(self.heads[mask], self.tails[np.repeat(mask, self.tail_bytes())], offsets)


class Collector:
    """Collects the messages of one chunk after another; each is copied once.

    Args:
        head: layout of the fixed part of the records.
        capacity: most bytes of all records together; pages are used only as records come.
    """

    def __init__(self, head: np.dtype[np.void], capacity: int) -> None:
        self._head = head
        most = capacity // head.itemsize
        self._heads = np.empty((most, head.itemsize), dtype=np.uint8)
        self._tails = np.empty(capacity, dtype=np.uint8)
        self._offsets = np.empty(most + 1, dtype=np.int64)
        self._offsets[0] = self._count = 0

    def take(self, content: U8, records: McapRecords) -> None:
        """Take message records of ``content``; each body is at least as long as its part of the head."""
        if not len(records.bodies):
            return
        first, last = self._count, self._count + len(records.bodies)
        self._count = last
        offsets = self._offsets[first:last + 1]
        np.cumsum(records.lengths - (self._head.itemsize - FRAMING_BYTES), out=offsets[1:])
        offsets[1:] += offsets[0]
        _split(content, records.bodies - FRAMING_BYTES, offsets, self._heads[first:last], self._tails)

    def messages(self) -> Messages:
        """The messages taken so far, in that order."""
        offsets = self._offsets[:self._count + 1]
        heads = self._heads[:self._count].view(self._head).reshape(-1)
        return Messages(heads, self._tails[:offsets[-1]], offsets)


def lay_out(messages: Messages) -> tuple[U8, I64]:
    """Messages as MCAP records, one after another.

    Returns:
        The bytes, uint8 [starts[-1]], and the start of each record with the end of the last, int64 [K + 1].
    """
    heads, size = messages.heads, messages.heads.dtype.itemsize
    heads["opcode"] = MESSAGE
    heads["length"] = messages.tail_bytes() + (size - FRAMING_BYTES)
    starts = messages.offsets + size * np.arange(len(messages) + 1, dtype=np.int64)
    out = np.empty(int(starts[-1]), dtype=np.uint8)
    tails = np.asarray(messages.tails.data.toreadonly())  # one kind, so one compiled form
    _merge(bytes_of(heads).reshape(-1, size), tails, messages.offsets, out)
    return out, starts


def log_times(content: U8, records: McapRecords) -> I64:
    """Log times of message records, int64 [K]; 0 for a record too short to hold its channel and times."""
    times = np.zeros(len(records.bodies), dtype=np.int64)
    addressed = records.channels >= 0
    places = records.bodies[addressed, None] + np.arange(6, 14)
    times[addressed] = content[places].view("<i8").reshape(-1)
    return times


def sequence_numbers(content: U8, records: McapRecords) -> I64:
    """Sequence numbers of message records that hold one, int64 [K]."""
    numbers: I64 = content[records.bodies[:, None] + np.arange(2, 6)].view("<u4").reshape(-1).astype(np.int64)
    return numbers


@njit(cache=True, nogil=True)
def _merge(heads: U8, tails: U8, offsets: I64, out: U8) -> None:
    size = heads.shape[1]
    for k in range(heads.shape[0]):
        at, length = offsets[k] + k * size, offsets[k + 1] - offsets[k]
        _copy(heads[k], out[at:at + size])
        _copy(tails[offsets[k]:offsets[k + 1]], out[at + size:at + size + length])


@njit(cache=True, nogil=True)
def _split(content: U8, starts: I64, offsets: I64, heads: U8, tails: U8) -> None:
    size = heads.shape[1]
    for k in range(heads.shape[0]):
        at, length = starts[k], offsets[k + 1] - offsets[k]
        _copy(content[at:at + size], heads[k])
        _copy(content[at + size:at + size + length], tails[offsets[k]:offsets[k + 1]])


@njit(cache=True, nogil=True, inline="always")
def _copy(source: U8, target: U8) -> None:
    # indices of slices cannot be negative, so that this loop becomes wide moves: 20 times faster
    for j in range(len(source)):
        target[j] = source[j]


def bytes_of(array: npt.NDArray[np.void]) -> U8:
    """Bytes of an array, uint8 [bytes]; a view if the array is contiguous."""
    return np.ascontiguousarray(array).view(np.uint8)
