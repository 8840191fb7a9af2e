"""The bodies of a match, as its packets show them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

import numpy as np

from pitchlore.pipeline.arena.physics.camera import look
from pitchlore.pipeline.game.bodies import BALL, COLUMNS, VX, X, Y
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.importers.packets import vsss
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import LeagueName, channels
from pitchlore.pipeline.importers.ssl_logs import vision
from pitchlore.pipeline.importers.ssl_logs.container import Batch
from pitchlore.pipeline.live.screening import laid_out
from pitchlore.pipeline.numbers.arrays import F64, Bools

#: Time constant of the filter that estimates velocities, seconds; that of the arena's camera.
_SMOOTHING_S = 0.05
#: Beyond the pitch, where bodies are that were never seen, metres.
_ASIDE_M = 0.2


class Eye(Protocol):
    """Poses of bodies in a league's packets."""

    def poses(self, packets: Sequence[Packet]) -> Iterable[tuple[int, F64]]:
        """Row of each body that was seen, and its x, y, theta, vx, vy, omega; NaN where not given."""


class BodyTracker:
    """The bodies of a match at a steady rate, from packets that come when they come.

    Velocities are the packets' own where these have any, else estimated as the arena's camera does
    (:class:`pipeline.arena.physics.camera.Camera`). A body that is not seen stays where it was seen last. One
    that never was is beside the pitch.

    Args:
        league: league of the packets.
        robots: N, robots a side, with the numbers 0 to N - 1.
        pitch: pitch of the match.
        hz: how often :meth:`now` is called in a second.

    Attributes:
        seen_s: when a body was seen last, by a clock that nobody sets, seconds; -inf if never.
    """

    def __init__(self, league: LeagueName, robots: int, pitch: Pitch, hz: float) -> None:
        rows = 1 + 2 * robots
        self._eye: Eye = _EYES[league](robots)
        self._there = np.zeros((rows, COLUMNS))
        for side, sign in enumerate((-1.0, 1.0)):
            own = slice(1 + side * robots, 1 + (side + 1) * robots)
            self._there[own, X] = sign * (pitch.length / 2 + _ASIDE_M)
            self._there[own, Y] = np.arange(robots) * 2 * SCALES[pitch.kind].robot_radius
        self._given = np.full((rows, 3), np.nan)
        self._fresh = np.ones(rows, np.bool_)
        self._first = True
        scales = SCALES[pitch.kind]
        self._reach = np.full(rows, scales.max_robot_speed / hz)
        self._reach[BALL] = scales.max_ball_speed / hz
        self._constants = np.array([0.0, 0.0, hz, float(np.exp(-1 / (hz * _SMOOTHING_S)))])
        self._unseen_for = np.zeros(rows, np.int64)
        self._track, self._seen = np.zeros((2, rows, COLUMNS))
        self._visible = np.zeros(rows, np.bool_)
        self.seen_s = -np.inf

    def take(self, packets: Sequence[Packet]) -> None:
        """Take up sound packets, in order of time."""
        for row, pose in self._eye.poses(packets):
            self._there[row, : VX] = np.where(np.isnan(pose[: VX]), self._there[row, : VX], pose[: VX])
            self._given[row] = pose[VX:]
            self._fresh[row] = True
            self.seen_s = time.monotonic()

    def now(self) -> tuple[F64, Bools]:
        """The bodies, float64 [1 + 2 N, 6], and which were seen since the last call, bool [1 + 2 N].

        Blue's robots are in rows 1 to N. Both arrays are the tracker's own and change with the next call.
        """
        rows = len(self._there)
        look(
            self._there, np.zeros((rows, 3)), self._fresh.astype(np.float64), np.full(rows, 0.5), self._reach,
            self._constants, self._first, self._unseen_for, self._track, self._seen, self._visible,
        )  # fmt: skip
        known = self._fresh & ~np.isnan(self._given).any(axis=1)
        self._seen[known, VX:] = self._given[known]
        self._first = False
        visible = self._fresh.copy()
        self._fresh[:] = False
        return self._seen, visible


class _Vsss:
    def __init__(self, robots: int) -> None:
        self._robots = robots
        self._vision = channels("vsss")["vision"]

    def poses(self, packets: Sequence[Packet]) -> Iterable[tuple[int, F64]]:
        seen = [packet for packet in packets if packet.channel == self._vision][-1:]
        if not seen:
            return
        found = vsss.environments(*laid_out(seen))
        bodies = found.bodies
        velocities = np.nan_to_num(bodies[:, vsss.VELOCITY:])
        if not velocities.any():  # a simulator that does not send them
            velocities[:] = np.nan
        for body, velocity in zip(bodies, velocities, strict=True):
            row = _row(int(body[vsss.TEAM]), int(body[vsss.ID]), self._robots)
            if row is not None:
                yield row, np.array([body[vsss.X], body[vsss.Y], body[vsss.THETA], *velocity])


class _Ssl:
    """Robots as the camera saw them that sent last, and the ball that is seen most surely."""

    def __init__(self, robots: int) -> None:
        self._robots = robots
        self._channels = channels("ssl")

    def poses(self, packets: Sequence[Packet]) -> Iterable[tuple[int, F64]]:
        kinds = (self._channels["vision"], self._channels["vision-2010"])
        seen = [packet for packet in packets if packet.channel in kinds]
        if not seen:
            return
        detections, _ = vision.detections(ssl_batch(seen))
        bodies = detections.bodies
        balls = bodies[bodies[:, vision.TEAM] == vision.BALL]
        if len(balls):
            best = balls[np.nan_to_num(balls[:, vision.CONFIDENCE]).argmax()]
            yield BALL, np.array([best[vision.X], best[vision.Y], np.nan, np.nan, np.nan, np.nan])
        for body in bodies[bodies[:, vision.TEAM] != vision.BALL]:
            team = vsss.YELLOW if body[vision.TEAM] == vision.YELLOW else vsss.BLUE
            row = _row(team, int(body[vision.ID]), self._robots)
            if row is not None:
                yield row, np.array([body[vision.X], body[vision.Y], body[vision.THETA], *[np.nan] * 3])


def _row(team: int, number: int, robots: int) -> int | None:
    """Row of a body of a team of ``vsss``: 0 the ball, then blue's robots, then yellow's; None beyond N."""
    if team == vsss.BALL:
        return BALL
    if not 0 <= number < robots:
        return None
    return 1 + number if team == vsss.BLUE else 1 + robots + number


def ssl_batch(packets: Sequence[Packet]) -> Batch:
    """Packets as the reader of SSL logs takes them."""
    data, start, end = laid_out(packets)
    count = len(packets)
    times = np.column_stack((np.arange(count), [packet.t_ns for packet in packets]))
    return Batch(data, times, np.array([packet.channel for packet in packets], np.int32), start, end, 0)


_EYES: dict[LeagueName, Callable[[int], Eye]] = {"vsss": _Vsss, "ssl": _Ssl}
