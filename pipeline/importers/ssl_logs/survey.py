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
    Batch,
    Container,
    ContainerFlaws,
    UnusableLogError,
)
from pitchlore.pipeline.importers.ssl_logs.geometry import Size
from pitchlore.pipeline.importers.ssl_logs.referee import RefereeLog, RefereeReport
from pitchlore.pipeline.importers.ssl_logs.senders import Senders
from pitchlore.pipeline.importers.ssl_logs.vision import CAMERA, CAPTURE
from pitchlore.pipeline.numbers.arrays import I64

VISION = (container.VISION_2010, container.VISION_2014)
_READ = (*VISION, container.REFEREE, container.TRACKER)
#: Cameras, trackers and sizes of the pitch that a log is asked for: of more, the first ones count.
_MOST = 64
#: A further log in the file is of the same match if it begins at most this long after the one before, ns.
_GOES_ON_NS = 30 * 60 * 10**9


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
    """One log of a file: number of messages, and when the first and the last were received, ns."""

    messages: int = 0
    first: int = 0
    last: int = 0


@dataclass(slots=True)
class Survey:
    """Contents of a log.

    Attributes:
        damage: damage of the container.
        parts: logs of the file that have messages.
        used: number of the first logs of the file that are one match; the rest is left out.
        sizes: sizes of the pitch, and how often the log gives each.
        vision: frames of all cameras.
        cameras: frames of each camera.
        senders: frames of each camera and sender (``senders.Senders``), and
        left_out: records that are left out.
        ahead: seconds by which clocks of cameras and senders are ahead, where they are.
        trackers: frames of each tracker, by uuid and name.
        reported: the referee's messages.
        referee_packets: number of the referee's packets.
        lost: vision packets that cannot be decoded.
        damaged: packets of the referee that cannot be decoded.
        unread: messages of types that are not read.
    """

    damage: ContainerFlaws = field(default_factory=ContainerFlaws)
    parts: list[LogExtent] = field(default_factory=list)
    used: int = 1
    sizes: Counter[Size] = field(default_factory=Counter)
    vision: FrameSpan = field(default_factory=FrameSpan)
    cameras: Counter[float] = field(default_factory=Counter)
    senders: dict[tuple[float, int], int] = field(default_factory=dict)
    left_out: set[tuple[float, int]] = field(default_factory=set)
    ahead: dict[tuple[float, int], float] = field(default_factory=dict)
    trackers: dict[tuple[str, str], FrameSpan] = field(default_factory=dict)
    reported: list[RefereeReport] = field(default_factory=list)
    referee_packets: int = 0
    lost: int = 0
    damaged: int = 0
    unread: Counter[int] = field(default_factory=Counter)


def survey(source: SourceFile) -> Survey:
    """Survey of a log.

    Raises:
        BadRecording: if its version is unknown, if it is damaged at too many places, or if it has more
            messages than the limit ``rows``.
    """
    log = Container(source.pieces())
    found = Survey(damage=log.damage)
    try:
        _read(log, found, source)
    except UnusableLogError as error:
        raise BadRecording(str(error), where=source.name,
                           next_step="Record or copy it again, or split it into matches") from error
    return found


def _read(log: Container, found: Survey, source: SourceFile) -> None:
    referee, lags, senders = RefereeLog(), Lags(), Senders()
    for batch in log.batches():
        if log.damage.versions[0] not in container.VERSIONS:
            raise BadRecording(f"is an SSL log of version {log.damage.versions[0]}", where=source.name,
                               next_step="Convert it to version 1 with the league's ssl-log-converter")
        if log.messages > source.limits.rows:
            raise source.too_much(f"more than {source.limits.rows} messages", "rows")
        if not _is_of_match(found, batch):
            continue
        found.unread.update(batch.kind[~np.isin(batch.kind, _READ)].tolist())
        _see(batch.of(*VISION), found, lags, senders)
        _track(batch.of(container.TRACKER), found)
        referee.add(batch.of(container.REFEREE))
    found.senders, found.left_out = senders.frames(), senders.left_out()
    found.ahead = lags.ahead(found.left_out)
    found.reported, found.referee_packets = referee.reported(), referee.packets()
    found.damaged = referee.damaged


def _is_of_match(found: Survey, batch: Batch) -> bool:
    """True if a batch is of the match with which the file begins; it is counted either way."""
    while len(found.parts) <= batch.part:
        found.parts.append(LogExtent())
    part = found.parts[batch.part]
    first = int(batch.packets[0, RECEIVED])
    if not part.messages:
        part.first = first
        before = [other for other in found.parts[: batch.part] if other.messages]
        goes_on = not before or 0 <= first - before[-1].last <= _GOES_ON_NS
        if goes_on and found.used >= batch.part:
            found.used = batch.part + 1
    part.messages += len(batch.kind)
    part.last = int(batch.packets[-1, RECEIVED])
    return batch.part < found.used


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
