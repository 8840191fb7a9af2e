"""Packets from the network: one UDP socket for each stream."""

from __future__ import annotations

import logging
import selectors
import socket
import struct
import sys
import time
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import NamedTuple, Self

from pitchlore.pipeline.base.errors import BadSettings, StorageFailed
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import Stream

_log = logging.getLogger(__name__)
#: Packets of one stream that are taken before another stream has its turn.
_AT_ONCE = 256
#: Larger than any UDP packet, so that none is cut unseen.
_BUFFER = 1 << 16
#: Linux's option to note when a packet arrived, SO_TIMESTAMPNS, which Python does not name, and its notes. A
#: packet that waits while another stream's are read keeps its place.
_TIMES = 35
_TIME = struct.Struct("@qq")
_NOTES = socket.CMSG_SPACE(_TIME.size)
#: What the system may keep for us while we are busy, bytes: two seconds of a great match.
_KEPT = 4 << 20


class Received(NamedTuple):
    """A packet, and who sent it.

    Attributes:
        packet: packet of the network.
        sender: address and port.
    """

    packet: Packet
    sender: tuple[str, int]


class Receiver:
    """Sockets that listen to streams; a context manager that closes them.

    Args:
        streams: with the addresses to listen to. A multicast group is joined; any other address has to be one
            of this computer.
        interface: address of the network card on which groups are joined; None for the system's choice.

    Raises:
        BadSettings: if an address is none of this computer, or the interface cannot be used.
        StorageFailed: if another program holds the port for itself.
    """

    def __init__(self, streams: tuple[Stream, ...], interface: str | None = None) -> None:
        self._selector = selectors.DefaultSelector()
        try:
            for stream in streams:
                self._selector.register(_listening(stream, interface), selectors.EVENT_READ, stream)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def addresses(self) -> Mapping[str, str]:
        """Where each stream is listened to, ``ADDRESS:PORT`` by its name; port 0 has become a free one."""
        reported = {}
        for key in self._selector.get_map().values():
            address, port = key.fileobj.getsockname()  # type: ignore[union-attr]
            reported[key.data.name] = f"{address}:{port}"
        return reported

    def receive(self, timeout: float) -> list[Received]:
        """Packets that have arrived, in order of time; waits up to ``timeout`` seconds for the first."""
        found = []
        for key, _ in self._selector.select(timeout):
            ears: socket.socket = key.fileobj  # type: ignore[assignment]
            for _ in range(_AT_ONCE):
                try:
                    data, notes, _, sender = ears.recvmsg(_BUFFER, _NOTES)
                except (BlockingIOError, ConnectionError):
                    break
                found.append(Received(Packet(key.data.channel, _arrived(notes), data), sender))
        return sorted(found, key=lambda received: received.packet.t_ns)

    def close(self) -> None:
        """Close the sockets."""
        for key in list(self._selector.get_map().values()):
            key.fileobj.close()  # type: ignore[union-attr]
        self._selector.close()


class Sender:
    """A socket that sends; a context manager that closes it.

    Args:
        interface: address of the network card by which multicast groups are reached; None for the system's
            choice.

    Attributes:
        refused: packets that the system did not take; they are told at the end.

    Raises:
        BadSettings: if the interface cannot be used.
    """

    def __init__(self, interface: str | None = None) -> None:
        self.refused, self._why = 0, ""
        self._mouth = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._mouth.setblocking(False)
        try:
            if interface:
                self._mouth.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
        except OSError as error:
            self._mouth.close()
            raise _no_card(interface) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
    ) -> None:
        self._mouth.close()
        if self.refused:
            _log.warning("%s packets were not sent, the last to %s.", f"{self.refused:,}", self._why)

    def send(self, to: Stream, data: bytes) -> None:
        """Send a packet; one that the system does not take is counted, as the network loses some, too."""
        try:
            self._mouth.sendto(data, (to.group, to.port))
        except OSError as error:
            self.refused, self._why = self.refused + 1, f"{to.group}:{to.port} ({error.strerror or error})"


def _arrived(notes: Sequence[tuple[int, int, bytes]]) -> int:
    """When a packet arrived by the system's notes on it, Unix time in ns; now, if it notes no time."""
    for level, kind, content in notes:
        if level == socket.SOL_SOCKET and kind == _TIMES and len(content) == _TIME.size:
            seconds, ns = _TIME.unpack(content)
            return int(seconds * 1_000_000_000 + ns)
    return time.time_ns()


def _no_card(interface: str | None) -> BadSettings:
    return BadSettings(f"{interface!r} is no address of a network card", where="--interface",
                       next_step="Name an IPv4 address of this computer, as `ip address` lists them")


def _listening(stream: Stream, interface: str | None) -> socket.socket:
    where = f"{stream.group}:{stream.port}"
    try:
        card = socket.inet_aton(interface) if interface else struct.pack("=I", socket.INADDR_ANY)
    except OSError as error:
        raise _no_card(interface) from error
    ears = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        ears.setblocking(False)
        ears.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _KEPT)
        if sys.platform == "linux":
            ears.setsockopt(socket.SOL_SOCKET, _TIMES, 1)
        group = socket.inet_aton(stream.group)
        shared = 224 <= group[0] <= 239
        if shared:  # others on this computer may listen to the group, too
            ears.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        ears.bind((stream.group, stream.port))
        if shared:
            ears.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group + card)
    except OSError as error:
        ears.close()
        if error.errno is not None and error.strerror and "in use" in error.strerror:
            raise StorageFailed(
                "another program listens to it", where=where,
                next_step="End that program, or listen elsewhere: --at STREAM=ADDRESS:PORT") from error
        raise BadSettings(
            f"cannot be listened to ({error.strerror or error})", where=where,
            next_step=(
                "Name an address of this computer or a multicast group, and the network card: --interface"),
        ) from error
    return ears
