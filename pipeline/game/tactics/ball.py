"""The ball as a robot meets it: whether the robot has it, where it will be, and driving that moves it.

All functions take a team's view, float64 [1 + 2 N, 6], and the row of one of its robots, 1 to N.
Those that drive write the robot's row of ``wheels``, see :mod:`pipeline.game.tactics.steering`.
"""

from __future__ import annotations

import math

from pitchlore.pipeline.game.bodies import BALL, VX, VY, X, Y
from pitchlore.pipeline.game.tactics.geometry import along, clamp, distance, offset, speed_of, unit_vector
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.steering import FRONT, steer
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

#: Half angle at which the recogniser's term FACING crosses 0.5, cosine.
COS_FACING = math.cos(math.radians(30))

#: Teams that have the ball, as a team sees it.
NOBODY, OWN, OTHER = range(3)

# Longest prediction of the ball's way, seconds.
_AHEAD_S = 0.5


@njit(cache=True, nogil=True, error_model="numpy")
def touches_ball(view: F64, row: int, m: Measures) -> bool:
    """True if a robot, here of any team, touches the ball."""
    return distance(view, row, BALL) < m.contact


@njit(cache=True, nogil=True, error_model="numpy")
def has_ball(view: F64, robot: int, m: Measures) -> bool:
    """True if a robot touches the ball and heads at it within 30 degrees: the recogniser's has_ball."""
    dx, dy = offset(view, robot, BALL)
    off = math.sqrt(dx * dx + dy * dy)
    if off >= m.contact:
        return False
    return along(view, robot, dx, dy) > COS_FACING * off


@njit(cache=True, nogil=True, error_model="numpy")
def holder(view: F64, before: int, m: Measures) -> int:
    """The team that had the ball alone last: OWN, OTHER, or NOBODY since play started.

    A team has the ball from its touch until the other team touches or both do, as in the stage events
    (:mod:`pipeline.stages.events.control`). A ball behind a goal line is not touched. Unlike there, a touch
    is not carried over samples without contact, because that needs later samples.

    Args:
        view: float64 [1 + 2 N, 6].
        before: the team at the frame before.
        m: measures.
    """
    if abs(view[BALL, X]) > m.goal_x:
        return before
    count = (len(view) - 1) // 2
    own = other = False
    for row in range(1, count + 1):
        own = own or touches_ball(view, row, m)
        other = other or touches_ball(view, count + row, m)
    if own == other:
        return before
    return OWN if own else OTHER


@njit(cache=True, nogil=True, error_model="numpy")
def soon(view: F64, robot: int, m: Measures) -> tuple[float, float]:
    """Place of the ball, x and y, when a robot can be there: on the pitch, at most half a second ahead."""
    ahead_s = min(distance(view, robot, BALL) / m.top, _AHEAD_S)
    x, y = view[BALL, X] + ahead_s * view[BALL, VX], view[BALL, Y] + ahead_s * view[BALL, VY]
    return clamp(x, m.goal_x), clamp(y, m.half_width)


@njit(cache=True, nogil=True, error_model="numpy")
def coming(view: F64, robot: int, m: Measures) -> tuple[float, float, float, float]:
    """How the ball rolls toward a robot; all numbers are 0 if it does not.

    Returns:
        Its speed, m/s; x and y of its direction, (ux, uy) of length 1; and ``aside``: its way passes the
        robot's middle at this many metres times (uy, -ux).
    """
    dx, dy = offset(view, robot, BALL)
    vx, vy = view[BALL, VX], view[BALL, VY]
    speed = speed_of(view, BALL)
    if speed > m.moving and dx * vx + dy * vy < 0.0:
        ux, uy = vx / speed, vy / speed
        return speed, ux, uy, dx * uy - dy * ux
    return 0.0, 0.0, 0.0, 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def push(
    view: F64, robot: int, tx: float, ty: float, speed: float, round_it: float, m: Measures, wheels: F64
) -> None:
    """Push a ball that is in front at ``speed``, m/s, so that it goes to the place (tx, ty), metres.

    The robot aims behind the ball's middle, by the share ``round_it`` of the distance at which they touch.
    The more, the quicker the ball is turned, and the sooner lost.
    """
    ux, uy = unit_vector(tx - view[BALL, X], ty - view[BALL, Y])
    dx, dy = offset(view, robot, BALL)
    back = round_it * m.touch if dx * ux + dy * uy > 0.0 else 0.0
    steer(view, robot, dx - back * ux, dy - back * uy, speed, FRONT, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def spin(view: F64, robot: int, dx: float, dy: float, m: Measures, wheels: F64) -> None:
    """Spin so that the side of the robot at which the ball lies hits it in a direction, as well as it can."""
    rx, ry = offset(view, robot, BALL)
    wheels[robot - 1, 1] = m.top if rx * dy - ry * dx >= 0.0 else -m.top
    wheels[robot - 1, 0] = -wheels[robot - 1, 1]
