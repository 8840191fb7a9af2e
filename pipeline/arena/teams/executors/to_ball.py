"""Controllers toward the ball: reach it, receive it, stand in its way."""

from __future__ import annotations

import math

from numba import njit

from pipeline.arena.teams.ball import coming, soon
from pipeline.arena.teams.geometry import offset, unit
from pipeline.arena.teams.measures import Measures
from pipeline.arena.teams.steering import BACK, EITHER, FRONT, along_walls, drive_to, face, steer, to_pose
from pipeline.bodies import BALL, F64, X, Y

#: From further ahead of the ball than this (cosine), it is reached from behind instead of straight on.
COS_AHEAD = -0.3
# A robot that goes round the ball keeps off it by so many contact distances.
_CLEAR = 1.3


@njit(cache=True, nogil=True, error_model="numpy")
def reach(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """044: to the ball, so that it is not driven away from the adversary's goal."""
    go_behind(view, robot, m.goal_x, 0.0, COS_AHEAD, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def go_behind(
    view: F64, robot: int, tx: float, ty: float, cos_behind: float, m: Measures, wheels: F64
) -> None:
    """To where the ball will be: straight on, or round it if that would drive it away from a place.

    It goes round if the cosine of its bearing off the line to the place (tx, ty) is less than
    ``cos_behind``.
    """
    x, y = view[robot, X], view[robot, Y]
    bx, by = soon(view, robot, m)
    dx, dy = bx - x, by - y
    ux, uy = unit(tx - bx, ty - by)
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
def receive(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """045: face the ball and meet it on its way, slower than it comes."""
    ball = coming(view, robot, m)
    aside, off = ball.aside, abs(ball.aside)
    if ball.comes and off > 0.5 * m.radius:
        dx, dy = aside * ball.uy - off * ball.ux, -aside * ball.ux - off * ball.uy
        steer(view, robot, dx, dy, min(m.top, 0.7 * ball.speed), FRONT, m, wheels)
    else:
        dx, dy = offset(view, robot, BALL)
        face(view, robot, dx, dy, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def block(view: F64, robot: int, m: Measures, wheels: F64) -> None:
    """047: stand with the side across the ball's way; a ball that does not come is met with the back."""
    ball = coming(view, robot, m)
    dx, dy = offset(view, robot, BALL)
    if ball.comes:
        ux, uy, off = ball.ux, ball.uy, abs(ball.aside)
        if off < 0.25 * m.radius:
            steer(view, robot, uy, -ux, 0.0, EITHER, m, wheels)
        else:
            speed = min(m.top, m.arrival * off)
            steer(view, robot, ball.aside * uy, -ball.aside * ux, speed, EITHER, m, wheels)
    elif dx * dx + dy * dy < m.close * m.close:
        steer(view, robot, dx, dy, m.top, BACK, m, wheels)
    else:
        # its way to the own goal
        ux, uy = unit(-m.goal_x - view[BALL, X], -view[BALL, Y])
        aside = dx * uy - dy * ux
        x, y = view[robot, X] + aside * uy, view[robot, Y] - aside * ux
        drive_to(view, robot, x, y, m.top, EITHER, m, wheels)
