"""Places of the bodies when play restarts.

Everything is laid out in the view of the team that takes the restart: its own goal at -x, its adversary's
at +x. Nobody takes a free ball, so it is laid out in home's view. The first robot of each team is the
goalkeeper, and the last one goes to the ball, or as near as it may. A lone robot does what matters more.
"""

from __future__ import annotations

import math

import numpy as np

from pitchlore.pipeline.arena.physics.laws import FREE_BALL, GOAL_KICK, HALF, KICK_OFF, PENALTY, Marks
from pitchlore.pipeline.arena.physics.referee import NOBODY, WORDS, Laws, attack_direction
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import BALL, THETA, Record, X, Y, see
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.schemas import HOME

#: Where the robots between these two would like to be, in order: shares of the half's length and of half
#: the width, towards the own goal and to the left. The first is VSSReferee's support; the rest is ours.
FORMATION = np.array([
    (0.53, 0.0), (0.40, 0.50), (0.40, -0.50), (0.80, 0.75), (0.80, -0.75),
    (0.20, 0.80), (0.20, -0.80), (0.55, 0.35), (0.55, -0.35),
])  # fmt: skip
#: Their places are on a grid that divides the half's length into so many steps (2.5 cm on a VSSS pitch).
_STEPS = 30


def restart(bodies: F64, call: int, state: Record, laws: Laws, rng: np.random.Generator) -> None:
    """Put all bodies where a restart wants them, at rest.

    - Kick-off: the ball in the centre, the taker 1.5 robot lengths behind it, all others in their own
      half and outside the centre circle.
    - Free ball: the ball on the mark of its quarter, a robot of each team 0.20 m (on a VSSS pitch) from
      it on the side of its own goal, all others in their own half and further from the ball.
    - Penalty: the ball on the mark before the goal, the taker 1.5 robot lengths behind it, the
      adversary's goalkeeper before its line (touching it, if the settings say ``keeper_on_line``), all
      others in the half that the ball is not in.
    - Goal kick: the ball on a corner of the goal area, left or right by chance (VSSReferee: on the
      goalkeeper's side), the goalkeeper behind it, all others in their own half, the kicker's outside the
      area.

    Other goalkeepers are a robot's length before their goal line; goalkeepers stand along that line,
    all others face the ball. Field players that are not at the ball keep outside the goal areas and
    wholly as far from the ball as the centre circle's radius. Each takes the free place that is nearest
    to where :data:`FORMATION` has it, the last of a team the one nearest to the ball; a metre across
    counts as two along the pitch, so that they keep their lanes.

    No two bodies touch, whatever way they turn, and all are wholly on the pitch. Of such places each
    robot is then put off by the settings' ``scatter``; they are chosen so that all this, but for where
    exactly the robots at the ball stand, holds after that, too.

    Args:
        bodies: float64 [1 + 2 N, 6] in the pitch frame; overwritten.
        call: KICK_OFF, FREE_BALL, PENALTY, GOAL_KICK or HALF, from ``watch``.
        state: the referee's, after that call.
        laws: laws of the match.
        rng: draws one number, and three more a robot.

    Raises:
        BadSettings: if so many robots cannot be put so.
    """
    kind = KICK_OFF if call == HALF else call
    team = HOME if state["team"] == NOBODY else int(state["team"])
    attacks = attack_direction(int(state["halves_over"])) * (1 if team == HOME else -1)
    # half a turn exchanges opposite quarters
    quarter = int(state["quarter"]) if attacks > 0 else 3 - int(state["quarter"])
    view = np.zeros_like(bodies)
    scatter, on_line = laws.settings.scatter, laws.settings.keeper_on_line
    if not _arrange(kind, quarter, laws.marks, scatter, on_line, rng, view):
        raise BadSettings(
            f"{len(bodies) // 2} robots a team find no room at a {WORDS[kind]}",
            where="referee", next_step="Play with fewer robots, or on a larger pitch",
        )
    see(view, team, attacks, bodies)  # a team's view of its view is the pitch
    bodies[BALL, THETA] = 0.0  # the ball heads nowhere
    bodies += 0.0  # half a turn makes -0.0 of 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _arrange(
    kind: int, quarter: int, marks: Marks, scatter: float, on_line: bool, rng: np.random.Generator, out: F64
) -> bool:
    """Write the places into the zeros of ``out``, in the taker's view; false if there is no room.

    The quarter of a free ball is in this view, too. ``scatter`` is in robot lengths and radians.
    """
    robots = (out.shape[0] - 1) // 2
    placed = np.zeros(out.shape[0], dtype=np.bool_)
    length = 2 * marks.robot
    slack = scatter * length
    upper = rng.random() < 0.5

    if kind == FREE_BALL:
        out[BALL, X] = marks.mark_x if quarter % 2 else -marks.mark_x
        out[BALL, Y] = marks.mark_y if quarter // 2 else -marks.mark_y
    elif kind == PENALTY:
        out[BALL, X] = marks.mark_x
    elif kind == GOAL_KICK:
        out[BALL, X] = -marks.area_x
        out[BALL, Y] = marks.area_y if upper else -marks.area_y

    # the robots at the ball; rows `robots` and `2 * robots` are the last ones of the teams
    ball_x, ball_y, behind = out[BALL, X], out[BALL, Y], 1.5 * length
    if kind == FREE_BALL:
        _put(out, placed, robots, ball_x - marks.circle, ball_y, 0.0)
        _put(out, placed, 2 * robots, ball_x + marks.circle, ball_y, math.pi)
    elif kind == GOAL_KICK:
        aside = behind / math.sqrt(2.0)
        if upper:
            _put(out, placed, 1, ball_x - aside, ball_y - aside, math.pi / 4)
        else:
            _put(out, placed, 1, ball_x - aside, ball_y + aside, -math.pi / 4)
    else:
        _put(out, placed, robots, ball_x - behind, ball_y, 0.0)

    if not placed[1]:
        _put(out, placed, 1, length - marks.goal_x, 0.0, math.pi / 2)
    if not placed[1 + robots]:
        # on its line means that no corner of it is behind the line, whatever way it is put off
        depth = math.sqrt(2.0) * marks.robot + slack if kind == PENALTY else length
        _put(out, placed, 1 + robots, marks.goal_x - depth, 0.0, -math.pi / 2)

    for row in range(1, out.shape[0]):
        if placed[row]:
            continue
        theirs = row > robots
        side_x = 1.0 if theirs and kind != PENALTY else -1.0
        if row % robots == 0:
            wish_x, wish_y = side_x * ball_x, ball_y
        else:
            wish = FORMATION[(row - 2 - (robots if theirs else 0)) % FORMATION.shape[0]]
            wish_x, wish_y = wish[0] * marks.goal_x, wish[1] * (-marks.side_y if theirs else marks.side_y)
        if not _seek(out, placed, row, side_x, wish_x, wish_y, slack, marks):
            return False

    for row in range(1, out.shape[0]):
        out[row, X] += slack * (2 * rng.random() - 1)
        out[row, Y] += slack * (2 * rng.random() - 1)
        out[row, THETA] += scatter * (2 * rng.random() - 1)
    if on_line and kind == PENALTY:
        theta = out[1 + robots, THETA]
        out[1 + robots, X] = marks.goal_x - marks.robot * (abs(math.cos(theta)) + abs(math.sin(theta)))
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _put(out: F64, placed: np.ndarray, row: int, x: float, y: float, theta: float) -> None:
    out[row, X], out[row, Y], out[row, THETA] = x, y, theta
    placed[row] = True


