"""Protocol Buffers' wire format: the fields of many messages at once, as columns.

Source: the encoding guide of Protocol Buffers (protobuf.dev, "Encoding"). A field is a tag, which is its
number and its wire type, and a value. Which numbers mean what is in ``fields``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.numbers.arrays import F64, I64, U8, Bools
from pitchlore.pipeline.numbers.kernels import njit

#: Wire types. Groups (3 and 4) are not used by these messages; they count as damage.
VARINT, FIXED64, SPAN, FIXED32 = 0, 1, 2, 5
#: A message that has more fields is damaged. A frame has one a body, and few besides.
MOST_FIELDS = 512
_LONGEST_VARINT = 10


class Fields(NamedTuple):
    """Fields of messages, in the order of the messages and of their fields.

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
    assert not len(start) or (start.min() >= 0 and end.max() <= len(data)), "messages lie in the data"
    data, start, end = data.view(), np.asarray(start, np.int64), np.asarray(end, np.int64)  # [] has floats
    data.flags.writeable = False  # one kind of array, one compiled function
    damaged = np.zeros(len(start), np.bool_)
    found = np.empty((len(Fields._fields), _read(data, start, end, _NOWHERE, damaged)), np.int64)
    _read(data, start, end, found, damaged)
    return Fields(*found), damaged


_NOWHERE = np.empty((len(Fields._fields), 0), np.int64)


@njit(cache=True, nogil=True)
def _read(data: U8, start: I64, end: I64, into: I64, damaged: Bools) -> int:
    """Count the fields, write those for which there is room, and mark the damaged messages."""
    count = 0
    for message in range(len(start)):
        at, stop, first = start[message], end[message], count
        while at < stop:
            tag, value = _varint(data, at, stop)
            kind, after = tag & 7, np.int64(-1)
            if value < 0 or tag < 8 or count - first == MOST_FIELDS:
                damaged[message] = True
                break
            if kind == VARINT:
                value, after = _varint(data, value, stop)
            elif kind == SPAN:
                size, value = _varint(data, value, stop)
                if value >= 0 and 0 <= size <= stop - value:
                    after = value + size
            elif kind == FIXED64:
                after = value + 8
            elif kind == FIXED32:
                after = value + 4
            if after < 0 or after > stop:
                damaged[message] = True
                break
            if count < into.shape[1]:
                into[0, count], into[1, count], into[2, count] = message, tag >> 3, kind
                into[3, count], into[4, count] = value, after
            count += 1
            at = after
    return count


@njit(cache=True, nogil=True)
def _varint(data: U8, at: np.int64, stop: np.int64) -> tuple[np.int64, np.int64]:
    """Varint as a signed 64-bit integer, and where the next byte is; -1 for one without an end."""
    value = np.uint64(0)
    for i in range(_LONGEST_VARINT):
        if at + i >= stop:
            break
        byte = np.uint64(data[at + i])
        value |= (byte & np.uint64(0x7F)) << np.uint64(7 * i)
        if byte < 0x80:
            return np.int64(value), np.int64(at + i + 1)
    return np.int64(0), np.int64(-1)


def _gathered(data: U8, at: I64, dtype: str) -> F64:
    """Numbers of a type that begin at these places, as float64."""
    raw = data[at[:, None] + np.arange(np.dtype(dtype).itemsize)]
    with np.errstate(invalid="ignore"):  # a broken number may be a NaN that signals
        found: F64 = raw.view(dtype)[:, 0].astype(np.float64)
    return found


def texts(data: U8, start: I64, end: I64) -> list[bytes]:
    """The bytes of some spans."""
    return [data[a:b].tobytes() for a, b in zip(start.tolist(), end.tolist(), strict=True)]
