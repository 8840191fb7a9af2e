"""Passes that were tried, whatever came of them."""

from __future__ import annotations

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.stages.events.control import NOBODY, Control
from pitchlore.pipeline.stages.events.passes import LEAST, ON
from pitchlore.pipeline.stages.events.views import place, shoots, tabled
from pitchlore.schemas import SIDES, PassAttempts
from pitchlore.schemas.analysis import CAME


def pass_attempts(
    control: Control, shots: pl.DataFrame, over: pl.DataFrame, trajectories: pl.DataFrame, pitch: Pitch
) -> pl.DataFrame:
    """Rows of schema PassAttempts of one match.

    Args:
        control: control of the match.
        shots: rows of schema Shots of the match.
        over: how its segments ended (:func:`pipeline.game.episodes.episodes`).
        trajectories: rows of schema Trajectories of the match.
        pitch: pitch of the match.
    """
    ball, contact = control.ball, control.contacts
    touched = np.flatnonzero(control.toucher != NOBODY)
    if not len(touched):
        return PassAttempts.empty()
    # each touch, and the next one or else the last row of its segment
    after = np.append(touched[1:], len(ball.t_ns))
    stays = after <= np.searchsorted(ball.segment, ball.segment[touched], side="right") - 1
    until = np.where(stays, after, np.searchsorted(ball.segment, ball.segment[touched], side="right") - 1)
    team, robot = contact.team[control.toucher[touched]], contact.robot[control.toucher[touched]]
    then = control.toucher[until]
    stopped = over.filter(pl.col("outcome").is_not_null(), pl.col("outcome") != "goal")["episode"].to_numpy()
    alone = stays & (control.team[until] != NOBODY)
    mine = alone & (contact.team[then] == team)
    came = np.array(CAME)[np.select([mine, alone, stays], [0, 1, 2], 3)]
    x, y = place(ball, touched, team)
    to_x, to_y = place(ball, until, team)
    length = np.hypot(to_x - x, to_y - y)
    kept = (
        (until - touched > 1) & (control.team[touched] != NOBODY) & ~shoots(ball.t_ns[touched], shots)
        & (length >= LEAST * pitch.length / ON)
        & np.where(stays, ~mine | (contact.robot[then] != robot), np.isin(ball.segment[touched], stopped)))
    return tabled(PassAttempts, trajectories, {
        "team": np.array(SIDES)[team],
        "t_ns": ball.t_ns[touched],
        "until_ns": ball.t_ns[until],
        "segment": ball.segment[touched],
        "robot": robot,
        "next_robot": pl.Series(contact.robot[then]).set(pl.Series(~alone), None),
        "x": x, "y": y, "to_x": to_x, "to_y": to_y, "length": length,
        "came": came,
    }, kept)
