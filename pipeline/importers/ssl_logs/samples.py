"""Samples of a log's bodies, part by part, and joined to the frames of a match."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pipeline.arrays import F64, I64
from pipeline.importers.rows import pack
from pipeline.matches.frame import BALL_DTYPE, ROBOT_DTYPE, Frames, wrap


class Samples(NamedTuple):
    """Samples in the order of the log, their times as captured.

    Attributes:
        packets: int64 [F, 2], first packet of each, as in ``container.Batch``.
        captured: float64 [F], when it was captured, seconds of the source's clock.
        number: int64 [F], the source's frame number.
        ball: float64 [F, 4], x, y (metres), vx, vy (m/s); NaN where it is not seen or not known.
        frame_of: int64 [R], sample of each robot, in any order.
        robots: float64 [R, 8], team (vision.YELLOW or BLUE), number, x, y, theta, vx, vy, omega.
    """

    packets: I64
    captured: F64
    number: I64
    ball: F64
    frame_of: I64
    robots: F64


class Gathered(NamedTuple):
    """All samples of a log.

    Attributes:
        packets: int64 [F, 2], first packet of each.
        captured: float64 [F], seconds of the source's clock.
        frames: the samples; times are zero.
    """

    packets: I64
    captured: F64
    frames: Frames


class Gathering:
    """Samples of a log as they come, kept as a match has them: 28 bytes a robot, and 52 a sample.

    Args:
        home: the colour that is home.

    Attributes:
        robots: rows of robots so far.
    """

    def __init__(self, home: int) -> None:
        self.robots = 0
        self._home = home
        # bytes that grow where they are, so that memory has them once
        self._packets, self._captured, self._number = bytearray(), bytearray(), bytearray()
        self._ball, self._offsets, self._robots = bytearray(), bytearray(bytes(8)), bytearray()

    def add(self, part: Samples) -> None:
        """Take up the samples of the next part of the log."""
        ball = {name: part.ball[:, i] for i, name in enumerate(BALL_DTYPE.fields or ())}
        of_robots: dict[str, npt.NDArray[np.generic]] = {
            name: part.robots[:, 2 + i] for i, name in enumerate(("x", "y", "theta", "vx", "vy", "omega"))
        }
        of_robots["theta"] = wrap(part.robots[:, 4])
        of_robots["team"] = (part.robots[:, 0] != self._home).astype(np.uint8)
        of_robots["id"] = part.robots[:, 1].astype(np.uint16)
        times = np.zeros(len(part.number), np.int64)
        frames = pack(part.number.astype(np.uint32), times, ball, part.frame_of, of_robots)
        self._packets += part.packets.tobytes()
        self._captured += part.captured.tobytes()
        self._number += frames.number.tobytes()
        self._ball += frames.ball.tobytes()
        self._offsets += (self.robots + frames.offsets[1:]).tobytes()
        self._robots += frames.robots.tobytes()
        self.robots += len(frames.robots)

    def joined(self) -> Gathered:
        """All of them."""
        captured = np.frombuffer(self._captured)
        frames = Frames(
            np.frombuffer(self._number, np.uint32), np.zeros(len(captured), np.int64),
            np.frombuffer(self._ball, BALL_DTYPE), np.frombuffer(self._offsets, np.int64),
            np.frombuffer(self._robots, ROBOT_DTYPE),
        )
        return Gathered(np.frombuffer(self._packets, np.int64).reshape(-1, 2), captured, frames)
