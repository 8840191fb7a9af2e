"""Bodies on the pitch as the arena moves them and players see them: one array, one row a body.

Row 0 is the ball, rows 1 to N the first team's robots, rows N + 1 to 2 N the second's.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

#: Structured array; its dtype names the fields.
Records = npt.NDArray[np.void]
#: One record: a row of such an array, or one of shape []; numpy has no types for fields.
Record = Any

#: Columns: metres, radians (counter-clockwise from +x), metres and radians a second.
X, Y, THETA, VX, VY, OMEGA = range(6)
COLUMNS = 6

BALL = 0


@njit(cache=True, nogil=True)
def wrapped(angle: float) -> float:
    """The same angle in (-pi, pi]."""
    return math.atan2(math.sin(angle), math.cos(angle))


@njit(cache=True, nogil=True)
def see(bodies: F64, team: int, attacks: float, out: F64) -> None:
    """The bodies as a team sees them: its own robots first, its own goal at -x.

    Args:
        bodies: float64 [1 + 2 N, 6] in the pitch frame; rows 1 to N are home's, then away's.
        team: 0 home, 1 away.
        attacks: +1 if the team attacks +x, -1 if -x; then everything is turned by half a turn.
        out: float64 [1 + 2 N, 6], the view; THETA in (-pi, pi].
    """
    count = (bodies.shape[0] - 1) // 2
    for row in range(bodies.shape[0]):
        source = row
        if team == 1 and row > 0:
            source = row + count if row <= count else row - count
        out[row, X] = attacks * bodies[source, X]
        out[row, Y] = attacks * bodies[source, Y]
        out[row, VX] = attacks * bodies[source, VX]
        out[row, VY] = attacks * bodies[source, VY]
        out[row, OMEGA] = bodies[source, OMEGA]
        theta = bodies[source, THETA]
        if attacks < 0:
            theta += math.pi if theta <= 0.0 else -math.pi
        if not -math.pi < theta <= math.pi:
            theta = wrapped(theta)
        out[row, THETA] = theta


@njit(cache=True, nogil=True)
def see_both(bodies: F64, home_attacks: float, out: F64) -> None:
    """The bodies as both teams :func:`see` them.

    Args:
        bodies: float64 [1 + 2 N, 6] in the pitch frame; rows 1 to N are home's, then away's.
        home_attacks: +1 if home attacks +x, -1 if -x.
        out: float64 [2, 1 + 2 N, 6], the views of home and of away.
    """
    see(bodies, 0, home_attacks, out[0])
    see(bodies, 1, -home_attacks, out[1])
