"""When an action is over.

The final conditions are those of the recogniser's rules (:mod:`pipeline.stages.situations.rules`) at their
0.5 crossings, on the velocities of the moment. A situation that the recogniser says while a robot goes to a
thing, or from it, has no end of its own; its action ends at the next level of distance:

============ =======================================================================================
001          it has the ball (touches it and heads at it within 30 degrees) for 0.15 s
011          it has the ball, both move, it heads where the ball rolls within 45 degrees, for 0.40 s:
             longer than SHORT, and than 001 takes
021          after touching it, it no longer does, and the ball runs away from it: fast, or, let go,
             straight ahead and faster than the robot
022, 023     after having it, the robot no longer touches it and the opponent, teammate does; or the ball
             was let go and is beyond CLOSE: the rest is its own way
033          after having it, it no longer touches it, drives off it and is faster, and the ball is slow
034 098 128  the ball, own goal, adversary's goal is one level of distance further: past CLOSE, NEAR or FAR
150-152      an opponent is one level further: past CLOSE or NEAR
173 174      the same of a teammate
044 045      it has the ball
046 088 118  one level nearer: past FAR, NEAR or CLOSE; beginning within CLOSE, contact
138-140      one level nearer to an opponent: past NEAR or CLOSE
162 163      the same of a teammate
047          it touches the ball without heading at it
057 078 108  it heads at the thing within 24 degrees
067 068      its x, y is level with the ball's within a contact, the ball being beyond CLOSE
184          it stands, for 0.50 s: MEDIUM is 0.40 s, and speeds are taken over a window
194          none
============ =======================================================================================
"""

from __future__ import annotations

import math

from pitchlore.pipeline.game.bodies import BALL, VX, VY, Record
from pitchlore.pipeline.game.tactics.ball import COS_FACING, has_ball, touches_ball
from pitchlore.pipeline.game.tactics.executors import actions
from pitchlore.pipeline.game.tactics.executors.actions import GONE
from pitchlore.pipeline.game.tactics.geometry import along, distance, offset, speed_of
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit

# Durations of the conditions of 001, 011 and 184, seconds.
_GAINED_S, _GUIDED_S, _STOOD_S = 0.15, 0.40, 0.50
# Half angles at which the recogniser's terms very FACING and PARALLEL cross 0.5, cosines.
_COS_VERY, _COS_PARALLEL = math.cos(math.radians(24)), math.cos(math.radians(45))


@njit(cache=True, nogil=True, error_model="numpy")
def is_over(
    view: F64, robot: int, verb: int, dx: float, dy: float, m: Measures, own: Record
) -> bool:
    """True if an action's final condition holds after a frame; the module's table lists the conditions.

    Its aim is at (dx, dy) from the robot, metres. ``lasted`` of ``own``, a record of ``actions.ACTION``, is
    written.
    """
    away = math.hypot(dx, dy)
    if verb == actions.APPROACH:
        return bool(away < own["level"])
    if verb == actions.RECEDE:
        return bool(away > own["level"])
    if verb == actions.FACE:
        return along(view, robot, dx, dy) > _COS_VERY * away
    if verb == actions.LEVEL_X:
        return bool(abs(dx) < m.contact and away > m.close)
    if verb == actions.LEVEL_Y:
        return bool(abs(dy) < m.contact and away > m.close)
    if verb == actions.STAND:
        return _lasts(speed_of(view, robot) < m.moving, _STOOD_S, m, own)
    has = has_ball(view, robot, m)
    if verb in (actions.REACH, actions.RECEIVE):
        return has
    if verb == actions.BLOCK:
        return touches_ball(view, robot, m) and not has
    if verb == actions.HOLD:
        return _lasts(has, _GAINED_S, m, own)
    if verb == actions.GUIDE:
        both_move = speed_of(view, robot) > m.moving and speed_of(view, BALL) > m.moving
        return _lasts(has and both_move and _heads_along(view, robot), _GUIDED_S, m, own)
    if not own["had_ball"] or touches_ball(view, robot, m):
        return False
    if verb == actions.KICK:
        return _kicked(view, robot, own["lasted"] == GONE, m)
    if verb == actions.GIVE:
        let_go = own["lasted"] == GONE and distance(view, robot, BALL) > m.close
        return let_go or touches_ball(view, own["other"], m)
    return verb == actions.LEAVE and _left(view, robot, m)


@njit(cache=True, nogil=True, error_model="numpy")
def _lasts(holds: bool, seconds: float, m: Measures, own: Record) -> bool:
    """True if a condition has held for so long."""
    own["lasted"] = own["lasted"] + 1 if holds else 0
    return bool((own["lasted"] - 0.5) * m.frame_s > seconds)


@njit(cache=True, nogil=True, error_model="numpy")
def _kicked(view: F64, robot: int, let_go: bool, m: Measures) -> bool:
    """True if the ball runs away from the robot, fast or, let go, straight ahead and faster than it."""
    dx, dy = offset(view, robot, BALL)
    rolls = speed_of(view, BALL)
    outward = view[BALL, VX] * dx + view[BALL, VY] * dy
    pushed = let_go and rolls > speed_of(view, robot) + m.moving and _heads_along(view, robot)
    return bool(outward > COS_FACING * rolls * math.hypot(dx, dy) and (pushed or rolls > m.fast))


@njit(cache=True, nogil=True, error_model="numpy")
def _left(view: F64, robot: int, m: Measures) -> bool:
    """True if the robot drives off the ball and is faster, and the ball is slow."""
    dx, dy = offset(view, robot, BALL)
    rolls = speed_of(view, BALL)
    sign = -1.0 if along(view, robot, view[robot, VX], view[robot, VY]) < 0.0 else 1.0
    off = sign * along(view, robot, dx, dy) < COS_FACING * math.hypot(dx, dy)
    return off and speed_of(view, robot) > rolls + m.moving and rolls < m.fast


@njit(cache=True, nogil=True, error_model="numpy")
def _heads_along(view: F64, robot: int) -> bool:
    """True if a robot heads where the ball rolls."""
    return along(view, robot, view[BALL, VX], view[BALL, VY]) > _COS_PARALLEL * speed_of(view, BALL)
