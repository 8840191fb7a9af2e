"""A team's view of a match as one vector of numbers of about -1 to 1, for learners.

The view is turned so that the own goal is at -x (:func:`pipeline.game.bodies.see`). A vector has 14 N + 7
numbers, N being the robots of a team:

================  =====================================================================================
ball, 4           x, y, velocity along x and y
each robot, 7     x, y, cosine and sine of its heading, velocity along x and y, turn rate; first the robot
                  that the vector is for, then its teammates, then the adversary's robots, each by number
match, 3          lead in tens of goals; time that is left as a share of the match; 1 while play is on, else 0
================  =====================================================================================

x is a share of the distance from the centre to the back of a goal, y of that to a side line. Velocities are
shares of the top speed of a wheel; the ball's, of twice that; turn rates, of the fastest turn on the spot.
So only a ball that is struck hard, a robot that is pushed, and a lead of more than ten goals are beyond 1.
"""

from __future__ import annotations

import math

import numpy as np

from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.numbers.arrays import F32, F64
from pitchlore.pipeline.numbers.kernels import njit

#: One team or both, 0 home, 1 away.
TeamIndices = tuple[int, ...]

#: Numbers are cut at this and at its negative.
LIMIT = 2.0

#: Numbers of the ball, of a robot, and of the match.
_BALL, _ROBOT, _MATCH = 4, 7, 3
#: Goals that are a lead of 1.
_GOALS = 10.0

# Entries of the scales.
_OF_X, _OF_Y, _OF_BALL, _OF_ROBOT, _OF_TURN = range(5)


def length(robots: int) -> int:
    """Numbers of a vector, for so many robots a team."""
    return _BALL + 2 * robots * _ROBOT + _MATCH


def scales(settings: MatchSettings) -> F64:
    """The scales that numbers are divided by, float64 [5], for :func:`observe`."""
    pitch, top = settings.pitch, settings.physics.wheel_speed
    return np.array(
        [pitch.goal_x + pitch.goal_depth, pitch.width / 2, 2 * top, top, 2 * top / settings.physics.axle])


@njit(cache=True, nogil=True, error_model="numpy")
def observe(
    views: F64, teams: TeamIndices, home_leads: int, left: float, on: bool, of: F64, out: F32
) -> None:
    """Write the vectors of the first robots of some teams.

    Args:
        views: float64 [2, 1 + 2 N, 6], of home and of away.
        teams: the teams, 0 home, 1 away.
        home_leads: home's goals less away's.
        left: share of the match that is left, in [0, 1].
        on: whether play is on.
        of: from :func:`scales`.
        out: float32 [len(teams) K, 14 N + 7], K at most N; written: rows of robots 1 to K of the first
            team, then of the next.
    """
    each = out.shape[0] // len(teams)
    for index, team in enumerate(teams):
        lead = _cut((home_leads if team == 0 else -home_leads) / _GOALS)
        first = out[index * each]
        at = _of_bodies(views[team], of, first)
        first[at], first[at + 1], first[at + 2] = lead, left, 1.0 if on else 0.0
        for robot in range(1, each):
            row = out[index * each + robot]
            own = _BALL + robot * _ROBOT
            for place in range(len(row)):
                row[place] = first[place]
            for place in range(_ROBOT):
                row[_BALL + place] = first[own + place]
            for place in range(_BALL, own):
                row[place + _ROBOT] = first[place]


@njit(cache=True, nogil=True, error_model="numpy")
def _of_bodies(view: F64, of: F64, row: F32) -> int:
    """Write ball and robots, in the order of the view's rows; the place after them."""
    row[0] = _cut(view[BALL, X] / of[_OF_X])
    row[1] = _cut(view[BALL, Y] / of[_OF_Y])
    row[2] = _cut(view[BALL, VX] / of[_OF_BALL])
    row[3] = _cut(view[BALL, VY] / of[_OF_BALL])
    at = _BALL
    for body in range(1, view.shape[0]):
        row[at] = _cut(view[body, X] / of[_OF_X])
        row[at + 1] = _cut(view[body, Y] / of[_OF_Y])
        row[at + 2] = math.cos(view[body, THETA])
        row[at + 3] = math.sin(view[body, THETA])
        row[at + 4] = _cut(view[body, VX] / of[_OF_ROBOT])
        row[at + 5] = _cut(view[body, VY] / of[_OF_ROBOT])
        row[at + 6] = _cut(view[body, OMEGA] / of[_OF_TURN])
        at += _ROBOT
    return at


@njit(cache=True, nogil=True, error_model="numpy")
def _cut(number: float) -> float:
    return min(max(number, -LIMIT), LIMIT)
