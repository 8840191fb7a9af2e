"""Reading of recordings of packets, damaged ones included."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from pitchlore.pipeline.base.errors import DamagedLog
from pitchlore.pipeline.importers.packets.recorder import LEAGUE, LIBRARY, METADATA
from pitchlore.pipeline.importers.packets.streams import LEAGUES, ON_DEMAND, LeagueName, topic
from pitchlore.pipeline.matches.mcap_file import McapFile
from pitchlore.pipeline.matches.messages import log_times
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.matches.records import ADDRESS_BYTES, MESSAGE
from pitchlore.pipeline.numbers.arrays import I64, U8

#: MCAP's magic bytes and the start of a header record with our library.
_BEGINS = b"\x89MCAP0\r\n\x01"
_WITHIN = 64


def is_recording(head: bytes) -> bool:
    """True if content is a recording of packets, by its first bytes."""
    return head.startswith(_BEGINS) and LIBRARY.encode() in head[:_WITHIN]


class Packets(NamedTuple):
    """Packets of a recording, [M] each, in its order.

    Attributes:
        data: uint8 [N], bytes that hold them.
        channel: int64, channel of each one's stream.
        t_ns: int64, when each was received, Unix time in ns.
        start, end: int64, where each one's content is in ``data``; end is exclusive.
    """

    data: U8
    channel: I64
    t_ns: I64
    start: I64
    end: I64


class PacketRecording:
    """A recording, read once.

    Args:
        data: the file's bytes.
        where: its name, for errors and notes.

    Attributes:
        league: league of its packets.

    Raises:
        DamagedLog: if it does not say whose packets it has, or declares more than is read.
    """

    def __init__(self, data: bytes, where: str) -> None:
        self._topics: dict[int, str] = {}
        self._file = McapFile(data, where, self._declare)
        named = [copy.get(LEAGUE) for copy in self._file.metadata(METADATA)]
        leagues = [league for league in LEAGUES if league in named]
        if not leagues:
            raise DamagedLog("does not say which league's packets it has", where=where,
                             next_step="Copy it again")
        self.league: LeagueName = leagues[0]

    def _declare(self, channel: Any, _schema: object) -> None:
        self._topics.setdefault(channel.id, channel.topic)

    def packets(self) -> Iterator[Packets]:
        """Packets of the league's streams, a chunk at a time; call it once, to the end."""
        streams = (*LEAGUES[self.league], *ON_DEMAND[self.league])
        known = {topic(self.league, stream): stream.channel for stream in streams}
        seen = 0
        for content, records in self._file.contents():
            seen += int((records.opcodes == MESSAGE).sum())
            topics = (self._topics.get(channel, "") for channel in records.channels.tolist())
            channel = np.array([known.get(name, -1) for name in topics], dtype=np.int64)
            ours = records.keep(channel >= 0)
            if len(ours.bodies):
                yield Packets(content, channel[channel >= 0], log_times(content, ours),
                              ours.bodies + ADDRESS_BYTES, ours.bodies + ours.lengths)
        self._file.check(seen)

    def flaws(self) -> list[Flaw]:
        """Flaws of the file, as far as it was read; times are log times."""
        return self._file.flaws

    def reasons(self) -> list[str]:
        """Why it is not whole, as far as it was read; empty if it is."""
        return self._file.reasons
