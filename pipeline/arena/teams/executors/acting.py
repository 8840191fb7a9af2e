"""A frame of an action: the controller of its code, then whether it is over."""

from __future__ import annotations

from numba import njit

from pipeline.arena.teams.ball import has_ball, touches
from pipeline.arena.teams.executors import actions, to_ball, to_things, with_ball
from pipeline.arena.teams.executors.actions import CODE, FRAMES, HAD, LEFT, OTHER, RIGHT
from pipeline.arena.teams.executors.endings import is_over
from pipeline.arena.teams.measures import Measures
from pipeline.arena.teams.steering import EITHER, face, set_wheels, steer
from pipeline.bodies import F64, X, Y


@njit(cache=True, nogil=True, error_model="numpy")
def act(robot: int, view: F64, m: Measures, memory: F64, wheels: F64) -> bool:
    """Carry on an action for a frame.

    Args:
        robot: row of the robot in the view, 1 to N.
        view: float64 [1 + 2 N, 6], the team's, at this frame.
        m: measures.
        memory: float64 [FIELDS], the robot's, as :func:`start` and the frames since left it.
        wheels: float64 [N, 2], the robot's row is written: its left and right wheel, m/s. They are good
            for this frame also when the action is over.

    Returns:
        Whether the action is over: its final condition holds, its time is up after this frame, or the
        robot that it is done to does not exist.
    """
    code = int(memory[CODE])
    verb, thing, other = actions.VERB[code], actions.THING[code], int(memory[OTHER])
    if thing >= actions.OPPONENT and other < 0:
        set_wheels(0.0, 0.0, robot, m, wheels)
        return True
    if has_ball(view, robot, m) or (verb == actions.KICK and touches(view, robot, m)):
        memory[HAD] = 1.0
    x, y = actions.place_of(view, thing, other, m)
    _control(view, robot, verb, thing, other, x, y, m, memory, wheels)
    over = is_over(view, robot, verb, other, x, y, m, memory)
    memory[FRAMES] += 1.0
    return over or (memory[FRAMES] + 0.5) * m.frame_s >= actions.LIMIT_S[code]


@njit(cache=True, nogil=True, error_model="numpy")
def _control(
    view: F64, robot: int, verb: int, thing: int, other: int, x: float, y: float, m: Measures, memory: F64,
    wheels: F64,
) -> None:
    """Do what the verb says to a thing, which is at (x, y)."""
    dx, dy = x - view[robot, X], y - view[robot, Y]
    if verb == actions.HOLD:
        with_ball.hold(view, robot, m, wheels)
    elif verb == actions.GUIDE:
        with_ball.guide(view, robot, m, wheels)
    elif verb == actions.KICK:
        with_ball.kick(view, robot, m, memory, wheels)
    elif verb == actions.GIVE:
        with_ball.give(view, robot, other, m, memory, wheels)
    elif verb == actions.REACH:
        to_ball.reach(view, robot, m, wheels)
    elif verb == actions.RECEIVE:
        to_ball.receive(view, robot, m, wheels)
    elif verb == actions.BLOCK:
        to_ball.block(view, robot, m, wheels)
    elif verb == actions.APPROACH:
        to_things.approach(view, robot, thing, x, y, m, wheels)
    elif verb in (actions.LEAVE, actions.RECEDE):
        to_things.recede(view, robot, x, y, m, wheels)
    elif verb == actions.FACE:
        face(view, robot, dx, dy, m, wheels)
    elif verb == actions.LEVEL_X:
        steer(view, robot, dx, 0.0, m.top, EITHER, m, wheels)
    elif verb == actions.LEVEL_Y:
        steer(view, robot, 0.0, dy, m.top, EITHER, m, wheels)
    elif verb == actions.WANDER:
        wheels[robot - 1, 0], wheels[robot - 1, 1] = memory[LEFT], memory[RIGHT]
    else:  # STAND
        set_wheels(0.0, 0.0, robot, m, wheels)