@njit(cache=True, nogil=True, error_model="numpy")
def _seek(
    out: F64, placed: np.ndarray, row: int, side_x: float, wish_x: float, wish_y: float,
    slack: float, marks: Marks,
) -> bool:
    """Put a field player on the free place of the grid that is nearest to its wish; false if none is free.

    It may be in the half at ``side_x``, -1 or 1. It would like to be ``wish_x`` deep in that half and
    ``wish_y`` to the left. A robot may be put off by ``slack`` along each axis.
    """
    # robots are taken for the circles around their corners; `slack` may add up along both axes
    around = math.sqrt(2.0) * marks.robot
    apart = around + math.sqrt(2.0) * slack
    edge = around + slack
    step = marks.goal_x / _STEPS
    best, best_x, best_y = math.inf, 0.0, 0.0
    lanes = int((marks.side_y - edge) / step)
    for column in range(math.ceil(edge / step), int((marks.goal_x - edge) / step) + 1):
        depth = column * step
        for lane in range(-lanes, lanes + 1):
            x, y = side_x * depth, lane * step
            off = abs(depth - wish_x) + 2 * abs(y - wish_y)  # it rather keeps its lane
            if off >= best:
                continue
            if depth > marks.area_x - edge and abs(y) < marks.area_y + edge:
                continue
            if marks.goal_x - depth + marks.side_y - abs(y) < marks.corner + math.sqrt(2.0) * apart:
                continue
            if math.hypot(x - out[BALL, X], y - out[BALL, Y]) < marks.circle + apart:
                continue
            free = True
            for other in range(1, out.shape[0]):
                if placed[other] and math.hypot(x - out[other, X], y - out[other, Y]) < 2 * apart:
                    free = False
                    break
            if free:
                best, best_x, best_y = off, x, y
    if best == math.inf:
        return False
    _put(out, placed, row, best_x, best_y, math.atan2(out[BALL, Y] - best_y, out[BALL, X] - best_x))
    return True
