"""Control of the ball, sample by sample: who touches it, which team has it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.game.touches import BallInPlay, Contacts, contacts, touches
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.schemas import SIDES

#: No contact, no team.
NOBODY = -1


class Control(NamedTuple):
    """The ball in play, and who controls it.

    Attributes:
        ball: the ball, [m].
        contacts: touches without flicker, [k].
        toucher: int64 [m], the contact of the robot that touches, ``NOBODY`` without one. Of two robots of a
            team, the one that came later.
        team: int64 [m], index into SIDES of the team that has the ball, else ``NOBODY``: a team has it from
            its touch until the other team touches, both touch, or play stops.
        stretch: int64 [m], number of the stretch of samples of one segment with the same ``team``, ascending.
    """

    ball: BallInPlay
    contacts: Contacts
    toucher: I64
    team: I64
    stretch: I64

    def gaps(self) -> tuple[I64, I64]:
        """The rows of each touch and the next one of another sample, where the team has the ball alone.

        Each int64 [g]; both rows lie in one stretch.
        """
        rows = np.flatnonzero((self.toucher != NOBODY) & (self.team != NOBODY))
        here, there = rows[:-1], rows[1:]
        same = self.stretch[here] == self.stretch[there]
        return here[same], there[same]


def ball_control(trajectories: pl.DataFrame, pitch: Pitch) -> Control:
    """Control of the ball in one match.

    Args:
        trajectories: rows of schema Trajectories of one match.
        pitch: pitch of the match.
    """
    in_play = trajectories.filter(pl.col("segment").is_not_null(), ~pl.col("suspect"))
    scales = SCALES[pitch.kind]
    ball, touched = touches(in_play, scales.contact, pitch.goal_x, scales.reach)
    found = contacts(ball, touched)
    rows = len(ball.t_ns)
    toucher = np.full(rows, NOBODY)
    at_ball = np.zeros((len(SIDES), rows + 1), dtype=np.int64)
    for index, (team, first, last) in enumerate(zip(found.team, found.first, found.last, strict=True)):
        toucher[first:last + 1] = index
        at_ball[team, first] += 1
        at_ball[team, last + 1] -= 1
    home, away = np.cumsum(at_ball[:, :rows], axis=1) > 0
    team = np.where(home & away, NOBODY, np.where(home, 0, 1))
    # between touches, the last one counts, if it was in the same segment
    last = np.maximum.accumulate(np.where(home | away, np.arange(rows), NOBODY))
    known = last != NOBODY
    known[known] = ball.segment[last[known]] == ball.segment[known]
    team = np.where(known, team[last], NOBODY)
    new = np.zeros(rows, dtype=np.int64)
    new[1:] = (np.diff(team) != 0) | (np.diff(ball.segment) != 0)
    return Control(ball, found, toucher, team, np.cumsum(new))
