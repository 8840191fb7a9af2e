"""Controllers of all codes: with the ball, to the ball, and to or from things.

With the ball they hold, guide, kick or give it away; a robot that has lost it gets it back.
"""

from __future__ import annotations

import math

from pitchlore.pipeline.game.bodies import BALL, VX, VY, Record, X, Y
from pitchlore.pipeline.game.tactics.ball import COS_FACING, coming, has_ball, push, soon, spin, touches_ball
from pitchlore.pipeline.game.tactics.executors import actions
from pitchlore.pipeline.game.tactics.executors.actions import GONE
from pitchlore.pipeline.game.tactics.geometry import along, distance, offset, speed_of, unit_vector
from pitchlore.pipeline.game.tactics.goalkeeping import OFF_LINE, keep_line
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.steering import (
    BACK,
    EITHER,
    FRONT,
    along_walls,
    drive_to,
    face,
    set_wheels,
    steer,
    to_pose,
)
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

# From further ahead of the ball than this (cosine), it is reached from behind instead of straight on.
_COS_AHEAD = -0.3
# A robot that goes round the ball keeps off it by so many contact distances.
_CLEAR = 1.3
# A gap to a ball that is held is closed at so many times its width a second.
_GRIP = 4.0
# A pass is begun from within this of its line (cosine).
_COS_PASS = 0.5
# Share of the top speed at which a ball is pushed before it is let go, and longest push, seconds.
_LET_GO, _PUSH_S = 0.8, 0.3


