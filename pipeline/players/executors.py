"""Every situation of Table 1 as something that a robot can do: one controller a code.

An action is begun with :func:`start` and carried on with :func:`act`, frame by frame, until its final
condition holds or its time is up. The final conditions are those of the recogniser's rules
(:mod:`pipeline.recognition.rules`) at their 0.5 crossings, on the velocities of the moment:

============ =======================================================================================
001          it has the ball (touches it and heads at it within 30 degrees) for 0.15 s
011          it has the ball, both move, it heads where the ball rolls within 45 degrees, for 0.40 s: the
             rule's 0.25 s and those that 001 takes
021          after touching it, it no longer does, and the ball runs away from it: fast, or, let go,
             straight ahead and faster than the robot
022, 023     after having it, the robot no longer touches it and the opponent, teammate does; or the ball
             was let go and is beyond CLOSE: the rest is its own way
033          after having it, it no longer touches it, drives off it and is faster, and the ball is slow
034 098 128  the ball, own goal, adversary's goal is one level of distance further: past CLOSE or NEAR
150-152      the same of an opponent
173 174      the same of a teammate
044 045      it has the ball
046 088 118  one level nearer: past FAR, NEAR or CLOSE; beginning within CLOSE, contact
138-140      one level nearer to an opponent: past NEAR or CLOSE
162 163      the same of a teammate
047          it touches the ball without heading at it
057 078 108  it heads at the thing within 24 degrees
067 068      its x, y is level with the ball's within a contact, the ball being beyond CLOSE
184          it stands, for 0.50 s: the rule's 0.40 s and the window over which speeds are taken
194          none
============ =======================================================================================
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from pipeline.bodies import BALL, F64, THETA, VX, VY, X, Y
from pipeline.players.dice import Dice, uniform
from pipeline.players.measures import Measures
from pipeline.players.roles import I64
from pipeline.players.steering import (
    BACK,
    EITHER,
    FRONT,
    along_walls,
    drive_to,
    face,
    set_wheels,
    spin,
    steer,
    to_pose,
)

# Controllers, and what they are done to.
_HOLD, _GUIDE, _KICK, _GIVE, _LEAVE, _RECEDE, _REACH, _RECEIVE = range(8)
_APPROACH, _BLOCK, _FACE, _LEVEL_X, _LEVEL_Y, _STAND, _WANDER = range(8, 15)
_BALL, _OWN_GOAL, _ADVERSARY_GOAL, _OPPONENT, _TEAMMATE = range(5)


class _Action(NamedTuple):
    """What a code does.

    Attributes:
        verb: the controller.
        thing: what it is done to.
        role: of an opponent its role, of a teammate how many roles it is ahead; -1 any: a near
            one beyond the ball.
        limit_s: it lasts no longer.
    """

    verb: int
    thing: int = _BALL
    role: int = -1
    limit_s: float = 1.0


_ACTIONS: dict[int, _Action] = {
    1: _Action(_HOLD),
    11: _Action(_GUIDE),
    21: _Action(_KICK),
    22: _Action(_GIVE, _OPPONENT),
    23: _Action(_GIVE, _TEAMMATE),
    33: _Action(_LEAVE),
    34: _Action(_RECEDE),
    44: _Action(_REACH),
    45: _Action(_RECEIVE),
    46: _Action(_APPROACH),
    47: _Action(_BLOCK),
    57: _Action(_FACE),
    67: _Action(_LEVEL_X),
    68: _Action(_LEVEL_Y),
    78: _Action(_FACE, _OWN_GOAL),
    88: _Action(_APPROACH, _OWN_GOAL),
    98: _Action(_RECEDE, _OWN_GOAL),
    108: _Action(_FACE, _ADVERSARY_GOAL),
    118: _Action(_APPROACH, _ADVERSARY_GOAL),
    128: _Action(_RECEDE, _ADVERSARY_GOAL),
    **{138 + role: _Action(_APPROACH, _OPPONENT, role) for role in range(3)},
    **{150 + role: _Action(_RECEDE, _OPPONENT, role) for role in range(3)},
    **{161 + ahead: _Action(_APPROACH, _TEAMMATE, ahead) for ahead in (1, 2)},
    **{172 + ahead: _Action(_RECEDE, _TEAMMATE, ahead) for ahead in (1, 2)},
    184: _Action(_STAND),
    194: _Action(_WANDER, limit_s=0.4),
}

#: The codes that can be executed: all of Table 1.
CODES = tuple(_ACTIONS)

_LARGEST = max(CODES)
_VERB, _THING, _ROLE = np.full((3, _LARGEST + 1), -1, dtype=np.int64)
_LIMIT_S = np.zeros(_LARGEST + 1)
for _code, _action in _ACTIONS.items():
    _VERB[_code], _THING[_code], _ROLE[_code] = _action.verb, _action.thing, _action.role
    _LIMIT_S[_code] = _action.limit_s

#: Columns of an action's memory: its code; frames since it began; the row of the other robot it is done
#: to, -1 if none; the distance at which it is over, NaN if none is; frames for which a condition has
#: lasted; whether the robot has had the ball; the wheels of a random move, m/s.
CODE, FRAMES, OTHER, LEVEL, LASTED, HAD, LEFT, RIGHT = range(8)
FIELDS = 8

# How long the conditions of 001, 011 and 184 have to last, seconds.
_GAINED_S, _GUIDED_S, _STOOD_S = 0.15, 0.40, 0.50
# Half angles at which the recogniser's terms FACING, very FACING and PARALLEL cross 0.5, cosines.
_COS_FACING, _COS_VERY, _COS_PARALLEL = (math.cos(math.radians(angle)) for angle in (30, 24, 45))
# From further ahead of the ball than this (cosine), it is reached from behind instead of straight on.
_COS_AHEAD = -0.3
# A robot that goes round the ball keeps off it by so many contact distances.
_CLEAR = 1.3
# A pass is begun from within this of its line (cosine).
_COS_PASS = 0.5
# A gap to a ball that is held is closed at so many times its width a second.
_GRIP = 4.0
# Share of the top speed at which a ball is pushed before it is let go, and longest push, seconds.
_LET_GO, _PUSH_S = 0.8, 0.3
# Value of LASTED once a ball was let go.
_GONE = -1.0
# How far ahead the ball's way is looked at, seconds.
_AHEAD_S = 0.5
# A goalkeeper's middle keeps off the goal line by so many radii (5 cm on the VSSS pitch), as in ``static``.
_LINE = 5 / 3.75


@njit(cache=True, nogil=True, error_model="numpy")
def start(code: int, robot: int, view: F64, roles: I64, m: Measures, dice: Dice, memory: F64) -> None:
    """Begin an action.

    Args:
        code: one of :data:`CODES`.
        robot: row of the robot in the view, 1 to N.
        view: float64 [1 + 2 N, 6], the team's.
        roles: int64 [2 N], of the robots of rows 1 to 2 N (:func:`pipeline.players.roles.assign`); they
            decide whom codes 138 to 174 are done to. Of several the nearest is; if nobody has the role,
            the nearest of the nearest role.
        m: measures.
        dice: draw the wheels of 194; no other code rolls them.
        memory: float64 [FIELDS], the robot's, written.
    """
    memory[:] = 0.0
    memory[CODE] = code
    memory[LEVEL] = np.nan
    memory[OTHER] = _other(_THING[code], _ROLE[code], robot, view, roles)
    memory[HAD] = 1.0 if has_ball(view, robot, m) else 0.0
    verb = _VERB[code]
    if verb == _WANDER:
        memory[LEFT] = m.top * (2.0 * uniform(dice) - 1.0)
        memory[RIGHT] = m.top * (2.0 * uniform(dice) - 1.0)
    elif verb in (_APPROACH, _RECEDE):
        x, y = _place(view, _THING[code], int(memory[OTHER]), m)
        distance = math.hypot(x - view[robot, X], y - view[robot, Y])
        if verb == _RECEDE:
            memory[LEVEL] = m.close if distance < m.close else (m.near if distance < m.near else np.nan)
        elif distance > m.far and _THING[code] < _OPPONENT:
            memory[LEVEL] = m.far
        else:
            memory[LEVEL] = m.near if distance > m.near else (m.close if distance > m.close else m.contact)


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
    verb, thing, other = _VERB[code], _THING[code], int(memory[OTHER])
    if thing >= _OPPONENT and other < 0:
        set_wheels(0.0, 0.0, robot, m, wheels)
        return True
    x, y = _place(view, thing, other, m)
    if has_ball(view, robot, m) or (verb == _KICK and _distance(view, robot, BALL) < m.contact):
        memory[HAD] = 1.0
    if verb == _HOLD:
        _hold(robot, view, m, wheels)
    elif verb == _GUIDE:
        _guide(robot, view, m.goal_x, 0.0, m, wheels)
    elif verb == _KICK:
        _kick(robot, view, m, memory, wheels)
    elif verb == _GIVE:
        _give(robot, view, other, m, memory, wheels)
    elif verb in (_LEAVE, _RECEDE):
        dx, dy = along_walls(view, robot, view[robot, X] - x, view[robot, Y] - y, m)
        steer(view, robot, dx, dy, m.top, EITHER, m, wheels)
    elif verb == _REACH:
        _reach(robot, view, m.goal_x, 0.0, _COS_AHEAD, m, wheels)
    elif verb == _RECEIVE:
        _receive(robot, view, m, wheels)
    elif verb == _APPROACH:
        _approach(robot, view, thing, x, y, m, wheels)
    elif verb == _BLOCK:
        _block(robot, view, m, wheels)
    elif verb == _FACE:
        face(view, robot, x - view[robot, X], y - view[robot, Y], m, wheels)
    elif verb == _LEVEL_X:
        left = x - view[robot, X]
        steer(view, robot, left, 0.0, m.top, EITHER, m, wheels)
    elif verb == _LEVEL_Y:
        left = y - view[robot, Y]
        steer(view, robot, 0.0, left, m.top, EITHER, m, wheels)
    elif verb == _WANDER:
        wheels[robot - 1, 0], wheels[robot - 1, 1] = memory[LEFT], memory[RIGHT]
    else:
        set_wheels(0.0, 0.0, robot, m, wheels)
    over = _final(robot, view, verb, x, y, other, m, memory)
    memory[FRAMES] += 1.0
    return over or (memory[FRAMES] + 0.5) * m.frame_s >= _LIMIT_S[code]


@njit(cache=True, nogil=True, error_model="numpy")
def has_ball(view: F64, robot: int, m: Measures) -> bool:
    """Whether a robot touches the ball and heads at it within 30 degrees: the recogniser's has_ball."""
    dx, dy = view[BALL, X] - view[robot, X], view[BALL, Y] - view[robot, Y]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance >= m.contact:
        return False
    ahead = math.cos(view[robot, THETA]) * dx + math.sin(view[robot, THETA]) * dy
    return bool(ahead > _COS_FACING * distance)


