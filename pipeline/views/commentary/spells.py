"""Teams' times on the ball."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby
from typing import Any, NamedTuple

import polars as pl

from pitchlore.pipeline.game.roles import roles
from pitchlore.pipeline.views.commentary.words import robot


class Spell(NamedTuple):
    """A team's time on the ball: its possessions in a row, with nothing but duels between them.

    Attributes:
        team: its team.
        start_ns, end_ns: start of the first possession, and end of the last; the end is exclusive.
        until_ns: when the other team has the ball, or play stops; from its end on there is a duel.
        held_s: duration of the possessions, without the duels, s.
        robots: numbers of its robots, in the order in which they had the ball.
        first: name of the first one.
        touches: number of touches.
        x, far: the ball's place at the start, and the farthest one at which it was won, passed, received or
            lost, along the pitch, the team attacks +x, metres.
        lost_by: team, number and name of the robot that had the ball before, None at the segment's beginning.
        lost_ns: when it had it no more; the start without one.
    """

    team: str
    start_ns: int
    end_ns: int
    until_ns: int
    held_s: float
    robots: tuple[int, ...]
    first: str
    touches: int
    x: float
    far: float
    lost_by: tuple[str, int, str] | None
    lost_ns: int

    @property
    def seconds(self) -> float:
        """Duration with the duels, s."""
        return (self.end_ns - self.start_ns) / 1e9


def spells(
    possession: pl.DataFrame, passes: pl.DataFrame, trajectories: pl.DataFrame, names: Mapping[str, str]
) -> list[Spell]:
    """Teams' times on the ball, by time.

    Args:
        possession: rows of schema Possession of one match.
        passes: rows of schema Passes of that match.
        trajectories: rows of schema Trajectories of that match.
        names: name of each side.
    """
    owned = possession.with_columns(
        pl.col("team").cast(pl.String),
        role=roles(trajectories, *possession.select("team", "robot", "start_ns")),
        last_role=roles(trajectories, *possession.select("team", "last_robot", "end_ns")),
    )
    ends = dict(trajectories.drop_nulls("segment").group_by("segment").agg(pl.col("t_ns").max()).iter_rows())
    given = list(passes.iter_rows(named=True))
    found: list[Spell] = []
    before: dict[str, Any] | None = None
    for (team, segment), own in groupby(
            owned.iter_rows(named=True), key=lambda row: (row["team"], row["segment"])):
        rows = list(own)
        first, last = rows[0], rows[-1]
        if before and before["segment"] == segment:
            found[-1] = found[-1]._replace(until_ns=first["start_ns"])
        else:
            before = None
        passed = [row for row in given if first["start_ns"] <= row["t_ns"] < last["end_ns"]]
        at_ball = [(row[t_ns], row[number]) for table, t_ns, number in (
            (rows, "start_ns", "robot"), (passed, "t_ns", "robot"), (passed, "received_ns", "receiver"),
            ([last], "end_ns", "last_robot")) for row in table]
        found.append(Spell(
            team, first["start_ns"], last["end_ns"], ends[segment],
            held_s=sum(row["end_ns"] - row["start_ns"] for row in rows) / 1e9,
            robots=tuple(dict.fromkeys(number for _, number in sorted(at_ball))),
            first=robot(names[team], first["robot"], first["role"]),
            touches=sum(row["touches"] for row in rows),
            x=first["x"],
            far=max([row[name] for row in rows for name in ("x", "end_x")]
                    + [row[name] for row in passed for name in ("x", "to_x")]),
            lost_by=(before["team"], before["last_robot"], robot(
                names[before["team"]], before["last_robot"], before["last_role"])) if before else None,
            lost_ns=before["end_ns"] if before else first["start_ns"],
        ))
        before = last
    return found
