"""Wheel speeds: toward a direction, a place or a pose; round other robots and along walls.

All functions take a team's view, float64 [1 + 2 N, 6], and the row of one of its own robots, 1 to N, and
write the robot's row of ``wheels``, float64 [N, 2], left and right in m/s, each within ± ``m.top``.
Directions are pairs (dx, dy) of any length.
"""

from __future__ import annotations

import math

from pitchlore.pipeline.game.bodies import OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.tactics.geometry import along, clamp, offset
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

#: Which end of the robot goes first.
BACK, EITHER, FRONT = -1, 0, 1

# The univector field of hyperbolic spirals and its numbers: Y. S. Lim et al., "Evolutionary univector
# field-based navigation with collision avoidance for mobile robot", IFAC World Congress 2008, in the
# variant of rSoccer (univectorPosture.py, 7.37 and 6.15 cm for robots of 7.5 cm), here in robot radii.
_TURNING = 7.37 / 3.75
_SMOOTHING = 6.15 / 3.75
# The same source's spread of an obstacle's influence, 4.57 cm beyond its least distance, 3.48 cm.
_SPREAD = 4.57 / 3.75
_LEAST = 3.48 / 3.75
# A robot that does less than this share of what its wheels are told is held.
_HINDERED = 0.25


@njit(cache=True, nogil=True, error_model="numpy")
def set_wheels(v: float, omega: float, robot: int, m: Measures, wheels: F64) -> None:
    """Set forward speed and turn rate; if the wheels cannot do both, the turn has precedence."""
    spin = clamp(0.5 * omega * m.axle, m.top)
    v = clamp(v, m.top - abs(spin))
    wheels[robot - 1, 0] = v - spin
    wheels[robot - 1, 1] = v + spin


