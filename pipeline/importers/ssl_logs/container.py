"""The container of an SSL log: its header, and messages one after another, whatever they say.

Source: the README of RoboCup-SSL/ssl-logtools, and RoboCup-SSL/ssl-go-tools (``pkg/persistence``). All
integers are big-endian. The header is ``SSL_LOG_FILE`` and an int32 version, 0 or 1. A message is an int64
receive time in ns, an int32 type, an int32 size and that many bytes. A log may end with an index of its
messages, of type 6.
"""

from __future__ import annotations

import re
import struct
from array import array
from collections.abc import Generator, Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.numbers.arrays import I32, I64, U8, Bools

MAGIC = b"SSL_LOG_FILE"
HEADER_BYTES = len(MAGIC) + 4
VERSIONS = (0, 1)

#: Types of messages.
VISION_2010, REFEREE, VISION_2014, TRACKER, INDEX = 2, 3, 4, 5, 6
#: A message of another type may be of a later version of the tools, but not of any number.
_LAST_TYPE = 15

_HEAD = 16
_HEAD_OF = struct.Struct(">qii")
#: Largest message. Each came in one UDP packet, which has less than 64 KiB; an index has no such bound.
_LARGEST = 1 << 16
#: What an index has besides the 8 bytes for each message.
_INDEX_EXTRA = 64
#: Receive times of one log are within a day of each other.
_DAY_NS = 86_400 * 10**9
#: Bytes that are cut into messages at once.
_BATCH = 1 << 20

#: Logs in one file, and damaged places, with which it is no recording of a match any more.
_MOST_LOGS, _MOST_PLACES = 1_000, 10_000
#: Places at which a message may begin that are looked at in one step.
_LOOKED_AT = 1_024
#: Columns of ``Batch.packets``.
ORDER, RECEIVED = range(2)

#: Why :func:`_cut` stops.
_MORE, _DAMAGE, _NEXT_LOG, _INDEX_HERE = range(4)


class Batch(NamedTuple):
    """Some messages of a log, in its order.

    Attributes:
        data: uint8 [N], bytes that hold them.
        packets: int64 [M, 2], which message of the file each is, from 0, and when it was received, ns.
        kind: int32 [M], its type.
        start, end: int64 [M], where its content is in ``data``, without its head; end is exclusive.
        part: number of their log in the file, from 0.
    """

    data: U8
    packets: I64
    kind: I32
    start: I64
    end: I64
    part: int

    def of(self, *kinds: int) -> Batch:
        """The messages of these types."""
        chosen = np.isin(self.kind, kinds)
        return self._replace(
            packets=self.packets[chosen], kind=self.kind[chosen], start=self.start[chosen],
            end=self.end[chosen],
        )


class Span(NamedTuple):
    """Messages of a file: numbers of the first and of the one after the last."""

    first: int
    end: int


#: All messages.
WHOLE = Span(0, 1 << 62)


def within(batches: Iterable[Batch], span: Span) -> Iterator[Batch]:
    """The messages of batches that are in a span; those after it are not read."""
    for batch in batches:
        first, last = batch.packets[[0, -1], ORDER].tolist()
        if first >= span.end:
            return
        if last < span.first:
            continue
        if span.first <= first and last < span.end:
            yield batch
            continue
        low, high = np.searchsorted(batch.packets[:, ORDER], span).tolist()
        yield batch._replace(packets=batch.packets[low:high], kind=batch.kind[low:high],
                             start=batch.start[low:high], end=batch.end[low:high])


class UnusableLogError(Exception):
    """A container is so damaged that it is not read; the message says how."""


@dataclass(slots=True)
class ContainerFlaws:
    """Flaws of a container, as far as it was read.

    Attributes:
        skipped: for each place, receive time of the last message before (None at the start), and number of
            bytes in which no message was found.
        cut: bytes of an incomplete message at the end of the file.
        parts: receive time of the last message before each further log of the file.
        versions: versions of each log.
    """

    skipped: list[tuple[int | None, int]] = field(default_factory=list)
    cut: int = 0
    parts: list[int | None] = field(default_factory=list)
    versions: list[int] = field(default_factory=list)


