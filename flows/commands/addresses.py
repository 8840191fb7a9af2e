"""Options of commands that talk to the network."""

from __future__ import annotations

import socket
from collections.abc import Mapping, Sequence
from typing import Annotated

from cyclopts import Parameter

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.importers.packets.streams import Stream

#: Option: addresses of single streams.
At = Annotated[tuple[str, ...], Parameter(negative=(), show_default=False, help=(
    "Address of one stream, such as vision=224.5.23.2:10006; may be repeated."))]
#: Option: the network card.
Interface = Annotated[str | None, Parameter(show_default=False, help=(
    "Address of the network card by which multicast groups are reached (default: the system's choice)."))]


def listening_to(addresses: Mapping[str, str]) -> str:
    """The line that says where streams are listened to, by their names."""
    return "Listening to " + ", ".join(f"{name} at {where}" for name, where in addresses.items())


def addressed(
    known: Sequence[Stream], group: str | None, at: tuple[str, ...], on_demand: Sequence[Stream] = (),
) -> tuple[Stream, ...]:
    """Streams at addresses that people named.

    Args:
        known: streams that have addresses.
        group: address of all of them instead of their own; None for those.
        at: addresses of single streams, ``STREAM=ADDRESS:PORT``.
        on_demand: streams that are listened to only if they are in ``at``.

    Raises:
        BadSettings: if there is no such stream, or an address cannot be read.
    """
    streams = {stream.name: stream if group is None else stream._replace(group=group)
               for stream in known}
    named = {word.partition("=")[0] for word in at}
    streams |= {stream.name: stream for stream in on_demand if stream.name in named}
    for word in at:
        name, _, where = word.partition("=")
        address, _, port = where.rpartition(":")
        if name not in streams or not address or not port.isdecimal() or int(port) > 0xFFFF:
            raise BadSettings(f"--at {word} names no stream and address", next_step=(
                f"Write STREAM=ADDRESS:PORT; the streams are {', '.join(streams)}"))
        streams[name] = streams[name]._replace(group=address, port=int(port))
    return tuple(stream._replace(group=_resolved(stream.group)) for stream in streams.values())


def _resolved(address: str) -> str:
    """An address, or that of a computer's name."""
    try:
        if address:
            return socket.gethostbyname(address)
    except (OSError, UnicodeError):
        pass
    raise BadSettings(f"{address!r} is no address", next_step=(
        "Name an IPv4 address, such as 127.0.0.1, or a computer that the network knows"))
