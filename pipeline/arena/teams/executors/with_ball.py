"""Controllers with the ball: hold, guide, kick, give it away; a robot that has lost it gets it back."""

from __future__ import annotations

import math

from numba import njit

from pipeline.arena.teams.ball import COS_FACING, has_ball, push, spin, touches
from pipeline.arena.teams.executors.actions import GONE
from pipeline.arena.teams.executors.to_ball import COS_AHEAD, go_behind, reach
from pipeline.arena.teams.geometry import along, distance, offset, speed_of, unit
from pipeline.arena.teams.measures import Measures
from pipeline.arena.teams.steering import EITHER, face, set_wheels, steer
from pipeline.bodies import BALL, F64, VX, VY, Record, X, Y

# A gap to a ball that is held is closed at so many times its width a second.
_GRIP = 4.0
# A pass is begun from within this of its line (cosine).
_COS_PASS = 0.5
# Share of the top speed at which a ball is pushed before it is let go, and longest push, seconds.
_LET_GO, _PUSH_S = 0.8, 0.3


@njit(cache=True, nogil=True, error_model="numpy")
def hold(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """001: stay at the ball and slow it down."""
    if not has_ball(view, robot, m):
        reach(view, robot, m, wheels)
        return
    gap = distance(view, robot, BALL) - m.touch
    speed = 0.8 * along(view, robot, view[BALL, VX], view[BALL, VY]) + _GRIP * gap
    dx, dy = offset(view, robot, BALL)
    face(view, robot, dx, dy, m, wheels)
    turning = 0.5 * (wheels[robot - 1, 1] - wheels[robot - 1, 0])
    set_wheels(speed, 2.0 * turning / m.axle, robot, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def guide(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """011: push the ball to the adversary's goal without letting it go."""
    if not has_ball(view, robot, m):
        reach(view, robot, m, wheels)
        return
    rolls = max(along(view, robot, view[BALL, VX], view[BALL, VY]), 0.0)
    push(view, robot, m.goal_x, 0.0, min(rolls + 2.0 * m.moving, 0.7 * m.top), 0.25, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def kick(view: F64, robot: int, m: Measures, own: Record, wheels: F64) -> None:
    """021: shoot at the adversary's goal; a ball beside the robot is struck by spinning."""
    dx, dy = offset(view, robot, BALL)
    off = math.sqrt(dx * dx + dy * dy)
    if off < m.contact and abs(along(view, robot, dx, dy)) < COS_FACING * off:
        spin(view, robot, m.goal_x - view[BALL, X], -view[BALL, Y], m, wheels)
    else:
        _strike(view, robot, m.goal_x, 0.0, COS_AHEAD, m, own, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def give(view: F64, robot: int, other: int, m: Measures, own: Record, wheels: F64) -> None:
    """022, 023: push the ball to an opponent, pass it to a teammate; back off once the other touches it."""
    if own["had_ball"] and touches(view, other, m):
        dx, dy = offset(view, BALL, robot)
        steer(view, robot, dx, dy, m.top, EITHER, m, wheels)
    else:
        _strike(view, robot, view[other, X], view[other, Y], _COS_PASS, m, own, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _strike(
    view: F64, robot: int, tx: float, ty: float, cos_behind: float, m: Measures, own: Record, wheels: F64
) -> None:
    """Push the ball to a place as fast as can be, then stop and let it run.

    A robot that is not behind the ball, in that the cosine of its bearing off the line to the place is
    less than ``cos_behind``, goes round it first.
    """
    if own["lasted"] == GONE:
        set_wheels(0.0, 0.0, robot, m, wheels)
        return
    dx, dy = offset(view, robot, BALL)
    ux, uy = unit(tx - view[BALL, X], ty - view[BALL, Y])
    behind = dx * ux + dy * uy > cos_behind * math.sqrt(dx * dx + dy * dy)
    if not own["had_ball"] or not behind:
        go_behind(view, robot, tx, ty, cos_behind, m, wheels)
        return
    own["lasted"] += 1
    if speed_of(view, robot) > _LET_GO * m.top or own["lasted"] * m.frame_s > _PUSH_S:
        own["lasted"] = GONE
    push(view, robot, tx, ty, m.top, 0.5, m, wheels)