class Container:
    """Messages of a log, read once from the pieces of its bytes; ``damage`` grows meanwhile.

    Memory does not depend on the log's length: bytes are dropped when their messages were given.

    Args:
        pieces: the log's bytes in order; a piece may end anywhere.

    Attributes:
        damage: flaws found so far.
        messages: number of messages so far, without indexes.
    """

    def __init__(self, pieces: Iterable[bytes]) -> None:
        self.damage = ContainerFlaws()
        self.messages = 0
        self._pieces = iter(pieces)
        self._data = b""  # bytes that are not used up,
        self._offset = 0  # and where in the file they begin
        self._ended = False
        self._last: int | None = None  # receive time of the last message
        self._tears = 0  # times that messages had to be found again

    def batches(self) -> Iterator[Batch]:
        """All messages but indexes, in the order of the file.

        Raises:
            UnusableLogError: if it is damaged at too many places.
        """
        self._fill()
        at = self._header(0)
        while True:
            at = yield from self._present(at)
            if self._ended:
                return
            self._data = self._data[at:]
            self._offset += at
            at = 0
            self._fill()

    def _fill(self) -> None:
        parts, size = [self._data], len(self._data)
        while size < _BATCH + _LARGEST and not self._ended:
            piece = next(self._pieces, None)
            if piece is None:
                self._ended = True
            else:
                parts.append(piece)
                size += len(piece)
        self._data = b"".join(parts)

    def _header(self, at: int) -> int:
        """Take up the header of a log; returns where its messages begin."""
        if len(self.damage.versions) == _MOST_LOGS:
            raise UnusableLogError(f"has more than {_MOST_LOGS} logs in it")
        (version,) = struct.unpack_from(">i", self._data.ljust(HEADER_BYTES, b"\0"), at + len(MAGIC))
        self.damage.versions.append(version)
        return at + HEADER_BYTES

    def _present(self, at: int) -> Generator[Batch, None, int]:
        """Messages from ``at`` on, as far as the present bytes have them; returns where they end."""
        likely: _Likely | None = None
        heads = array("q")  # of the messages that were not given yet, as ``_cut`` has them
        while True:
            before = len(heads)
            at, why = _cut(self._data, at, self._offset, heads)
            if len(heads) > before:
                self._last = heads[-4]
            left = len(self._data) - at
            if why == _INDEX_HERE:
                yield from self._given(heads)
                at = self._after_index(at)
                likely = None
            elif why == _NEXT_LOG and left >= HEADER_BYTES:
                yield from self._given(heads)
                self.damage.parts.append(self._last)
                at = self._header(at)
            elif left == 0 or (why != _DAMAGE and not self._ended):
                yield from self._given(heads)
                return at
            else:
                # the last head may be the damaged one, and its length may have taken in whole messages
                first = heads[-2] if len(heads) > before and why == _DAMAGE else at + 1
                likely = likely or _Likely(self._data, self._ended)
                found = likely.after(first, self._last or 0)
                if found < 0 and why != _DAMAGE:
                    self.damage.cut += left
                    yield from self._given(heads)
                    return len(self._data)
                found = found if found >= 0 else len(self._data) - (0 if self._ended else _HEAD - 1)
                self._skip(max(found - at, 0))
                at = found

    def _given(self, heads: array[int]) -> Iterator[Batch]:
        """The batch of some messages, if there are any; they are given up."""
        if not heads:
            return
        columns = np.array(heads, dtype=np.int64).reshape(-1, 4)
        numbers = np.arange(self.messages, self.messages + len(columns), dtype=np.int64)
        self.messages += len(columns)
        del heads[:]
        yield Batch(
            np.frombuffer(self._data, dtype=np.uint8), np.column_stack((numbers, columns[:, 0])),
            columns[:, 1].astype(np.int32), columns[:, 2], columns[:, 3], len(self.damage.parts),
        )

    def _after_index(self, at: int) -> int:
        """Leave out an index, which may be longer than the present bytes; returns where it ends."""
        (size,) = struct.unpack_from(">i", self._data, at + 12)
        end: int = at + _HEAD + size
        while len(self._data) < end:
            piece = next(self._pieces, None)
            if piece is None:
                self._ended = True
                self.damage.cut += len(self._data) - min(at, len(self._data))
                return len(self._data)
            end -= len(self._data)
            self._offset += len(self._data)
            self._data, at = piece, 0
        return end

    def _skip(self, size: int) -> None:
        """Note a place without a message; one that goes on is one place."""
        skipped = self.damage.skipped
        self._tears += 1
        if self._tears > _MOST_PLACES:
            raise UnusableLogError(f"is damaged at more than {_MOST_PLACES} places")
        if skipped and skipped[-1][0] == self._last:
            size += skipped.pop()[1]
        skipped.append((self._last, size))


