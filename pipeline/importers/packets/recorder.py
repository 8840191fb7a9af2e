"""Writing of recordings of packets, while they arrive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import BinaryIO, NamedTuple

from pitchlore.pipeline.importers.packets.streams import LEAGUES, ON_DEMAND, LeagueName, Stream, topic
from pitchlore.pipeline.matches.mcap_writer import McapWriter

#: Library in the header of a recording, by which it is distinguished from other MCAP files.
LIBRARY = "pitchlore packets 1"
#: Name of its metadata record, and the key of the league in it.
METADATA, LEAGUE = "pitchlore packets", "league"


class Packet(NamedTuple):
    """A packet as it arrived.

    Attributes:
        channel: channel of its stream.
        t_ns: when it was received, Unix time in ns.
        data: its content.
    """

    channel: int
    t_ns: int
    data: bytes


class PacketRecorder:
    """A recording that grows.

    Args:
        stream: buffered, writable; nothing has been written to it yet.
        league: league of the packets that it records.
        addresses: where each stream is listened to, ``ADDRESS:PORT`` by the stream's name; for people.

    Raises:
        OSError: from any method, if the stream refuses a write.
    """

    def __init__(self, stream: BinaryIO, league: LeagueName, addresses: Mapping[str, str] = {}) -> None:
        self._file = McapWriter(stream, profile="", library=LIBRARY)
        self._file.describe(METADATA, {LEAGUE: league})
        self._file.declare_plain("protobuf", {
            of.channel: (topic(league, of), _address(of, addresses)) for of in LEAGUES[league]})
        self._file.declare_plain("json", {
            of.channel: (topic(league, of), _address(of, addresses)) for of in ON_DEMAND[league]
            if of.name in addresses})

    def record(self, packets: Sequence[Packet]) -> None:
        """Append packets, in the order in which they are to be read."""
        self._file.append_plain(packets)

    def flush(self) -> None:
        """Write what is pending, so that a killed process loses nothing of it."""
        self._file.flush()

    def close(self) -> None:
        """Write what is pending, and the summary; the stream stays open."""
        self._file.close()


def _address(stream: Stream, addresses: Mapping[str, str]) -> dict[str, str]:
    return {"address": addresses.get(stream.name, f"{stream.group}:{stream.port}")}
