"""Survey of a log: one reading of it before its bodies are read."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from pitchlore.pipeline.base.errors import BadRecording
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.importers.ssl_logs import container, geometry, tracker, vision, wire
from pitchlore.pipeline.importers.ssl_logs.clock import Lags
from pitchlore.pipeline.importers.ssl_logs.container import (
    ORDER,
    RECEIVED,
    WHOLE,
    Batch,
    Container,
    ContainerFlaws,
    Span,
    UnusableLogError,
    within,
)
from pitchlore.pipeline.importers.ssl_logs.game_events import EventLog
from pitchlore.pipeline.importers.ssl_logs.geometry import Size
from pitchlore.pipeline.importers.ssl_logs.referee import RefereeLog, RefereeReport
from pitchlore.pipeline.importers.ssl_logs.senders import Senders
from pitchlore.pipeline.importers.ssl_logs.vision import CAMERA, CAPTURE
from pitchlore.pipeline.numbers.arrays import I64

VISION = (container.VISION_2010, container.VISION_2014)
_READ = (*VISION, container.REFEREE, container.TRACKER)
#: Cameras, trackers and sizes of the pitch that a log is asked for: of more, the first ones count.
_MOST = 64


@dataclass(slots=True)
class FrameSpan:
    """Frames of one source of bodies: their number, and when the first and the last were received, ns."""

    frames: int = 0
    first: int = 0
    last: int = 0

    def add(self, packets: I64) -> None:
        """Take up packets, int64 [M, 2], as in ``container.Batch``."""
        if not len(packets):
            return
        if not self.frames:
            self.first = int(packets[0, RECEIVED])
        self.last = int(packets[-1, RECEIVED])
        self.frames += len(packets)

    @property
    def seconds(self) -> float:
        """Time from the first to the last."""
        return max(self.last - self.first, 0) / 1e9


@dataclass(slots=True)
class LogExtent:
    """One log of a file: its messages, when the first and the last came, ns, and the first one's number."""

    messages: int = 0
    first: int = 0
    last: int = 0
    order: int = 0


@dataclass(slots=True)
class Survey:
    """Contents of a log.

    Attributes:
        damage: damage of the container.
        parts: the logs of the file; in the survey of a match only its messages count.
        sizes: sizes of the pitch, and how often the log gives each.
        vision: frames of all cameras.
        cameras: frames of each camera.
        senders: frames of each camera and sender (``senders.Senders``), and
        left_out: records that are left out.
        ahead: seconds by which clocks of cameras and senders are ahead, where they are.
        trackers: frames of each tracker, by uuid and name.
        reported: the referee's messages.
        events: game events that the referee tells.
        referee_packets: number of the referee's packets.
        unheard: number of packets of other game controllers that sent meanwhile.
        lost: vision packets that cannot be decoded.
        damaged: packets of the referee that cannot be decoded.
        unread: messages of types that are not read.
    """

    damage: ContainerFlaws = field(default_factory=ContainerFlaws)
    parts: list[LogExtent] = field(default_factory=list)
    sizes: Counter[Size] = field(default_factory=Counter)
    vision: FrameSpan = field(default_factory=FrameSpan)
    cameras: Counter[float] = field(default_factory=Counter)
    senders: dict[tuple[float, int], int] = field(default_factory=dict)
    left_out: set[tuple[float, int]] = field(default_factory=set)
    ahead: dict[tuple[float, int], float] = field(default_factory=dict)
    trackers: dict[tuple[str, str], FrameSpan] = field(default_factory=dict)
    reported: list[RefereeReport] = field(default_factory=list)
    events: list[EventLog] = field(default_factory=list)
    referee_packets: int = 0
    unheard: int = 0
    lost: int = 0
    damaged: int = 0
    unread: Counter[int] = field(default_factory=Counter)


def survey(source: SourceFile, span: Span = WHOLE) -> Survey:
    """Survey of a log.

    Args:
        source: the log.
        span: messages that are surveyed.

    Raises:
        BadRecording: if its version is unknown, if it is damaged at too many places, or if it has more
            messages than the limit ``rows``.
    """
    log = Container(source.pieces())
    found = Survey(damage=log.damage)
    try:
        _read(log, found, source, span)
    except UnusableLogError as error:
        raise BadRecording(str(error), where=source.name,
                           next_step="Record or copy it again, or split it into matches") from error
    return found


def _read(log: Container, found: Survey, source: SourceFile, span: Span) -> None:
    referee, lags, senders = RefereeLog(), Lags(), Senders()
    for batch in within(log.batches(), span):
        if log.damage.versions[0] not in container.VERSIONS:
            raise BadRecording(f"is an SSL log of version {log.damage.versions[0]}", where=source.name,
                               next_step="Convert it to version 1 with the league's ssl-log-converter")
        if log.messages > source.limits.rows:
            raise source.too_much(f"more than {source.limits.rows} messages", "rows")
        _count(found, batch)
        found.unread.update(batch.kind[~np.isin(batch.kind, _READ)].tolist())
        _see(batch.of(*VISION), found, lags, senders)
        _track(batch.of(container.TRACKER), found)
        referee.add(batch.of(container.REFEREE))
    found.senders, found.left_out = senders.frames(), senders.left_out()
    found.ahead = lags.ahead(found.left_out)
    found.reported, found.referee_packets = referee.reported(), referee.packets()
    found.events = referee.events()
    found.damaged, found.unheard = referee.damaged, referee.unheard()


def _count(found: Survey, batch: Batch) -> None:
    """Count a batch to its log of the file."""
    while len(found.parts) <= batch.part:
        found.parts.append(LogExtent())
    part = found.parts[batch.part]
    if not part.messages:
        part.order, part.first = batch.packets[0].tolist()
    part.messages += len(batch.kind)
    part.last = int(batch.packets[-1, RECEIVED])


def _see(batch: Batch, found: Survey, lags: Lags, senders: Senders) -> None:
    packets, damaged = wire.fields(batch.data, batch.start, batch.end)
    for size, times in geometry.sizes(batch, packets).items():
        if size in found.sizes or len(found.sizes) < _MOST:
            found.sizes[size] += times
    seen = vision.heads(batch, packets, damaged)
    found.lost += seen.lost
    received = batch.packets[seen.packet]
    found.vision.add(received)
    sender = senders.add(seen.frames, received[:, ORDER])
    cameras = seen.frames[:, CAMERA]
    for camera, times in zip(*np.unique(cameras, return_counts=True), strict=True):
        if camera in found.cameras or len(found.cameras) < _MOST:
            found.cameras[float(camera)] += int(times)
    lags.add(cameras, sender, seen.frames[:, CAPTURE], received[:, RECEIVED])


def _track(batch: Batch, found: Survey) -> None:
    names, which = tracker.trackers_of(batch)
    for i, name in enumerate(names[:_MOST]):
        if name in found.trackers or len(found.trackers) < _MOST:
            found.trackers.setdefault(name, FrameSpan()).add(batch.packets[which == i])
