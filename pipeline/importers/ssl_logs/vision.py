"""Vision packets: what each camera detected, as columns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.importers.ssl_logs import fields as f
from pitchlore.pipeline.importers.ssl_logs.container import Batch
from pitchlore.pipeline.importers.ssl_logs.wire import Fields, fields
from pitchlore.pipeline.numbers.arrays import F64, I64, U8, Bools

#: Teams of detections, and of the bodies that are made of them.
YELLOW, BLUE, BALL = 0, 1, 2

#: Robots' patterns number them from 0 to 15; twice as many may come one day.
ROBOTS = 32
#: Farther from the centre is nothing, metres.
_FURTHEST_M = 1_000.0
#: A clock that shows more has no number, seconds: the year 2242.
_LATEST_S = 2.0**33

#: Columns of a frame, and of a detection.
NUMBER, CAPTURE, SENT, CAMERA = range(4)
TEAM, ID, X, Y, THETA, CONFIDENCE = range(6)


class Detections(NamedTuple):
    """Detection frames of some messages, in their order.

    Attributes:
        packets: int64 [F, 2], packet of each frame, as in ``container.Batch``.
        frames: float64 [F, 4], frame number, t_capture and t_sent (s), camera.
        offsets: int64 [F + 1]; the bodies of frame i are ``bodies[offsets[i]:offsets[i + 1]]``.
        bodies: float64 [D, 6], team (YELLOW, BLUE, BALL), number of the robot, x, y (metres), theta (radians,
            NaN where it is not given), confidence.
    """

    packets: I64
    frames: F64
    offsets: I64
    bodies: F64

    @classmethod
    def none(cls) -> Detections:
        """No frame."""
        return cls(np.empty((0, 2), np.int64), np.empty((0, 4)), np.zeros(1, np.int64), np.empty((0, 6)))

    def followed_by(self, other: Detections) -> Detections:
        """These frames, and then the others."""
        return Detections(
            np.concatenate((self.packets, other.packets)), np.concatenate((self.frames, other.frames)),
            np.concatenate((self.offsets, other.offsets[1:] + self.offsets[-1])),
            np.concatenate((self.bodies, other.bodies)),
        )

    def since(self, first: int) -> Detections:
        """The frames from ``first`` on."""
        start = self.offsets[first]
        return Detections(self.packets[first:], self.frames[first:], self.offsets[first:] - start,
                          self.bodies[start:])

    def until(self, end: int) -> Detections:
        """The frames before ``end``."""
        return Detections(self.packets[:end], self.frames[:end], self.offsets[: end + 1],
                          self.bodies[: self.offsets[end]])

    def where(self, chosen: Bools) -> Detections:
        """The frames that are chosen, by bool [F]."""
        counts = np.diff(self.offsets)
        offsets = np.concatenate(([0], np.cumsum(counts[chosen]))).astype(np.int64)
        return Detections(self.packets[chosen], self.frames[chosen], offsets,
                          self.bodies[np.repeat(chosen, counts)])


class Unused(NamedTuple):
    """Counts of the vision packets that could not be used, by reason.

    Attributes:
        damaged: packets that cannot be decoded.
        unnumbered: robots without a number, or with one from ``ROBOTS`` on.
        nowhere: bodies whose place is not a number, or is too far away.
    """

    damaged: int
    unnumbered: int
    nowhere: int


class DetectionHeads(NamedTuple):
    """Detection frames of vision packets, without their bodies.

    Attributes:
        packet: int64 [F], which packet of the batch each is.
        frames: float64 [F, 4], as in :class:`Detections`.
        lost: packets that cannot be decoded, or have no usable time or camera.
        inside: the fields of all frames; ``of`` is the packet.
    """

    packet: I64
    frames: F64
    lost: int
    inside: Fields


def heads(batch: Batch, packets: Fields, damaged: Bools) -> DetectionHeads:
    """Detection frames of vision packets; a packet with geometry only has none.

    If a packet has several frames, the protocol joins them to one.

    Args:
        batch: vision packets.
        packets: their fields, and
        damaged: mask of the damaged ones, bool [M].
    """
    detection = packets.spans(f.WRAPPER_DETECTION)
    inside, broken = fields(batch.data, detection.value, detection.end)
    inside = inside._replace(of=detection.of[inside.of])
    damaged = damaged.copy()
    damaged[detection.of[broken]] = True
    frames = np.full((len(batch.start), 4), np.nan)
    for column, number in ((NUMBER, f.FRAME_NUMBER), (CAMERA, f.FRAME_CAMERA)):
        of, value = inside.varints(number)
        frames[of, column] = value & 0xFFFFFFFF
    for column, number in ((CAPTURE, f.FRAME_CAPTURE), (SENT, f.FRAME_SENT)):
        of, values = inside.reals(batch.data, number)
        frames[of, column] = values
    there = np.zeros(len(batch.start), np.bool_)
    there[detection.of] = True
    with np.errstate(invalid="ignore"):
        usable = (np.abs(frames[:, CAPTURE]) < _LATEST_S) & np.isfinite(frames[:, CAMERA])
    sound = there & ~damaged & usable
    lost = int(damaged.sum()) + int((there & ~damaged & ~usable).sum())
    packet = np.flatnonzero(sound)
    return DetectionHeads(packet, frames[packet], lost, inside.at(np.flatnonzero(sound[inside.of])))


def detections(batch: Batch) -> tuple[Detections, Unused]:
    """Detection frames of a batch of vision packets, with their bodies."""
    found = heads(batch, *fields(batch.data, batch.start, batch.end))
    spans = found.inside.spans(f.FRAME_BALLS, f.FRAME_YELLOW, f.FRAME_BLUE)
    bodies = _bodies(batch.data, spans)
    numbered = (bodies[:, ID] >= 0) & (bodies[:, ID] < ROBOTS)
    somewhere = (np.abs(bodies[:, X]) < _FURTHEST_M) & (np.abs(bodies[:, Y]) < _FURTHEST_M)
    used = numbered & somewhere
    counts = np.bincount(spans.of[used], minlength=len(batch.start))[found.packet]
    offsets = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    unused = Unused(found.lost, int((~numbered).sum()), int((numbered & ~somewhere).sum()))
    return Detections(batch.packets[found.packet], found.frames, offsets, bodies[used]), unused


def _bodies(data: U8, spans: Fields) -> F64:
    """Balls and robots, float64 [D, 6]; a damaged one has no place, a robot without a number has -1."""
    reported, damaged = fields(data, spans.value, spans.end)
    bodies = np.full((len(spans.of), 6), np.nan)
    ball = spans.number == f.FRAME_BALLS
    bodies[:, TEAM] = np.where(ball, BALL, np.where(spans.number == f.FRAME_YELLOW, YELLOW, BLUE))
    bodies[:, ID] = np.where(ball, 0, -1)
    of, number = reported.varints(f.ROBOT_ID)
    bodies[of, ID] = np.where(ball[of], 0, number)
    # a ball's confidence and place have the same numbers as a robot's
    for column, which, scale in ((CONFIDENCE, f.ROBOT_CONFIDENCE, 1.0), (X, f.ROBOT_X, 1000.0),
                                 (Y, f.ROBOT_Y, 1000.0), (THETA, f.ROBOT_ORIENTATION, 1.0)):
        of, values = reported.reals(data, which)
        bodies[of, column] = values / scale
    bodies[damaged, X] = np.nan
    bodies[ball, THETA] = np.nan
    bodies[~(np.abs(bodies[:, THETA]) < _FURTHEST_M), THETA] = np.nan
    return bodies
