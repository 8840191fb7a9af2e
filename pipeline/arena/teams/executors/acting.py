"""A frame of an action: the controller of its code, then whether it is over."""

from __future__ import annotations

from numba import njit

from pipeline.arena.teams.ball import has_ball, touches
from pipeline.arena.teams.executors import actions, to_ball, to_things, with_ball
from pipeline.arena.teams.executors.actions import Aim
from pipeline.arena.teams.executors.endings import is_over
from pipeline.arena.teams.measures import Measures
from pipeline.arena.teams.steering import EITHER, face, set_wheels, steer
from pipeline.bodies import F64, Record, X, Y


@njit(cache=True, nogil=True, error_model="numpy")
def act(robot: int, view: F64, m: Measures, own: Record, wheels: F64) -> bool:
    """Carry on an action for a frame.

    Args:
        robot: row of the robot in the view, 1 to N.
        view: float64 [1 + 2 N, 6], the team's, at this frame.
        m: measures.
        own: the robot's record of :data:`~pipeline.arena.teams.executors.ACTION`, as :func:`start` and the
            frames since left it.
        wheels: float64 [N, 2], the robot's row is written: its left and right wheel, m/s. They are good
            for this frame also when the action is over.

    Returns:
        Whether the action is over: its final condition holds, its time is up after this frame, or the
        robot that is its aim does not exist.
    """
    code = own["code"]
    verb, thing = actions.VERB[code], actions.THING[code]
    if thing >= actions.OPPONENT and own["other"] < 0:
        set_wheels(0.0, 0.0, robot, m, wheels)
        return True
    if has_ball(view, robot, m) or (verb == actions.KICK and touches(view, robot, m)):
        own["had_ball"] = True
    aim = actions.aim_of(view, thing, own["other"], m)
    _control(view, robot, verb, aim, m, own, wheels)
    over = is_over(view, robot, verb, aim, m, own)
    own["frames"] += 1
    return over or (own["frames"] + 0.5) * m.frame_s >= actions.LIMIT_S[code]


@njit(cache=True, nogil=True, error_model="numpy")
def _control(
    view: F64, robot: int, verb: int, aim: Aim, m: Measures, own: Record, wheels: F64
) -> None:
    """Let the controller ``verb`` write the wheels of the robot."""
    dx, dy = aim.x - view[robot, X], aim.y - view[robot, Y]
    if verb == actions.HOLD:
        with_ball.hold(view, robot, m, wheels)
    elif verb == actions.GUIDE:
        with_ball.guide(view, robot, m, wheels)
    elif verb == actions.KICK:
        with_ball.kick(view, robot, m, own, wheels)
    elif verb == actions.GIVE:
        with_ball.give(view, robot, aim.row, m, own, wheels)
    elif verb == actions.REACH:
        to_ball.reach(view, robot, m, wheels)
    elif verb == actions.RECEIVE:
        to_ball.receive(view, robot, m, wheels)
    elif verb == actions.BLOCK:
        to_ball.block(view, robot, m, wheels)
    elif verb == actions.APPROACH:
        to_things.approach(view, robot, aim, m, wheels)
    elif verb in (actions.LEAVE, actions.RECEDE):
        to_things.recede(view, robot, aim, m, wheels)
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
