"""Observations of a team's robots, each as a vector of numbers of about -1 to 1, for learners.

Teams that look decide by the same: the numbers of ``schemas.sights.SIGHT``, in that order, and the robot's
role. A vector has 33 numbers, whatever the number of robots:

=============  ========================================================================================
lengths        as shares of the distance from the centre to the back of a goal
speeds         as shares of the top speed of a wheel; the ball's, of twice that
team-mates     numbers of them, as shares of all team-mates
seconds        as shares of nine
cosines, and   as they are
along_line
role, 3        1 in the place of the robot's role (``schemas.ROLES``), else 0
=============  ========================================================================================

Numbers are cut at -2 and 2. A number that is not known, as of a team-mate where there is none, is 0.
"""

from __future__ import annotations

import math

import numpy as np

from pitchlore.pipeline.arena.match.observation import LIMIT, TeamIndices
from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.game.bodies import Records
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.numbers.arrays import F32, F64
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.state.observation import LONG_S, see_from
from pitchlore.schemas import ROLES
from pitchlore.schemas.sights import SIGHT

#: Numbers of a vector.
NUMBERS = len(SIGHT) + len(ROLES)

_BALL_SPEEDS = ("ball_vx", "ball_vy")
_SPEEDS = ("vx", "vy")
_MATES = ("nearer", "deeper")
_SECONDS = ("to_own_line", "to_their_line")
_BARE = ("behind", "faces_ball", "faces_shot", "adversary_behind", "mate_behind", "along_line")


def scales(settings: MatchSettings) -> F64:
    """The scales that the numbers of an observation are divided by, float64 [30]."""
    pitch, top = settings.pitch, settings.physics.wheel_speed
    of = {
        **dict.fromkeys(SIGHT, pitch.goal_x + pitch.goal_depth), **dict.fromkeys(_BALL_SPEEDS, 2 * top),
        **dict.fromkeys(_SPEEDS, top), **dict.fromkeys(_MATES, max(1, settings.robots - 1)),
        **dict.fromkeys(_SECONDS, LONG_S), **dict.fromkeys(_BARE, 1.0),
    }
    return np.array([of[name] for name in SIGHT])


@njit(cache=True, nogil=True, error_model="numpy")
def scale(observation: F32, of: F64) -> None:
    """Divide the numbers of an observation, float32 [30 or more], in place; unknown ones become 0."""
    for place in range(len(of)):
        number = observation[place] / of[place]
        observation[place] = 0.0 if math.isnan(number) else min(max(number, -LIMIT), LIMIT)


@njit(cache=True, nogil=True, error_model="numpy")
def observe(views: F64, teams: TeamIndices, packed: Records, of: F64, out: F32) -> None:
    """Write the vectors of all robots of some teams.

    Args:
        views: float64 [2, 1 + 2 N, 6], of home and of away.
        teams: the teams, 0 home, 1 away.
        packed: measures, ``Measures.packed()``.
        of: from :func:`scales`.
        out: float32 [len(teams) N, 33], written: rows of robots 1 to N of the first team, then of the next.
    """
    m = packed[0]
    count = views.shape[1] // 2
    roles = np.empty(2 * count, dtype=np.int64)
    for index, team in enumerate(teams):
        assign(views[team], m, roles)
        for robot in range(1, count + 1):
            row = out[index * count + robot - 1]
            see_from(views[team], robot, m.goal_x, row)
            scale(row, of)
            row[len(of):] = 0.0
            row[len(of) + roles[robot - 1]] = 1.0
