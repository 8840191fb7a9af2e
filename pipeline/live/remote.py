"""A team that another program drives: the wheels that its packets ask for."""

from __future__ import annotations

import math

import numpy as np

from pitchlore.pipeline.arena.match.controllers import Controller
from pitchlore.pipeline.importers.ssl_logs.wire import VARINT, fields
from pitchlore.pipeline.live.encoding import WHEEL_M, Wheels
from pitchlore.pipeline.numbers.arrays import F64, U8


class RemoteController(Controller):
    """Turns the wheels as they were last asked for; they stand until somebody asks.

    Args:
        robots: N, robots of the team.
        top: greatest speed of a wheel, m/s.
    """

    def __init__(self, robots: int, top: float) -> None:
        self._asked = np.zeros((robots, 2))
        self._top = top

    def ask(self, command: Wheels) -> None:
        """Take up a command to one robot; one that the team does not have is left out."""
        speeds = (command.left, command.right)
        if 0 <= command.number < len(self._asked) and all(map(math.isfinite, speeds)):
            self._asked[command.number] = np.clip(speeds, -self._top, self._top)

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        wheels[:] = self._asked


def asked(data: bytes) -> list[Wheels]:
    """Commands in a packet to FIRASim; none if it cannot be decoded, or only replaces bodies."""
    content: U8 = np.frombuffer(data, dtype=np.uint8)
    packet, damaged = fields(content, np.array([0]), np.array([len(data)]))
    reported = packet.spans(1)
    commands, broken = fields(content, reported.value, reported.end)
    if damaged.any() or broken.any():
        return []
    robots = commands.spans(1)
    inner, bad = fields(content, robots.value, robots.end)
    number, yellow = np.zeros((2, len(robots.of)), np.int64)
    left, right = np.zeros((2, len(robots.of)))
    for values, field in ((number, 1), (yellow, 2)):
        of, whole = inner.varints(field)
        values[of] = whole
    for speeds, field in ((left, 6), (right, 7)):
        of, real = inner.reals(content, field)
        speeds[of] = real
    bad[inner.of[np.isin(inner.number, (1, 2)) & (inner.kind != VARINT)]] = True
    return [Wheels(bool(yellow[i]), int(number[i]), float(left[i] * WHEEL_M), float(right[i] * WHEEL_M))
            for i in np.flatnonzero(~bad).tolist()]
