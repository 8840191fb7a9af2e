"""Acts of robots from a match's events, with how V and the score went on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.game.roles import roles
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.settings import ActSettings
from pitchlore.schemas import SIDES, Acts
from pitchlore.schemas.acts import PLACES

_DIRECTIONS = {
    "front": "passes forward", "left": "passes sideways", "right": "passes sideways", "back": "passes back"}


class ValueCourse(NamedTuple):
    """How V to home and the score go on from any time of a match.

    Attributes:
        t_ns, segment: times of moments and the segments of play they lie in, int64 [n], increasing.
        value: V to home then, float64 [n].
        goals: times of goals whose team is known, int64 [G], increasing.
        signs: 1 for home, -1 for away, float64 [G].
    """

    t_ns: I64
    segment: I64
    value: F64
    goals: I64
    signs: F64

    def at(self, t_ns: I64, segment: I64) -> F64:
        """V at times [k] in segments [k]: that of the nearest moment of the segment; NaN without one."""
        found = np.full(len(t_ns), np.nan)
        if not len(self.t_ns):
            return found
        low = np.searchsorted(self.segment, segment)
        high = np.searchsorted(self.segment, segment, "right") - 1
        later = np.clip(np.searchsorted(self.t_ns, t_ns), 0, len(self.t_ns) - 1)
        earlier = np.maximum(later - 1, 0)
        nearest = np.where(t_ns - self.t_ns[earlier] <= self.t_ns[later] - t_ns, earlier, later)
        known = high >= low
        found[known] = self.value[np.clip(nearest, low, np.maximum(high, low))[known]]
        return found

    def goal(self, t_ns: I64, within_ns: int) -> tuple[F64, I64]:
        """The first goal within ``within_ns`` after times [k]: 1 home, -1 away, 0 none; and its time."""
        if not len(self.goals):
            return np.zeros(len(t_ns)), np.zeros(len(t_ns), dtype=np.int64)
        place = np.searchsorted(self.goals, t_ns, "right")
        there = np.minimum(place, len(self.goals) - 1)
        near = (place < len(self.goals)) & (self.goals[there] - t_ns <= within_ns)
        return np.where(near, self.signs[there], 0.0), self.goals[there]

    def change(self, t_ns: I64, segment: I64, settings: ActSettings) -> tuple[F64, F64]:
        """V to home before and after times [k], as schema Acts has them of a robot of home."""
        before, after = round(settings.before_s * 1e9), round(settings.after_s * 1e9)
        goal, _ = self.goal(t_ns, after)
        return (self.at(t_ns - before, segment), np.where(goal != 0, goal, self.at(t_ns + after, segment)))


def acts(tables: Mapping[str, pl.DataFrame], pitch: Pitch, settings: ActSettings) -> pl.DataFrame:
    """The acts of a match: rows of schema Acts.

    Args:
        tables: rows of schemas Possession, Passes, Pressure, Shots, Goals, Values and Trajectories of one
            match, by the tables' names.
        pitch: its field of play.
        settings: settings of the stage.
    """
    found = _found(tables)
    if found.is_empty():
        return Acts.empty()
    course = _course(tables["values"], tables["goals"])
    side = np.where((found["team"] == "home").to_numpy(), 1.0, -1.0)
    t_ns, segment = (found[name].cast(pl.Int64).to_numpy() for name in ("t_ns", "segment"))
    before, after = course.change(t_ns, segment, settings)
    sign, goal_ns = course.goal(t_ns, round(settings.soon_s * 1e9))
    goal = side * sign
    placed = found.with_columns(
        place=_place(found["x"].to_numpy(), found["y"].to_numpy(), pitch),
        role=roles(tables["trajectories"], found["team"], found["robot"], found["t_ns"]),
        before=pl.Series(side * before).fill_nan(None), after=pl.Series(side * after).fill_nan(None),
        goal=pl.Series(np.select([goal > 0, goal < 0], ["for", "against"], default="")).replace("", None),
        goal_ns=pl.when(pl.Series(goal != 0)).then(pl.Series(goal_ns)),
    ).join(_usual(course, tables["trajectories"], pitch, settings), on=("team", "place"), how="left")
    return placed.select(*Acts.dtypes()).cast(pl.Schema(Acts.dtypes())).sort("t_ns", "team", "robot", "act")


def _found(tables: Mapping[str, pl.DataFrame]) -> pl.DataFrame:
    """Each act: match_id, team, robot, t_ns, segment, act, x and y as its team sees them."""
    held, common = tables["possession"], ("match_id", "team", "segment")
    lost = held.filter(pl.col("ended") == "lost")
    other = pl.when(pl.col("team") == SIDES[0]).then(pl.lit(SIDES[1])).otherwise(pl.lit(SIDES[0]))
    taken = lost.select(team=other.cast(held.schema["team"]), start_ns="end_ns")
    won = held.join(taken, on=("team", "start_ns"), how="semi")
    parts = (
        lost.select(*common, robot="last_robot", t_ns="end_ns", act=pl.lit("loses the ball"),
                    x="end_x", y="end_y"),
        won.select(*common, "robot", t_ns="start_ns", act=pl.lit("wins the ball"), x="x", y="y"),
        tables["passes"].select(
            *common, "robot", "t_ns", "x", "y",
            act=pl.col("direction").cast(pl.String).replace_strict(_DIRECTIONS)),
        tables["pressure"].select(*common, "robot", t_ns="start_ns", act=pl.lit("presses"), x="x", y="y"),
        tables["shots"].select(*common, "robot", "t_ns", act=pl.lit("shoots"), x="x", y="y"),
    )
    return pl.concat([part.select(*common, "robot", "t_ns", "act", "x", "y").with_columns(
        pl.col("team").cast(pl.String)) for part in parts])


def _course(values: pl.DataFrame, goals: pl.DataFrame) -> ValueCourse:
    """The course of a match, from rows of schemas Values and Goals."""
    ordered, known = values.sort("t_ns"), goals.drop_nulls("team").sort("t_ns")
    return ValueCourse(
        ordered["t_ns"].to_numpy(), ordered["segment"].cast(pl.Int64).to_numpy(),
        (ordered["home"] - ordered["away"]).to_numpy(), known["t_ns"].to_numpy(),
        np.where((known["team"] == SIDES[0]).to_numpy(), 1.0, -1.0))


def _usual(
    course: ValueCourse, trajectories: pl.DataFrame, pitch: Pitch, settings: ActSettings
) -> pl.DataFrame:
    """The mean change of V from all moments with the ball in a place: columns team, place, usual."""
    ball = trajectories.filter(pl.col("team") == "ball").select("t_ns", "x", "y")
    moments = pl.DataFrame({"t_ns": course.t_ns, "segment": course.segment}).join(ball, on="t_ns")
    before, after = course.change(moments["t_ns"].to_numpy(), moments["segment"].to_numpy(), settings)
    x, y = (moments[name].to_numpy() for name in ("x", "y"))
    return pl.concat([
        pl.DataFrame({"place": _place(turn * x, turn * y, pitch), "usual": turn * (after - before)})
        .group_by("place").agg(pl.col("usual").mean()).with_columns(team=pl.lit(side))
        for side, turn in zip(SIDES, (1.0, -1.0), strict=True)])


def _place(x: F64, y: F64, pitch: Pitch) -> pl.Series:
    """The name of each place, from coordinates in metres [n], as the team sees them that attacks +x."""
    third = np.select([x < -pitch.length / 6, x <= pitch.length / 6], [0, 1], default=2)
    return pl.Series(np.asarray(PLACES)[2 * third + (np.abs(y) > pitch.width / 4)])
