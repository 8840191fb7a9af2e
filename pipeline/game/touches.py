"""Touches of the ball: which robots are at it, sample by sample and without flicker."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.numbers.arrays import F32, I64
from pitchlore.schemas import BODIES

#: A touch goes on over so many ball samples without contact: vision flickers around the threshold.
FLICKER = 2


class Touches(NamedTuple):
    """Samples at which a robot touches the ball, each [n]; by time, at equal times the nearest robot last.

    Attributes:
        t_ns: time.
        ball: row of the ball at that time, in :class:`BallInPlay`.
        team: index into SIDES.
        robot: its number.
    """

    t_ns: I64
    ball: I64
    team: I64
    robot: I64


class BallInPlay(NamedTuple):
    """The ball in play, by time, each [m]; velocities are NaN where unknown."""

    t_ns: I64
    segment: I64
    x: F32
    y: F32
    vx: F32
    vy: F32

    def before(self, t_ns: int) -> BallInPlay:
        """The ball's samples before a time."""
        seen = slice(int(np.searchsorted(self.t_ns, t_ns)))
        return BallInPlay._make(column[seen] for column in self)

    def course(self, here: int, until: int | None, line_s: float) -> tuple[float, float, float, float, float]:
        """The ball's straight line after a touch: a place on it (x, y), and a velocity along it (vx, vy, s).

        The line is the chord from the touch to the ball's last sample of the segment within ``line_s`` of it
        and not after the next touch. Where there is no such sample, it is the velocity at the touch.

        Args:
            here: row of the touch.
            until: row of the next touch, None if there is none.
            line_s: seconds.

        Returns:
            x and y of the touch, metres; the chord, metres; and its time, seconds. NaN where not known.
        """
        ends = self.t_ns[here] + round(line_s * 1e9)
        to = int(min(
            np.searchsorted(self.t_ns, ends, side="right"),
            np.searchsorted(self.segment, self.segment[here], side="right"),
        )) - 1
        if until is not None:
            to = min(to, until)
        x, y = float(self.x[here]), float(self.y[here])
        if to > here:
            took = float(self.t_ns[to] - self.t_ns[here]) / 1e9
            return x, y, float(self.x[to]) - x, float(self.y[to]) - y, took
        return x, y, float(self.vx[here]), float(self.vy[here]), 1.0


def touches(
    in_play: pl.DataFrame, contact: float, goal_x: float, reach: float = math.inf
) -> tuple[BallInPlay, Touches]:
    """The ball in play, and all touches of it between the goal lines.

    Args:
        in_play: rows of schema Trajectories of one match: samples in play that are not suspect. It may have a
            column z, the ball's height, metres, null where not known.
        reach: height above which nobody touches the ball, metres.
        contact: distance of the centres below which a robot touches the ball, metres.
        goal_x: distance of the goal lines from the centre, metres.
    """
    ball = in_play.filter(pl.col("team") == "ball").sort("t_ns").with_row_index("ball")
    low = ball.filter(pl.col("z").fill_null(0.0) <= reach) if "z" in ball.columns else ball
    near = (
        in_play.filter(pl.col("team") != "ball")
        .join(low.select("t_ns", "ball", bx="x", by="y").filter(pl.col("bx").abs() <= goal_x), on="t_ns")
        .with_columns(
            distance=((pl.col("x") - pl.col("bx")) ** 2 + (pl.col("y") - pl.col("by")) ** 2).sqrt(),
            side=pl.col("team").to_physical().cast(pl.Int64) - BODIES.index("home"),
        )
        .filter(pl.col("distance") < contact)
        .sort("t_ns", "distance", "side", "robot", descending=[False, True, True, True])
    )
    columns = ("t_ns", "ball", "side", "robot")
    found = Touches(*(near[name].cast(pl.Int64).to_numpy() for name in columns))
    t_ns, segment = (ball[name].cast(pl.Int64).to_numpy() for name in ("t_ns", "segment"))
    x, y, vx, vy = (ball[name].fill_null(float("nan")).to_numpy() for name in ("x", "y", "vx", "vy"))
    return BallInPlay(t_ns, segment, x, y, vx, vy), found


class Contacts(NamedTuple):
    """Touches without flicker, each [k], by their first row, then by their last.

    Attributes:
        team: index into SIDES.
        robot: its number.
        first: row of the ball at the first sample.
        last: row of the ball at the last sample, in the same segment.
    """

    team: I64
    robot: I64
    first: I64
    last: I64


def contacts(ball: BallInPlay, found: Touches) -> Contacts:
    """The uninterrupted touches of robots; one ends with its stretch of play."""
    order = np.lexsort((found.ball, found.robot, found.team))
    team, robot, row = (column[order] for column in (found.team, found.robot, found.ball))
    segment = ball.segment[row]
    new = np.ones(len(row), dtype=np.bool_)
    new[1:] = (
        (np.diff(team) != 0) | (np.diff(robot) != 0) | (np.diff(row) > FLICKER + 1) | (np.diff(segment) != 0))
    begins = np.flatnonzero(new)
    first, last = row[begins], row[np.append(begins[1:], len(row)) - 1] if len(begins) else row
    by_time = np.lexsort((last, first))
    return Contacts(*(column[by_time] for column in (team[begins], robot[begins], first, last)))
