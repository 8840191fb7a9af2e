"""A match that others play, recorded as its packets arrive."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from pitchlore.pipeline.engine.interrupt import until_stopped
from pitchlore.pipeline.engine.recordings import INBOX, WATCHING
from pitchlore.pipeline.importers.packets.recorder import Packet, PacketRecorder
from pitchlore.pipeline.importers.packets.streams import LeagueName, Stream
from pitchlore.pipeline.live.screening import Screen
from pitchlore.pipeline.live.sockets import Receiver
from pitchlore.pipeline.live.status import Status
from pitchlore.pipeline.store import Store

#: How often what arrived is handed to the system: a kill loses no more than came since then.
_FLUSH_S = 0.5
_SAY_S = 1.0
#: How long is waited for packets before the clock is looked at.
_WAIT_S = 0.05


class Watched(NamedTuple):
    """A recording of packets that has ended.

    Attributes:
        file: the recording, in the inbox; None if no packet came.
        packets: number of packets in it that are of the league.
        options: number of packets in it with a robot's option, as its team told it.
        frames_lost: frames of vision that were numbered and did not come.
        refused: packets that were left out, by stream and reason.
        seconds: how long it was listened.
    """

    file: Path | None
    packets: int
    options: int
    frames_lost: int
    refused: dict[tuple[str, str], int]
    seconds: float


def watch(
    store: Store, league: LeagueName, streams: tuple[Stream, ...], *, interface: str | None = None,
    seconds: float | None = None, say: Callable[[str], None] = lambda _: None,
    listening: Callable[[dict[str, str]], None] = lambda _: None,
    see: Callable[[list[Packet]], object] = lambda _: None,
) -> Watched:
    """Record what arrives, until Ctrl-C, or for some seconds; the next run takes the recording.

    Sound packets are written as they come, and handed to the system twice a second. If the process is killed,
    what was handed over stays in ``watching/``, and the next run takes it from there.

    Args:
        store: store whose inbox gets the recording.
        league: league of the expected packets.
        streams: with the addresses to listen to.
        interface: address of the network card on which groups are joined; None for the system's choice.
        seconds: how long; None until Ctrl-C.
        say: gets the line of status, each second.
        listening: gets the addresses when all sockets are open.
        see: gets the sound packets as they come.

    Raises:
        BadSettings: if an address cannot be listened to.
        StorageFailed: if another program listens to one, or the disk refuses.
    """
    began = time.monotonic()
    name = f"{league}-{datetime.now(UTC):%Y%m%d-%H%M%S}.mcap"
    screen, status = Screen(league), Status(league)
    with Receiver(streams, interface) as receiver, store.growing(WATCHING, name) as (path, stream):
        recorder = PacketRecorder(stream, league, receiver.addresses)
        listening(dict(receiver.addresses))
        with until_stopped() as stopped:
            flushed = said = began
            while not stopped() and (seconds is None or time.monotonic() - began < seconds):
                packets = screen.sound(receiver.receive(_WAIT_S))
                recorder.record(packets)
                status.see(packets)
                see(packets)
                now = time.monotonic()
                if now - flushed >= _FLUSH_S:
                    recorder.flush()
                    flushed = now
                if now - said >= _SAY_S:
                    say(status.line(time.time_ns(), sum(screen.refused.values())))
                    said = now
        recorder.close()
        file = store.moved(path, INBOX) if status.packets else None
        if file is None:
            path.unlink()
    return Watched(file, status.packets, status.options, status.frames.lost, dict(screen.refused),
                   time.monotonic() - began)