def _cut(data: bytes, at: int, offset: int, heads: array[int]) -> tuple[int, int]:
    """Append the heads of the whole messages from ``at`` on.

    Args:
        data: N bytes.
        at: where a message begins.
        offset: where in the file ``data`` begins.
        heads: receives of each when it was received (ns), its type, and where its content begins and ends.

    Returns:
        Where the first message begins that is not among them; and why it is not.
    """
    why = _MORE
    last = len(data) - _HEAD
    unpack = _HEAD_OF.unpack_from
    while at <= last:
        received, kind, size = unpack(data, at)
        if not 0 <= kind <= _LAST_TYPE or kind == INDEX or not 0 <= size <= _LARGEST:
            index = kind == INDEX and 0 <= size <= (offset + at) // 2 + _INDEX_EXTRA
            why = _INDEX_HERE if index else _NEXT_LOG if data.startswith(MAGIC, at) else _DAMAGE
            break
        end = at + _HEAD + size
        if end > len(data):
            break
        heads.extend((received, kind, at + _HEAD, end))
        at = end
    return at, why


class _Likely:
    """Places in some bytes where a message may begin: found once, asked after each damage.

    A message seems to begin where a known type and the size of some content stand, and where it ends another
    one seems to begin, or a log. A message that ends with the file needs no follower. If the file goes on,
    nor does one that ends beyond these bytes.

    Args:
        data: N bytes.
        ended: whether the file ends with them.
    """

    def __init__(self, data: bytes, ended: bool) -> None:
        octets = np.frombuffer(data, dtype=np.uint8)
        kind = octets[_HEAD - 5 : max(len(octets) - 4, 0)]  # last byte of the type, for a head at each place
        places = np.flatnonzero((kind >= VISION_2010) & (kind <= TRACKER))
        heads = octets[places[:, None] + np.arange(_HEAD)]
        size = heads[:, 12:].copy().view(">i4")[:, 0]
        chosen = (heads[:, 8:11] == 0).all(axis=1) & (size > 0) & (size <= _LARGEST)
        received = heads[chosen, :8].copy().view(">i8")[:, 0].astype(np.int64)
        places, after = places[chosen], places[chosen] + _HEAD + size[chosen]
        logs = np.array([found.start() for found in re.finditer(MAGIC, data)], dtype=np.int64)
        follows = np.isin(after, places) | np.isin(after, logs)
        cut = after + _HEAD > len(data)
        sound = np.where(cut, (not ended) | (after == len(data)), follows) & (received > 0)
        self.places, self.received = places[sound], received[sound]
        alone = cut[sound] | np.isin(after[sound], logs)
        self._followers = np.where(alone, -1, np.searchsorted(places, after[sound]))
        self._all = received
        self.logs = logs

    def after(self, first: int, last: int) -> int:
        """The first place from ``first`` on; -1 if there is none.

        Args:
            first: where to begin.
            last: receive time of the last message, 0 if there was none; others are within a day of it.
        """
        log = self.logs[np.searchsorted(self.logs, first) :][:1]
        for low in range(int(np.searchsorted(self.places, first)), len(self.places), _LOOKED_AT):
            received = self.received[low : low + _LOOKED_AT]
            follower = self._followers[low : low + _LOOKED_AT]
            near = _near(received, last) & ((follower < 0) | _near(self._all[np.maximum(follower, 0)], last))
            if near.any():
                found = int(self.places[low + int(np.argmax(near))])
                return min(found, int(log[0])) if len(log) else found
        return int(log[0]) if len(log) else -1


def _near(received: I64, last: int) -> Bools:
    """Mask of the messages that were received within a day of the last, bool [M]."""
    near: Bools = received > 0
    if last > 0:  # no difference of two times after 1970 is too large for its type
        near &= np.abs(np.maximum(received, 0) - last) < _DAY_NS
    return near