@njit(cache=True, nogil=True, error_model="numpy")
def control(
    view: F64, robot: int, verb: int, thing: int, dx: float, dy: float, m: Measures, own: Record, wheels: F64
) -> None:
    """Let the controller ``verb`` write the wheels of the robot; its aim is at (dx, dy) from the robot."""
    lost = verb in (actions.HOLD, actions.GUIDE) and not has_ball(view, robot, m)
    if lost or verb == actions.REACH:
        _reach(view, robot, m, wheels)
    elif verb == actions.HOLD:
        _hold(view, robot, m, wheels)
    elif verb == actions.GUIDE:
        _guide(view, robot, m, wheels)
    elif verb == actions.KICK:
        _kick(view, robot, m, own, wheels)
    elif verb == actions.GIVE:
        _give(view, robot, own["other"], m, own, wheels)
    elif verb == actions.RECEIVE:
        _receive(view, robot, m, wheels)
    elif verb == actions.BLOCK:
        _block(view, robot, m, wheels)
    elif verb == actions.APPROACH:
        _approach(view, robot, thing, dx, dy, m, wheels)
    elif verb in (actions.LEAVE, actions.RECEDE):
        _recede(view, robot, dx, dy, m, wheels)
    elif verb == actions.FACE:
        face(view, robot, dx, dy, m, wheels)
    elif verb == actions.LEVEL_X:
        steer(view, robot, dx, 0.0, m.top, EITHER, m, wheels)
    elif verb == actions.LEVEL_Y:
        steer(view, robot, 0.0, dy, m.top, EITHER, m, wheels)
    elif verb == actions.WANDER:
        wheels[robot - 1, 0], wheels[robot - 1, 1] = own["left"], own["right"]
    else:  # STAND
        set_wheels(0.0, 0.0, robot, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _hold(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """001: stay at the ball and slow it down."""
    gap = distance(view, robot, BALL) - m.touch
    speed = 0.8 * along(view, robot, view[BALL, VX], view[BALL, VY]) + _GRIP * gap
    dx, dy = offset(view, robot, BALL)
    face(view, robot, dx, dy, m, wheels)
    turning = 0.5 * (wheels[robot - 1, 1] - wheels[robot - 1, 0])
    set_wheels(speed, 2.0 * turning / m.axle, robot, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _guide(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """011: push the ball to the adversary's goal without letting it go."""
    rolls = max(along(view, robot, view[BALL, VX], view[BALL, VY]), 0.0)
    push(view, robot, m.goal_x, 0.0, min(rolls + 2.0 * m.moving, 0.7 * m.top), 0.25, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _kick(view: F64, robot: int, m: Measures, own: Record, wheels: F64) -> None:
    """021: shoot at the adversary's goal; a ball beside the robot is struck by spinning."""
    dx, dy = offset(view, robot, BALL)
    off = math.sqrt(dx * dx + dy * dy)
    if off < m.contact and abs(along(view, robot, dx, dy)) < COS_FACING * off:
        spin(view, robot, m.goal_x - view[BALL, X], -view[BALL, Y], m, wheels)
    else:
        _strike(view, robot, m.goal_x, 0.0, _COS_AHEAD, m, own, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _give(view: F64, robot: int, other: int, m: Measures, own: Record, wheels: F64) -> None:
    """022, 023: push the ball to an opponent, pass it to a teammate; back off once the other touches it."""
    if own["had_ball"] and touches_ball(view, other, m):
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
    ux, uy = unit_vector(tx - view[BALL, X], ty - view[BALL, Y])
    behind = dx * ux + dy * uy > cos_behind * math.sqrt(dx * dx + dy * dy)
    if not own["had_ball"] or not behind:
        _go_behind(view, robot, tx, ty, cos_behind, m, wheels)
        return
    own["lasted"] += 1
    if speed_of(view, robot) > _LET_GO * m.top or own["lasted"] * m.frame_s > _PUSH_S:
        own["lasted"] = GONE
    push(view, robot, tx, ty, m.top, 0.5, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _reach(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """044: to the ball, so that it is not driven away from the adversary's goal."""
    _go_behind(view, robot, m.goal_x, 0.0, _COS_AHEAD, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _go_behind(
    view: F64, robot: int, tx: float, ty: float, cos_behind: float, m: Measures, wheels: F64
) -> None:
    """To where the ball will be: straight on, or round it if that would drive it away from a place.

    It goes round if the cosine of its bearing off the line to the place (tx, ty) is less than
    ``cos_behind``.
    """
    x, y = view[robot, X], view[robot, Y]
    bx, by = soon(view, robot, m)
    dx, dy = bx - x, by - y
    ux, uy = unit_vector(tx - bx, ty - by)
    if dx * ux + dy * uy >= cos_behind * math.sqrt(dx * dx + dy * dy):
        steer(view, robot, dx, dy, m.top, FRONT, m, wheels)
        return
    ox, oy = offset(view, BALL, robot)
    dx, dy = to_pose(x, y, bx - m.touch * ux, by - m.touch * uy, ux, uy, m)
    end = FRONT
    if math.sqrt(ox * ox + oy * oy) < _CLEAR * m.contact:
        # first off the ball, without turning at it, which would strike it
        dx, dy, end = dx + 2.0 * ox / m.contact, dy + 2.0 * oy / m.contact, EITHER
    dx, dy = along_walls(view, robot, dx, dy, m)
    steer(view, robot, dx, dy, m.top, end, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _receive(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """045: face the ball and meet it on its way, slower than it comes."""
    speed, ux, uy, aside = coming(view, robot, m)
    off = abs(aside)
    if off > 0.5 * m.radius:
        dx, dy = aside * uy - off * ux, -aside * ux - off * uy
        steer(view, robot, dx, dy, min(m.top, 0.7 * speed), FRONT, m, wheels)
    else:
        dx, dy = offset(view, robot, BALL)
        face(view, robot, dx, dy, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _block(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """047: stand with the side across the ball's way; a ball that does not come is met with the back."""
    speed, ux, uy, aside = coming(view, robot, m)
    dx, dy = offset(view, robot, BALL)
    if speed > 0.0:
        off = abs(aside)
        if off < 0.25 * m.radius:
            steer(view, robot, uy, -ux, 0.0, EITHER, m, wheels)
        else:
            steer(view, robot, aside * uy, -aside * ux, min(m.top, m.arrival * off), EITHER, m, wheels)
    elif dx * dx + dy * dy < m.close * m.close:
        steer(view, robot, dx, dy, m.top, BACK, m, wheels)
    else:
        # its way to the own goal
        ux, uy = unit_vector(-m.goal_x - view[BALL, X], -view[BALL, Y])
        aside = dx * uy - dy * ux
        x, y = view[robot, X] + aside * uy, view[robot, Y] - aside * ux
        drive_to(view, robot, x, y, m.top, EITHER, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _approach(
    view: F64, robot: int, thing: int, dx: float, dy: float, m: Measures, wheels: F64
) -> None:
    """046, 088, 118, 138 to 140, 162, 163: drive straight to the aim.

    To a ball that is close already, to the place behind it; to the own goal, into its mouth and there to
    where the ball will cross the line.
    """
    if thing == actions.OWN_GOAL:
        # so that the goal's middle remains close
        close = math.sqrt(m.close * m.close - (OFF_LINE * m.radius) ** 2) * 0.95
        keep_line(view, robot, min(m.half_goal, close), m, wheels)
    elif thing == actions.ADVERSARY_GOAL:
        drive_to(view, robot, m.goal_x, 0.0, m.top, EITHER, m, wheels)
    elif thing == actions.THE_BALL and dx * dx + dy * dy < m.close * m.close:
        _reach(view, robot, m, wheels)
    else:
        steer(view, robot, dx, dy, m.top, FRONT if thing == actions.THE_BALL else EITHER, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _recede(view: F64, robot: int, dx: float, dy: float, m: Measures, wheels: F64) -> None:
    """033, 034, 098, 128, 150 to 152, 173, 174: drive straight away from the aim, along walls."""
    dx, dy = along_walls(view, robot, -dx, -dy, m)
    steer(view, robot, dx, dy, m.top, EITHER, m, wheels)
