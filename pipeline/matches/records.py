"""MCAP's records as bytes: found, walked over, and encoded.

Nothing here trusts its input: a length that leads out of the file is found before it is used.

Source: the MCAP specification, section Records.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.records import McapRecord

from pitchlore.pipeline.numbers.arrays import I64, U8, Bools
from pitchlore.pipeline.numbers.kernels import njit

MESSAGE, DATA_END = 0x05, 0x0F
#: Opcode and length, before every record's body.
FRAMING_BYTES = 9
#: Channel, sequence and two times, before a message's content.
ADDRESS_BYTES = 22


class McapRecords(NamedTuple):
    """Records in order, [K] each.

    Attributes:
        opcodes: uint8.
        channels: int64, of message records; -1 for others, and for messages too short for channel and times.
        bodies: int64, start of each body.
        lengths: int64, of each body in bytes.
    """

    opcodes: U8
    channels: I64
    bodies: I64
    lengths: I64

    def keep(self, mask: Bools | slice) -> McapRecords:
        """The records where ``mask`` [K] is true."""
        return McapRecords(self.opcodes[mask], self.channels[mask], self.bodies[mask], self.lengths[mask])


def encoded(*records: McapRecord) -> bytes:
    """Bytes of records that hold no messages, one after another."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


def as_array(data: bytes | memoryview) -> U8:
    """Bytes as a read-only array, uint8; they are not copied."""
    array = np.frombuffer(data, dtype=np.uint8)
    array.flags.writeable = False
    return array


def find_records(
    content: U8, start: int, stop: int, landmarks: Sequence[int]
) -> tuple[McapRecords, int, list[int]]:
    """Records in ``content[start:stop]``, up to and including the DataEnd, also after damaged ones.

    Args:
        content: uint8, the whole file.
        start: start of the first record.
        stop: end of the records at the latest, exclusive.
        landmarks: known starts of records, ascending; after damage the search goes on at the next one.

    Returns:
        The records, the end of the last one, and the starts of damaged ones.
    """
    parts, damaged = [], []
    ahead = np.array([place for place in landmarks if start < place < stop], dtype=np.int64)
    while True:
        records, end, passed = _walk(content, start, stop, ahead)
        starts = records.bodies - FRAMING_BYTES
        whole = len(starts)
        ahead = ahead[passed:]  # without those that are starts of records
        # a record that covers a landmark has a wrong length; a DataEnd before one is none, for records follow
        if len(ahead) and whole and (ahead[0] < end or records.opcodes[-1] == DATA_END):
            whole -= 1
        parts.append(records.keep(slice(0, whole)))
        if not len(ahead):
            break
        damaged.append(int(starts[whole]) if whole < len(starts) else end)
        start, ahead = int(ahead[0]), ahead[1:]
    return McapRecords(*map(np.concatenate, zip(*parts, strict=True))), end, damaged


def walk(content: U8, start: int, stop: int) -> tuple[McapRecords, int]:
    """Records in ``content[start:stop]``, up to and including a DataEnd.

    Returns:
        The records, and the end of the last whole one. It is less than ``stop`` after a DataEnd, and
        before bytes that are no whole record.
    """
    records, end, _ = _walk(content, start, stop, _NOWHERE)
    return records, end


_NOWHERE = np.empty(0, dtype=np.int64)


@njit(cache=True, nogil=True)
def _walk(content: U8, start: int, stop: int, landmarks: I64) -> tuple[McapRecords, int, int]:
    """As :func:`walk`; it also ends after a record that covers the next landmark.

    So a search walks over each byte at most twice, however many landmarks a hostile file has.

    Returns:
        The records, the end of the last one, and how many landmarks were starts of records.
    """
    count, end, passed = 0, np.int64(start), 0
    while end + FRAMING_BYTES <= stop and (passed == len(landmarks) or landmarks[passed] >= end):
        length = _uint64(content, end + 1)
        if length < 0 or length > stop - end - FRAMING_BYTES:
            break
        while passed < len(landmarks) and landmarks[passed] == end:
            passed += 1
        opcode = content[end]
        count += 1
        end += FRAMING_BYTES + length
        if opcode == DATA_END:
            break
    opcodes = np.empty(count, dtype=np.uint8)
    channels = np.empty(count, dtype=np.int64)
    bodies = np.empty(count, dtype=np.int64)
    lengths = np.empty(count, dtype=np.int64)
    at = np.int64(start)
    for k in range(count):
        opcodes[k], bodies[k], lengths[k] = content[at], at + FRAMING_BYTES, _uint64(content, at + 1)
        channels[k] = -1
        if opcodes[k] == MESSAGE and lengths[k] >= ADDRESS_BYTES:
            channels[k] = np.int64(content[at + 9]) | (np.int64(content[at + 10]) << 8)
        at += FRAMING_BYTES + lengths[k]
    return McapRecords(opcodes, channels, bodies, lengths), int(end), passed


@njit(cache=True, nogil=True, inline="always")
def _uint64(content: U8, at: np.int64) -> np.int64:
    # a value of 2**63 or more comes out negative
    value = np.int64(0)
    for j in range(8):
        value |= np.int64(content[at + j]) << (8 * j)
    return value