@njit(cache=True, nogil=True, error_model="numpy")
def push(
    robot: int, view: F64, tx: float, ty: float, speed: float, round_it: float, m: Measures, wheels: F64
) -> None:
    """Push a ball that is in front so that it goes to a place.

    Args:
        robot: row of the robot.
        view: the team's.
        tx: of the place.
        ty: of the place.
        speed: m/s.
        round_it: how far behind the ball's middle it aims, in shares of the distance at which they touch;
            the more, the quicker the ball is turned, and the sooner lost.
        m: measures.
        wheels: written.
    """
    bx, by = view[BALL, X], view[BALL, Y]
    ux, uy = _unit(tx - bx, ty - by)
    rx, ry = bx - view[robot, X], by - view[robot, Y]
    back = round_it * m.touch if rx * ux + ry * uy > 0.0 else 0.0
    steer(view, robot, rx - back * ux, ry - back * uy, speed, FRONT, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _distance(view: F64, a: int, b: int) -> float:
    return math.hypot(view[a, X] - view[b, X], view[a, Y] - view[b, Y])


@njit(cache=True, nogil=True, error_model="numpy")
def _unit(dx: float, dy: float) -> tuple[float, float]:
    length = math.sqrt(dx * dx + dy * dy)
    return (dx / length, dy / length) if length > 0.0 else (1.0, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _other(thing: int, role: int, robot: int, view: F64, roles: I64) -> int:
    """Row of the robot that an action is done to, -1 if none."""
    if thing < _OPPONENT:
        return -1
    count = len(roles) // 2
    first = 1 if thing == _TEAMMATE else count + 1
    wanted = role
    if thing == _TEAMMATE and role >= 0:
        wanted = (roles[robot - 1] + role) % 3
    bx, by = _unit(view[BALL, X] - view[robot, X], view[BALL, Y] - view[robot, Y])
    best, best_rank, best_cost = -1, 3, np.inf
    for other in range(first, first + count):
        if other == robot:
            continue
        if role < 0:
            off, cost = 0, _distance(view, other, BALL)
            cost = 2.0 * cost - bx * (view[other, X] - view[BALL, X]) - by * (view[other, Y] - view[BALL, Y])
        else:
            off, cost = abs(roles[other - 1] - wanted), _distance(view, other, robot)
        if off < best_rank or (off == best_rank and cost < best_cost):
            best, best_rank, best_cost = other, off, cost
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _place(view: F64, thing: int, other: int, m: Measures) -> tuple[float, float]:
    """Where the thing is that an action is done to."""
    if thing == _OWN_GOAL:
        return -m.goal_x, 0.0
    if thing == _ADVERSARY_GOAL:
        return m.goal_x, 0.0
    row = max(other, BALL)
    return view[row, X], view[row, Y]


@njit(cache=True, nogil=True, error_model="numpy")
def _reach(
    robot: int, view: F64, tx: float, ty: float, cos_behind: float, m: Measures, wheels: F64
) -> None:
    """To where the ball will be: straight on, or round it if that would drive it away from a place.

    It goes round if the cosine of its bearing off the line to the place is less than ``cos_behind``.
    """
    x, y = view[robot, X], view[robot, Y]
    ahead_s = min(_distance(view, robot, BALL) / m.top, _AHEAD_S)
    bx, by = view[BALL, X] + ahead_s * view[BALL, VX], view[BALL, Y] + ahead_s * view[BALL, VY]
    bx = min(max(bx, -m.goal_x), m.goal_x)
    by = min(max(by, -m.half_width), m.half_width)
    dx, dy = bx - x, by - y
    ux, uy = _unit(tx - bx, ty - by)
    if dx * ux + dy * uy < cos_behind * math.sqrt(dx * dx + dy * dy):
        ox, oy = x - view[BALL, X], y - view[BALL, Y]
        gap = math.sqrt(ox * ox + oy * oy)
        dx, dy = to_pose(x, y, bx - m.touch * ux, by - m.touch * uy, ux, uy, m)
        end = FRONT
        if gap < _CLEAR * m.contact:
            # first off the ball, without turning at it, which would strike it
            dx, dy, end = dx + 2.0 * ox / m.contact, dy + 2.0 * oy / m.contact, EITHER
        dx, dy = along_walls(view, robot, dx, dy, m)
        steer(view, robot, dx, dy, m.top, end, m, wheels)
        return
    steer(view, robot, dx, dy, m.top, FRONT, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _hold(robot: int, view: F64, m: Measures, wheels: F64) -> None:
    """Stay at the ball and slow it down."""
    if not has_ball(view, robot, m):
        _reach(robot, view, m.goal_x, 0.0, _COS_AHEAD, m, wheels)
        return
    cos, sin = math.cos(view[robot, THETA]), math.sin(view[robot, THETA])
    gap = _distance(view, robot, BALL) - m.touch
    speed = 0.8 * (cos * view[BALL, VX] + sin * view[BALL, VY]) + _GRIP * gap
    face(view, robot, view[BALL, X] - view[robot, X], view[BALL, Y] - view[robot, Y], m, wheels)
    turning = 0.5 * (wheels[robot - 1, 1] - wheels[robot - 1, 0])
    set_wheels(speed, 2.0 * turning / m.axle, robot, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _guide(robot: int, view: F64, tx: float, ty: float, m: Measures, wheels: F64) -> None:
    """Push the ball to a place without letting it go."""
    if not has_ball(view, robot, m):
        _reach(robot, view, tx, ty, _COS_AHEAD, m, wheels)
        return
    cos, sin = math.cos(view[robot, THETA]), math.sin(view[robot, THETA])
    rolls = max(cos * view[BALL, VX] + sin * view[BALL, VY], 0.0)
    push(robot, view, tx, ty, min(rolls + 2.0 * m.moving, 0.7 * m.top), 0.25, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _strike(
    robot: int, view: F64, tx: float, ty: float, cos_behind: float, m: Measures, memory: F64, wheels: F64
) -> None:
    """Push the ball to a place as fast as can be, then stop and let it run.

    A robot that is not behind the ball, in that the cosine of its bearing off the line to the place is
    less than ``cos_behind``, goes round it first.
    """
    if memory[LASTED] == _GONE:
        set_wheels(0.0, 0.0, robot, m, wheels)
        return
    dx, dy = view[BALL, X] - view[robot, X], view[BALL, Y] - view[robot, Y]
    ux, uy = _unit(tx - view[BALL, X], ty - view[BALL, Y])
    behind = dx * ux + dy * uy > cos_behind * math.sqrt(dx * dx + dy * dy)
    if memory[HAD] == 0.0 or not behind:
        _reach(robot, view, tx, ty, cos_behind, m, wheels)
        return
    memory[LASTED] += 1.0
    speed = math.hypot(view[robot, VX], view[robot, VY])
    if speed > _LET_GO * m.top or memory[LASTED] * m.frame_s > _PUSH_S:
        memory[LASTED] = _GONE
    push(robot, view, tx, ty, m.top, 0.5, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _kick(robot: int, view: F64, m: Measures, memory: F64, wheels: F64) -> None:
    """Shoot at the adversary's goal; a ball beside the robot is struck by spinning."""
    dx, dy = view[BALL, X] - view[robot, X], view[BALL, Y] - view[robot, Y]
    distance = math.sqrt(dx * dx + dy * dy)
    ahead = abs(math.cos(view[robot, THETA]) * dx + math.sin(view[robot, THETA]) * dy)
    if distance < m.contact and ahead < _COS_FACING * distance:
        spin(view, robot, m.goal_x - view[BALL, X], -view[BALL, Y], m, wheels)
    else:
        _strike(robot, view, m.goal_x, 0.0, _COS_AHEAD, m, memory, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _give(robot: int, view: F64, other: int, m: Measures, memory: F64, wheels: F64) -> None:
    """Pass the ball to a teammate, or push it on to an opponent; back off once the other touches it."""
    if memory[HAD] > 0.0 and _distance(view, other, BALL) < m.contact:
        steer(
            view, robot, view[robot, X] - view[BALL, X], view[robot, Y] - view[BALL, Y], m.top, EITHER, m,
            wheels,
        )
    else:
        _strike(robot, view, view[other, X], view[other, Y], _COS_PASS, m, memory, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _receive(robot: int, view: F64, m: Measures, wheels: F64) -> None:
    """Face the ball and meet it on its way, slower than it comes."""
    dx, dy = view[BALL, X] - view[robot, X], view[BALL, Y] - view[robot, Y]
    vx, vy = view[BALL, VX], view[BALL, VY]
    speed = math.hypot(vx, vy)
    if speed > m.moving and dx * vx + dy * vy < 0.0:
        ux, uy = vx / speed, vy / speed
        aside = dx * uy - dy * ux  # the ball's way passes the robot at so much times (uy, -ux)
        if abs(aside) > 0.5 * m.radius:
            dx, dy = aside * uy - abs(aside) * ux, -aside * ux - abs(aside) * uy
            steer(view, robot, dx, dy, min(m.top, 0.7 * speed), FRONT, m, wheels)
            return
    face(view, robot, dx, dy, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _block(robot: int, view: F64, m: Measures, wheels: F64) -> None:
    """Stand with the side across the ball's way; a ball that does not come is met with the back."""
    dx, dy = view[BALL, X] - view[robot, X], view[BALL, Y] - view[robot, Y]
    vx, vy = view[BALL, VX], view[BALL, VY]
    speed = math.hypot(vx, vy)
    if speed > m.moving and dx * vx + dy * vy < 0.0:
        ux, uy = vx / speed, vy / speed
        aside = dx * uy - dy * ux
        if abs(aside) < 0.25 * m.radius:
            steer(view, robot, uy, -ux, 0.0, EITHER, m, wheels)
        else:
            steer(
                view, robot, aside * uy, -aside * ux, min(m.top, m.arrival * abs(aside)), EITHER, m, wheels
            )
    elif dx * dx + dy * dy < m.close * m.close:
        steer(view, robot, dx, dy, m.top, BACK, m, wheels)
    else:
        # its way to the own goal
        ux, uy = _unit(-m.goal_x - view[BALL, X], -view[BALL, Y])
        aside = dx * uy - dy * ux
        drive_to(
            view, robot, view[robot, X] + aside * uy, view[robot, Y] - aside * ux, m.top, EITHER, m, wheels
        )


@njit(cache=True, nogil=True, error_model="numpy")
def _return(robot: int, view: F64, m: Measures, wheels: F64) -> None:
    """Into the own goal's mouth, and there to where the ball will cross the line."""
    line = -m.goal_x + _LINE * m.radius
    bx, vx = view[BALL, X], view[BALL, VX]
    cross = view[BALL, Y]
    if vx < -m.moving and bx > line:
        cross += view[BALL, VY] * (line - bx) / vx
    reach = math.sqrt(m.close * m.close - (_LINE * m.radius) ** 2) * 0.95
    post = min(m.half_goal, reach)
    cross = min(max(cross, -post), post)
    x, y = view[robot, X], view[robot, Y]
    left = cross - y
    if abs(x - line) > m.radius:
        drive_to(view, robot, line, cross, m.top, EITHER, m, wheels)
    elif abs(left) > 0.2 * m.radius:
        lean = min(max(2.0 * (line - x), -abs(left)), abs(left))
        steer(view, robot, lean, left, min(m.top, m.arrival * abs(left)), EITHER, m, wheels)
    else:
        sign = 1.0 if math.sin(view[robot, THETA]) >= 0.0 else -1.0
        steer(view, robot, 0.0, sign, 0.0, FRONT, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _approach(
    robot: int, view: F64, thing: int, x: float, y: float, m: Measures, wheels: F64
) -> None:
    """Straight to a thing; to a ball that is close already, to the place behind it."""
    dx, dy = x - view[robot, X], y - view[robot, Y]
    if thing == _BALL and dx * dx + dy * dy < m.close * m.close:
        _reach(robot, view, m.goal_x, 0.0, _COS_AHEAD, m, wheels)
    elif thing == _OWN_GOAL:
        _return(robot, view, m, wheels)
    elif thing == _BALL or thing >= _OPPONENT:
        steer(view, robot, dx, dy, m.top, FRONT if thing == _BALL else EITHER, m, wheels)
    else:
        drive_to(view, robot, x, y, m.top, EITHER, m, wheels)


@njit(cache=True, nogil=True, error_model="numpy")
def _final(
    robot: int, view: F64, verb: int, x: float, y: float, other: int, m: Measures, memory: F64
) -> bool:
    """Whether an action's final condition holds; the table of the module says which."""
    dx, dy = x - view[robot, X], y - view[robot, Y]
    distance = math.hypot(dx, dy)
    cos, sin = math.cos(view[robot, THETA]), math.sin(view[robot, THETA])
    if verb == _APPROACH:
        return bool(distance < memory[LEVEL])
    if verb == _RECEDE:
        return bool(distance > memory[LEVEL])
    if verb == _FACE:
        return bool(cos * dx + sin * dy > _COS_VERY * distance)
    if verb == _LEVEL_X:
        return bool(abs(dx) < m.contact and distance > m.close)
    if verb == _LEVEL_Y:
        return bool(abs(dy) < m.contact and distance > m.close)
    speed = math.hypot(view[robot, VX], view[robot, VY])
    if verb == _STAND:
        memory[LASTED] = memory[LASTED] + 1.0 if speed < m.moving else 0.0
        return bool((memory[LASTED] - 0.5) * m.frame_s > _STOOD_S)
    dx, dy = view[BALL, X] - view[robot, X], view[BALL, Y] - view[robot, Y]
    distance = math.hypot(dx, dy)
    has = has_ball(view, robot, m)
    if verb in (_REACH, _RECEIVE):
        return has
    touching = distance < m.contact
    if verb == _BLOCK:
        return touching and not has
    vx, vy = view[BALL, VX], view[BALL, VY]
    rolls = math.hypot(vx, vy)
    parallel = cos * vx + sin * vy > _COS_PARALLEL * rolls
    if verb in (_HOLD, _GUIDE):
        lasts = has and (verb == _HOLD or (speed > m.moving and rolls > m.moving and parallel))
        memory[LASTED] = memory[LASTED] + 1.0 if lasts else 0.0
        return bool((memory[LASTED] - 0.5) * m.frame_s > (_GAINED_S if verb == _HOLD else _GUIDED_S))
    if memory[HAD] == 0.0:
        return False
    if verb == _KICK:
        goes_off = vx * dx + vy * dy > _COS_FACING * rolls * distance
        pushed = memory[LASTED] == _GONE and rolls > speed + m.moving and parallel
        return bool(goes_off and not touching and (pushed or rolls > m.fast))
    if touching:
        return False
    if verb == _GIVE:
        let_go = memory[LASTED] == _GONE and distance > m.close
        return bool(let_go or _distance(view, other, BALL) < m.contact)
    if verb == _LEAVE:
        sign = -1.0 if cos * view[robot, VX] + sin * view[robot, VY] < 0.0 else 1.0
        off = sign * (cos * dx + sin * dy) < _COS_FACING * distance
        return bool(off and speed > rolls + m.moving and rolls < m.fast)
    return False
