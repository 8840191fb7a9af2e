"""Screening of packets: unsound ones are counted, and never recorded.

Anybody in a hall can send to a league's addresses: another league's simulator, a second computer that
replays a log, a program that is broken.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from pitchlore.pipeline.importers.packets import vsss
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import LEAGUES, ON_DEMAND, LeagueName
from pitchlore.pipeline.importers.packets.told import told_option
from pitchlore.pipeline.importers.ssl_logs import fields as f
from pitchlore.pipeline.importers.ssl_logs.wire import FIXED64, SPAN, VARINT, Fields, fields, texts
from pitchlore.pipeline.live.sockets import Received
from pitchlore.pipeline.numbers.arrays import I64, U8, Bools

#: Why packets are left out, as people are reported.
MALFORMED, LARGE, SECOND, FLOOD = "not of this stream", "too large", "of a second sender", "too many"
#: A vision packet of the greatest match has 8 KiB.
_LARGEST = 32 << 10
#: Packets and bytes of a sender to a stream in a second; eight cameras send 800 of 1 KiB.
_MOST, _MOST_BYTES = 2_000, 8 << 20
#: Senders, and things reported, that are distinguished at one time.
_TOLD_APART = 256
#: A sender that was silent for so long has left its place to others, ns.
_SILENT_NS = 1_000_000_000

#: Whether each packet is one of the stream, bool [M], and what of the match it tells, one for each: packets
#: that tell the same thing have to come from one sender.
Tells = Callable[[U8, I64, I64], tuple[Bools, Sequence[object]]]


class Screen:
    """Tells sound packets from others.

    Args:
        league: league of the expected packets.

    Attributes:
        refused: packets that were left out, by stream and reason.
    """

    def __init__(self, league: LeagueName) -> None:
        self._streams = {stream.channel: stream.name for stream in (*LEAGUES[league], *ON_DEMAND[league])}
        self._tells = _TELLS[league]
        self._rates: dict[tuple[int, tuple[str, int]], _Rate] = {}
        self._senders: dict[tuple[int, object], tuple[tuple[str, int], int]] = {}
        self.refused: Counter[tuple[str, str]] = Counter()
        # on a machine that never did it, it is compiled now, and no packet waits for that
        fields(np.zeros(2, np.uint8), np.array([0]), np.array([2]))

    def sound(self, received: Sequence[Received]) -> list[Packet]:
        """The packets that are recorded, in the order given."""
        there = [one for one in received if self._within_rate(one)]
        kept = np.zeros(len(there), np.bool_)
        for channel in {one.packet.channel for one in there}:
            mine = [i for i, one in enumerate(there) if one.packet.channel == channel]
            sound, reported = self._tells[self._streams[channel]](*laid_out([there[i].packet for i in mine]))
            for i, is_sound, what in zip(mine, sound.tolist(), reported, strict=True):
                kept[i] = self._heard(there[i], what) if is_sound else self._refuse(channel, MALFORMED)
        return [there[i].packet for i in np.flatnonzero(kept).tolist()]

    def _within_rate(self, one: Received) -> bool:
        packet, who = one.packet, (one.packet.channel, one.sender)
        if len(packet.data) > _LARGEST:
            return self._refuse(packet.channel, LARGE)
        if who not in self._rates:
            _forget(self._rates, lambda rate: rate.begun_ns, packet.t_ns)
            if len(self._rates) >= _TOLD_APART:
                return self._refuse(packet.channel, FLOOD)
        rate = self._rates.setdefault(who, _Rate(packet.t_ns))
        return rate.allows(packet) or self._refuse(packet.channel, FLOOD)

    def _heard(self, one: Received, what: object) -> bool:
        """True if the sender is the one that tells this."""
        key, now = (one.packet.channel, what), one.packet.t_ns
        first, last_ns = self._senders.get(key, (one.sender, now))
        if first != one.sender and abs(now - last_ns) < _SILENT_NS:
            return self._refuse(one.packet.channel, SECOND)
        if key not in self._senders:
            _forget(self._senders, lambda heard: heard[1], now)
            if len(self._senders) >= _TOLD_APART:
                return self._refuse(one.packet.channel, FLOOD)
        self._senders[key] = (one.sender, now)
        return True

    def _refuse(self, channel: int, why: str) -> bool:
        self.refused[self._streams[channel], why] += 1
        return False


@dataclass(slots=True)
class _Rate:
    """Counts of the packets that one sender sent to one stream in the second that began at ``begun_ns``."""

    begun_ns: int
    packets: int = 0
    size: int = 0

    def allows(self, packet: Packet) -> bool:
        """True if a packet is within the rate; it is counted."""
        if not 0 <= packet.t_ns - self.begun_ns < 1_000_000_000:
            self.begun_ns, self.packets, self.size = packet.t_ns, 0, 0
        self.packets += 1
        self.size += len(packet.data)
        return self.packets <= _MOST and self.size <= _MOST_BYTES


K = TypeVar("K")
V = TypeVar("V")


def _forget(known: dict[K, V], last_ns: Callable[[V], int], now_ns: int) -> None:
    """If there are as many as are distinguished, remove those that were silent."""
    if len(known) >= _TOLD_APART:
        for key in [key for key, value in known.items() if abs(now_ns - last_ns(value)) >= _SILENT_NS]:
            del known[key]


def laid_out(packets: Sequence[Packet]) -> tuple[U8, I64, I64]:
    """Bytes of packets one after another, uint8, and where each begins and ends (exclusive), int64 [M]."""
    ends = np.cumsum([len(packet.data) for packet in packets])
    data = np.frombuffer(b"".join(packet.data for packet in packets), dtype=np.uint8)
    return data, ends - [len(packet.data) for packet in packets], ends


def _among(count: int, chosen: I64) -> Bools:
    """Mask of the chosen ones of ``count`` messages, from their numbers, bool [count]."""
    mask = np.zeros(count, np.bool_)
    mask[chosen] = True
    return mask


def _vision(data: U8, start: I64, end: I64) -> tuple[Bools, Sequence[object]]:
    """SSL vision: a detection frame, known by its camera, or geometry alone."""
    top, damaged = fields(data, start, end)
    frames = top.spans(f.WRAPPER_DETECTION)
    inner, broken = fields(data, frames.value, frames.end)
    whole = ~broken
    for number, kind in ((f.FRAME_NUMBER, VARINT), (f.FRAME_CAPTURE, FIXED64), (f.FRAME_CAMERA, VARINT)):
        whole &= _among(len(whole), inner.of[(inner.number == number) & (inner.kind == kind)])
    camera = np.full(len(start), -1)
    of, value = inner.varints(f.FRAME_CAMERA)
    camera[frames.of[of]] = value
    sound = ~damaged & (_among(len(start), frames.of) | _has_geometry(data, top, len(start)))
    sound[frames.of[~whole]] = False
    return sound, camera.tolist()


def _has_geometry(data: U8, top: Fields, count: int) -> Bools:
    """Mask of the vision packets that have geometry with a size, bool [count].

    The field of the width since 2014 is that of the length before.
    """
    geometry = top.spans(f.WRAPPER_GEOMETRY)
    inner, _ = fields(data, geometry.value, geometry.end)
    field = inner.spans(f.GEOMETRY_FIELD)
    sizes, _ = fields(data, field.value, field.end)
    of, _ = sizes.varints(f.SIZE_WIDTH)
    return _among(count, geometry.of[field.of[of]])


def _tracker(data: U8, start: I64, end: I64) -> tuple[Bools, Sequence[object]]:
    """SSL tracker: a tracked frame, known by the tracker's uuid."""
    top, damaged = fields(data, start, end)
    frames = top.spans(f.TRACKER_FRAME)
    inner, broken = fields(data, frames.value, frames.end)
    whole = ~broken
    for number, kind in ((f.TRACKED_NUMBER, VARINT), (f.TRACKED_TIME, FIXED64)):
        whole &= _among(len(whole), inner.of[(inner.number == number) & (inner.kind == kind)])
    named = top.spans(f.TRACKER_UUID)
    uuid: list[object] = [None] * len(start)
    for of, text in zip(named.of.tolist(), texts(data, named.value, named.end), strict=True):
        uuid[of] = text
    sound = ~damaged & _among(len(start), frames.of) & _among(len(start), named.of)
    sound[frames.of[~whole]] = False
    return sound, uuid


