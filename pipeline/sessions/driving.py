"""One of our teams drives robots that we do not simulate: sockets, and where the log is kept."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.engine.interrupt import until_stopped
from pitchlore.pipeline.engine.recordings import INBOX, PLAYING
from pitchlore.pipeline.game.pitch import PITCHES, Kind, Pitch
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import LeagueName, channels
from pitchlore.pipeline.importers.source import slug
from pitchlore.pipeline.live.driver import Driver, Job, Protocol, TeamColour, streams_of, wheel_packet
from pitchlore.pipeline.live.frames import pitch_of
from pitchlore.pipeline.live.screening import Screen
from pitchlore.pipeline.live.sockets import Receiver, Sender
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.store import Store

# A command needs these, too.
__all__ = ["DriveOutcome", "Job", "Protocol", "TeamColour", "drive_team", "streams_of"]

#: How long an SSL match may be without geometry before its pitch is the league's, seconds.
_GEOMETRY_S = 3.0
#: How often robots are told to stop at the end: packets get lost.
_STOPS = 10


class DriveOutcome(NamedTuple):
    """Outcome of driving.

    Attributes:
        file: log of what was seen and decided, in the inbox; None if it ended before its first frame.
        frames: frames in which the team decided; each sent a command.
        blind: how often robots were stopped because vision was lost.
        score: goals of blue and of yellow; None if nobody said.
        seconds: how long.
        vision: whether vision came.
        refused: packets that were left out, by stream and reason.
    """

    file: Path | None
    frames: int
    blind: int
    score: tuple[int, int] | None
    seconds: float
    vision: bool
    refused: Mapping[tuple[str, str], int]


def drive_team(
    store: Store, job: Job, *, say: Callable[[str], None] = lambda _: None,
    listening: Callable[[Mapping[str, str]], None] = lambda _: None,
) -> DriveOutcome:
    """Drive a team until it is stopped (:func:`pipeline.engine.interrupt.until_stopped`), or some seconds.

    Commands go out 60 times a second. Robots stand while the referee does not let play go on, when no vision
    came for 0.3 s, and when this ends, for whatever reason. What was seen and decided is logged; the next run
    takes the log, also after a kill.

    Raises:
        BadSettings: if an address cannot be listened to, or the team cannot be played.
        StorageFailed: if another program listens to one, or the disk refuses.
    """
    Driver(job, PITCHES[Kind(job.league)], BytesIO(), "trial").warm()
    began = time.monotonic()
    sources = tuple(stream for stream in job.streams if stream.name != "commands")
    with Receiver(sources, job.interface) as receiver, until_stopped() as stopped:
        listening(receiver.addresses)
        screen = Screen(job.league)

        def ended() -> bool:
            return stopped() or (job.seconds is not None and time.monotonic() - began >= job.seconds)

        def arrived(timeout: float) -> list[Packet]:
            return screen.sound(receiver.receive(timeout))

        pitch, first = _pitch(job.league, arrived, ended)
        if pitch is None:
            return DriveOutcome(None, 0, 0, None, time.monotonic() - began, False, screen.refused)
        name = slug(f"{job.word}-{job.protocol}-{datetime.now(UTC):%Y%m%d-%H%M%S}") + ".mcap"
        with store.growing(PLAYING, name) as (path, stream):
            driver = Driver(job, pitch, stream, path.stem)
            with _stopping(job) as send:
                driver.take(first)
                driver.run(arrived, send, ended, say)
            if not driver.began:
                path.unlink()
                return DriveOutcome(None, 0, 0, None, time.monotonic() - began, True, screen.refused)
            driver.close()
            file = store.moved(path, INBOX)
    return DriveOutcome(
        file, driver.frames, driver.blind, driver.referee.score, time.monotonic() - began, True,
        screen.refused)


@contextmanager
def _stopping(job: Job) -> Iterator[Callable[[F64 | None], None]]:
    """A function that sends wheels, float64 [N, 2]; whatever ends the body, robots are told to stop."""
    (target,) = (stream for stream in job.streams if stream.name == "commands")
    still = np.zeros((job.robots, 2))
    with Sender(job.interface) as sender:
        def send(wheels: F64 | None) -> None:
            sender.send(target, wheel_packet(job, still if wheels is None else wheels))

        try:
            yield send
        finally:
            for _ in range(_STOPS):
                send(None)
                time.sleep(0.005)


def _pitch(
    league: LeagueName, arrived: Callable[[float], list[Packet]], ended: Callable[[], bool],
) -> tuple[Pitch | None, list[Packet]]:
    """The pitch as the packets tell it, and the packets so far; None if it ended before any vision came."""
    vision, since, packets = channels(league)["vision"], None, list[Packet]()
    while not ended():
        packets = [*packets, *arrived(0.05)][-64:]
        if not any(packet.channel == vision for packet in packets):
            continue
        since = since or time.monotonic()
        reported = pitch_of(league, packets)
        if reported is not None or league == "vsss" or time.monotonic() - since > _GEOMETRY_S:
            return reported or PITCHES[Kind(league)], packets
    return None, packets