@njit(cache=True, nogil=True, error_model="numpy")
def steer(
    view: F64, robot: int, dx: float, dy: float, speed: float, end: int, m: Measures, wheels: F64
) -> None:
    """Drive in a direction, slower the further the robot has yet to turn; (0, 0) stops it.

    Its speed is ``speed`` once it has turned, m/s, at least 0. As ``end`` says, FRONT or BACK goes first, or
    EITHER, the one that is nearer to the direction.
    """
    cos, sin = math.cos(view[robot, THETA]), math.sin(view[robot, THETA])
    ahead, across = cos * dx + sin * dy, cos * dy - sin * dx
    length = math.sqrt(ahead * ahead + across * across)
    if length == 0.0:
        set_wheels(0.0, 0.0, robot, m, wheels)
        return
    sign = -1.0 if end == BACK or (end == EITHER and ahead < 0.0) else 1.0
    ahead, across = sign * ahead, sign * across
    share = max(ahead, 0.0) / length
    set_wheels(sign * speed * share * share, m.gain * math.atan2(across, ahead), robot, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def face(view: F64, robot: int, dx: float, dy: float, m: Measures, wheels: F64) -> None:
    """Turn on the spot until the front points in a direction."""
    steer(view, robot, dx, dy, 0.0, FRONT, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def drive_to(
    view: F64, robot: int, x: float, y: float, speed: float, end: int, m: Measures, wheels: F64
) -> None:
    """Drive straight to a place and stop there."""
    dx, dy = x - view[robot, X], y - view[robot, Y]
    left = math.sqrt(dx * dx + dy * dy)
    if left < 0.1 * m.radius:
        set_wheels(0.0, 0.0, robot, m, wheels)
    else:
        steer(view, robot, dx, dy, min(speed, m.arrival * left), end, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def to_pose(
    x: float, y: float, gx: float, gy: float, ux: float, uy: float, m: Measures
) -> tuple[float, float]:
    """The direction, of length 1 at most, in which the univector field leads from (x, y) to a pose.

    The pose is at (gx, gy), metres, in the direction (ux, uy) of length 1. The field winds round a circle on
    either side of the pose; behind the pose it is the mean of both. Ahead of it the mean would lead straight
    back over what lies at the pose, so there it is the nearer one. The field passes the pose within 2.2 cm
    on the VSSS pitch, within 15 degrees of its direction.
    """
    turning = _TURNING * m.radius
    ahead = (x - gx) * ux + (y - gy) * uy
    aside = (y - gy) * ux - (x - gx) * uy
    if ahead < turning:
        width = turning - max(ahead, 0.0)
        share = min(max(0.5 + 0.5 * aside / width, 0.0), 1.0)  # of the circle on the left
    else:
        share = 1.0 if aside >= 0.0 else 0.0
    lx = ly = 0.0
    if share > 0.0:
        angle = _spiral(ahead, aside - turning, turning, _SMOOTHING * m.radius)
        lx, ly = share * math.cos(angle), share * math.sin(angle)
    if share < 1.0:
        angle = _spiral(ahead, -aside - turning, turning, _SMOOTHING * m.radius)
        lx += (1.0 - share) * math.cos(angle)
        ly -= (1.0 - share) * math.sin(angle)
    return lx * ux - ly * uy, lx * uy + ly * ux


@njit(cache=True, nogil=True, error_model="numpy")
def _spiral(x: float, y: float, turning: float, smoothing: float) -> float:
    """Direction of the spiral that winds counter-clockwise on to the circle around the origin, radians."""
    rho = math.sqrt(x * x + y * y)
    outside = rho > turning
    turn = 2.0 - (turning + smoothing) / (rho + smoothing) if outside else math.sqrt(rho / turning)
    return math.atan2(y, x) + 0.5 * math.pi * turn


@njit(cache=True, nogil=True, error_model="numpy")
def around(
    view: F64, robot: int, dx: float, dy: float, reach: float, m: Measures
) -> tuple[float, float]:
    """The direction, bent round each robot in its way, on the side that it already passes.

    Robots further off than ``reach``, metres, are not in the way. The direction gets the length 1; (0, 0)
    stays as it is.
    """
    length = math.sqrt(dx * dx + dy * dy)
    if length == 0.0:
        return 0.0, 0.0
    dx, dy = dx / length, dy / length
    reach = min(reach, (_LEAST + 3.0 * _SPREAD) * m.radius)
    for other in range(1, view.shape[0]):
        ox, oy = offset(view, robot, other)
        squared = ox * ox + oy * oy
        if other == robot or squared > reach * reach or squared == 0.0 or ox * dx + oy * dy <= 0.0:
            continue
        distance = math.sqrt(squared)
        beyond = max(distance / m.radius - _LEAST, 0.0) / _SPREAD
        weight = math.exp(-0.5 * beyond * beyond)
        side = 1.0 if ox * dy - oy * dx >= 0.0 else -1.0
        dx += weight * (-side * oy / distance - dx)
        dy += weight * (side * ox / distance - dy)
        length = math.sqrt(dx * dx + dy * dy)
        if length > 0.0:
            dx, dy = dx / length, dy / length
    return dx, dy


@njit(cache=True, nogil=True, error_model="numpy")
def along_walls(view: F64, robot: int, dx: float, dy: float, m: Measures) -> tuple[float, float]:
    """The direction without its part into a wall that the robot touches; goal mouths count as walls."""
    margin = 1.15 * m.radius
    x, y = view[robot, X], view[robot, Y]
    if abs(x) > m.goal_x - margin and x * dx > 0.0:
        dx = 0.0
    if abs(y) > m.half_width - margin and y * dy > 0.0:
        dy = 0.0
    return dx, dy


@njit(cache=True, nogil=True, error_model="numpy")
def held(view: F64, robot: int, m: Measures, wheels: F64) -> bool:
    """True if a robot hardly moves although its wheels turn, as if something is in its way.

    That is so if the floor passes under its wheels at less than ``_HINDERED`` of the speed that they are
    told, both wheels together (the projection on what they are told). Wheels that have to change their
    direction look the same until they have caught up.
    """
    left, right = wheels[robot - 1, 0], wheels[robot - 1, 1]
    if max(abs(left), abs(right)) <= m.moving:
        return False
    v = along(view, robot, view[robot, VX], view[robot, VY])
    turn = 0.5 * m.axle * view[robot, OMEGA]
    done = left * (v - turn) + right * (v + turn)
    return bool(done < _HINDERED * (left * left + right * right))