def _referee(data: U8, start: I64, end: I64) -> tuple[Bools, Sequence[object]]:
    """SSL referee: stage, command and both teams; there is one game controller."""
    reported, damaged = fields(data, start, end)
    sound = ~damaged
    for number, kind in ((f.REFEREE_STAGE, VARINT), (f.REFEREE_COMMAND, VARINT), (f.REFEREE_COUNTER, VARINT),
                         (f.REFEREE_YELLOW, SPAN), (f.REFEREE_BLUE, SPAN)):
        sound &= _among(len(start), reported.of[(reported.number == number) & (reported.kind == kind)])
    return sound, [None] * len(start)


def _environment(data: U8, start: I64, end: I64) -> tuple[Bools, Sequence[object]]:
    """FIRASim's vision: there is one simulator."""
    return vsss.environments(data, start, end).sound, [None] * len(start)


def _vss_referee(data: U8, start: I64, end: I64) -> tuple[Bools, Sequence[object]]:
    """VSSReferee's commands: there is one referee."""
    return vsss.are_commands(data, start, end), [None] * len(start)


def _told(data: U8, start: I64, end: I64) -> tuple[Bools, Sequence[object]]:
    """Options of robots: each robot's has one sender."""
    told = [told_option(data[a:b].tobytes()) for a, b in zip(start.tolist(), end.tolist(), strict=True)]
    return (np.array([one is not None for one in told], np.bool_),
            [None if one is None else (one.team, one.robot) for one in told])


_TELLS: dict[LeagueName, dict[str, Tells]] = {
    "ssl": {"vision": _vision, "vision-2010": _vision, "tracker": _tracker, "referee": _referee},
    "vsss": {"vision": _environment, "referee": _vss_referee, "options": _told},
}
