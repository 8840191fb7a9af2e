"""Samples of a log's bodies, part by part, and joined to the frames of a match."""

from __future__ import annotations

from contextlib import ExitStack
from types import TracebackType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.base.spool import Spool
from pitchlore.pipeline.importers.rows import pack
from pitchlore.pipeline.importers.ssl_logs.container import ORDER
from pitchlore.pipeline.importers.ssl_logs.home import HomeColour
from pitchlore.pipeline.matches.frame import BALL_DTYPE, ROBOT_DTYPE, Frames, wrap
from pitchlore.pipeline.numbers.arrays import F64, I64


class CapturedSamples(NamedTuple):
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


def frames_of(samples: CapturedSamples, home: int | I64) -> Frames:
    """Frames of samples; their times are zero.

    Args:
        samples: with F frames.
        home: the colour that is home, one or int64 [F].
    """
    of_robot = home if isinstance(home, int) else home[samples.frame_of]
    ball = {name: samples.ball[:, i] for i, name in enumerate(BALL_DTYPE.fields or ())}
    robots: dict[str, npt.NDArray[np.generic]] = {
        name: samples.robots[:, 2 + i] for i, name in enumerate(("x", "y", "theta", "vx", "vy", "omega"))
    }
    robots["theta"] = wrap(samples.robots[:, 4])
    robots["team"] = (samples.robots[:, 0] != of_robot).astype(np.uint8)
    robots["id"] = samples.robots[:, 1].astype(np.uint16)
    times = np.zeros(len(samples.number), np.int64)
    return pack(samples.number.astype(np.uint32), times, ball, samples.frame_of, robots)


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
    """Samples of a log as they come, in files and not in memory: 28 bytes a robot, and 52 a sample.

    Args:
        home: the colour that is home.

    Attributes:
        robots: rows of robots so far.

    Raises:
        StorageFailed: from any method, if the temporary folder is full or cannot be written.
    """

    def __init__(self, home: HomeColour) -> None:
        self.robots = 0
        self._home = home
        self._files = ExitStack()
        self._packets, self._captured, self._number, self._ball, self._offsets, self._robots = (
            self._files.enter_context(Spool()) for _ in range(6))
        self._offsets.write(bytes(8))

    def __enter__(self) -> Gathering:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._files.close()

    def add(self, part: CapturedSamples) -> None:
        """Take up the samples of the next part of the log."""
        frames = frames_of(part, self._home.at(part.packets[:, ORDER]))
        self._packets.write(part.packets.tobytes())
        self._captured.write(part.captured.tobytes())
        self._number.write(frames.number.tobytes())
        self._ball.write(frames.ball.tobytes())
        self._offsets.write((self.robots + frames.offsets[1:]).tobytes())
        self._robots.write(frames.robots.tobytes())
        self.robots += len(frames.robots)

    def joined(self) -> Gathered:
        """All of them; they stay when the files are closed."""
        captured = np.frombuffer(self._captured.mapped())
        frames = Frames(
            np.frombuffer(self._number.mapped(), np.uint32), np.zeros(len(captured), np.int64),
            np.frombuffer(self._ball.mapped(), BALL_DTYPE), np.frombuffer(self._offsets.mapped(), np.int64),
            np.frombuffer(self._robots.mapped(), ROBOT_DTYPE),
        )
        return Gathered(np.frombuffer(self._packets.mapped(), np.int64).reshape(-1, 2), captured, frames)
