"""Protocol Buffers' wire format: the fields of many messages at once, as columns.

Source: the encoding guide of Protocol Buffers (protobuf.dev, "Encoding"). A field is a tag, which is its
number and its wire type, and a value. Which numbers mean what is in ``fields``.

The first fields of all messages are read together, then the second ones, and so on: messages of a log have
few fields each, and there are many of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.numbers.arrays import F64, I64, U8, Bools

#: Wire types. Groups (3 and 4) are not used by these messages; they count as damage.
VARINT, FIXED64, SPAN, FIXED32 = 0, 1, 2, 5
#: A message that has more fields is damaged. A frame has one a body, and few besides.
MOST_FIELDS = 512
_LONGEST_VARINT = 10
_KNOWN = np.isin(np.arange(8), (VARINT, FIXED64, SPAN, FIXED32))


class Fields(NamedTuple):
    """Fields of messages; those of one message are in their order.

    Attributes:
        of: int64 [F], index of the message that each is of.
        number: int64 [F], the field's number.
        kind: int64 [F], its wire type.
        value: int64 [F], its value if it is a varint, else where its value begins.
        end: int64 [F], where the next field begins, which is the end of a SPAN.
    """

    of: I64
    number: I64
    kind: I64
    value: I64
    end: I64

    def at(self, rows: I64) -> Fields:
        """The fields at some rows."""
        return Fields(*(column[rows] for column in self))

    def ordered(self) -> Fields:
        """The fields ordered by message."""
        return self.at(np.argsort(self.of, kind="stable"))

    def spans(self, *numbers: int) -> Fields:
        """The spans with one of these numbers."""
        chosen = self.kind == SPAN
        chosen &= np.logical_or.reduce([self.number == number for number in numbers])
        return self.at(np.flatnonzero(chosen))

    def varints(self, number: int) -> tuple[I64, I64]:
        """Messages and values of the varints with a number, [K] each."""
        rows = np.flatnonzero((self.number == number) & (self.kind == VARINT))
        return self.of[rows], self.value[rows]

    def reals(self, data: U8, number: int) -> tuple[I64, F64]:
        """Messages and values of the floats and doubles with a number, [K] each.

        The geometry of the game controller had doubles before it had floats, so the wire type decides.
        """
        rows = np.flatnonzero((self.number == number) & ((self.kind == FIXED32) | (self.kind == FIXED64)))
        at, kind = self.value[rows], self.kind[rows]
        values = np.empty(len(rows))
        for width, dtype in ((FIXED32, "<f4"), (FIXED64, "<f8")):
            these = kind == width
            values[these] = _gathered(data, at[these], dtype)
        return self.of[rows], values


def fields(data: U8, start: I64, end: I64) -> tuple[Fields, Bools]:
    """Fields of messages.

    Args:
        data: uint8 [N], bytes that hold the messages.
        start: int64 [M], where each begins.
        end: int64 [M], where it ends (exclusive).

    Returns:
        The fields, of a damaged message those before the damage; and which messages are damaged, bool [M].
    """
    damaged = np.zeros(len(start), np.bool_)
    steps: list[Fields] = []
    open_ = np.flatnonzero(start < end)
    at = start[open_]
    while len(open_):
        if len(steps) == MOST_FIELDS:
            damaged[open_] = True
            break
        found, sound = _next(data, open_, at, end[open_])
        damaged[open_[~sound]] = True
        steps.append(found)
        more = found.end < end[found.of]
        open_, at = found.of[more], found.end[more]
    if not steps:
        return Fields(*(np.empty(0, np.int64) for _ in Fields._fields)), damaged
    return Fields(*(np.concatenate(columns) for columns in zip(*steps, strict=True))), damaged


def _next(data: U8, of: I64, at: I64, end: I64) -> tuple[Fields, Bools]:
    """The next field of each message: those that can be read, and which can."""
    tag, value = _varints(data, at, end)
    number, kind = tag >> 3, tag & 7
    sound = (value >= 0) & (number > 0)
    after = value.copy()
    for fixed, size in ((FIXED64, 8), (FIXED32, 4)):
        after[kind == fixed] += size
    counted = np.flatnonzero(sound & ((kind == VARINT) | (kind == SPAN)))
    reported, content = _varints(data, value[counted], end[counted])
    span = kind[counted] == SPAN
    fits = (content >= 0) & (~span | ((reported >= 0) & (reported <= end[counted] - content)))
    value[counted] = np.where(span, content, reported)
    after[counted] = np.where(span, content + np.where(fits, reported, 0), content)
    sound[counted] &= fits
    sound &= (after <= end) & _KNOWN[kind]
    found = Fields(of, number, kind, value, after)
    return found if sound.all() else found.at(np.flatnonzero(sound)), sound


def _varints(data: U8, at: I64, end: I64) -> tuple[I64, I64]:
    """Varints as signed 64-bit integers, and where the next bytes are; -1 for one without an end."""
    there = at < end
    first = data[np.where(there, at, 0)] if len(data) else np.zeros(len(at), np.uint8)
    value = (first & 0x7F).astype(np.uint64)
    after = np.where(there & (first < 0x80), at + 1, -1)
    open_ = np.flatnonzero(there & (first >= 0x80))
    for i in range(1, _LONGEST_VARINT):
        open_ = open_[at[open_] + i < end[open_]]
        if not len(open_):
            break
        byte = data[at[open_] + i].astype(np.uint64)
        value[open_] |= (byte & np.uint64(0x7F)) << np.uint64(7 * i)
        last = byte < 0x80
        after[open_[last]] = at[open_[last]] + i + 1
        open_ = open_[~last]
    return value.view(np.int64), after


def _gathered(data: U8, at: I64, dtype: str) -> F64:
    """Numbers of a type that begin at these places, as float64."""
    raw = data[at[:, None] + np.arange(np.dtype(dtype).itemsize)]
    with np.errstate(invalid="ignore"):  # a broken number may be a NaN that signals
        found: F64 = raw.view(dtype)[:, 0].astype(np.float64)
    return found


def texts(data: U8, start: I64, end: I64) -> list[bytes]:
    """The bytes of some spans."""
    return [data[a:b].tobytes() for a, b in zip(start.tolist(), end.tolist(), strict=True)]
