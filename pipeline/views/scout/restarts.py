"""Restarts: outcomes within some seconds, beside those of any moment of play."""

from __future__ import annotations

from typing import NamedTuple

import polars as pl

from pitchlore.pipeline.game.episodes import episodes
from pitchlore.pipeline.numbers.statistics import wilson
from pitchlore.schemas import SIDES
from pitchlore.schemas.restarts import RESTARTS

#: Seconds from the first touch within which something counts as the outcome of a restart.
SOON_S = 8.0
#: What may come of a restart: column of the table restarts.
OUTCOMES = ("shot_ns", "goal_ns", "against_ns", "conceded_ns")


class Share(NamedTuple):
    """A share with Wilson's 95 % interval; the interval is None if the cases are not independent.

    Attributes:
        hits: cases in which it happened.
        n: all cases, at least 1.
        low, high: ends of the interval.
    """

    hits: int
    n: int
    low: float | None
    high: float | None

    @property
    def share(self) -> float:
        """Hits of all cases."""
        return self.hits / self.n


class Paid(NamedTuple):
    """Outcomes of the restarts of one kind.

    Attributes:
        kind: one of RESTARTS.
        own: whether the team restarts; None: neither team does, or it is not known which.
        shot, goal: the team's, within SOON_S of the first touch.
        against, conceded: the other team's.
    """

    kind: str
    own: bool | None
    shot: Share
    goal: Share
    against: Share
    conceded: Share


def came_soon(column: str) -> pl.Expr:
    """True where an outcome in a row of schema Restarts came within SOON_S of the first touch."""
    return (pl.col(column) - pl.col("taken_ns") <= round(SOON_S * 1e9)).fill_null(value=False)


def paid(restarts: pl.DataFrame) -> list[Paid]:
    """Outcomes of a team's restarts and of those of neither team, by kind; only kinds that there are.

    Args:
        restarts: rows of schema Restarts of the team's sides. Its adversaries' restarts are left out.
    """
    found = []
    for own in (True, None):
        mine = restarts.filter(pl.col("own") if own else pl.col("own").is_null())
        for kind in RESTARTS:
            rows = mine.filter(pl.col("kind") == kind)
            if rows.height:
                hits = rows.select(came_soon(name).sum() for name in OUTCOMES).row(0)
                found.append(Paid(kind, own, *(
                    Share(count, rows.height, *wilson(count, rows.height)) for count in hits)))
    return found


class FollowedSamples(NamedTuple):
    """Samples of play of one side, and how many were followed by what within SOON_S in the same segment.

    Attributes:
        n: samples of the ball in play.
        shot, goal: followed by the side's.
        against, conceded: followed by the other side's.
    """

    n: int
    shot: int
    goal: int
    against: int
    conceded: int


def any_moment(
    trajectories: pl.DataFrame, shots: pl.DataFrame, referee: pl.DataFrame
) -> dict[str, FollowedSamples]:
    """The control: what follows any sample of play, by side.

    Args:
        trajectories: rows of schema Trajectories of one match.
        shots: rows of schema Shots of the match.
        referee: rows of schema Referee of the match, which has the goals.
    """
    segment = pl.col("segment").cast(pl.Int64)
    samples = trajectories.filter(pl.col("team") == "ball", pl.col("segment").is_not_null()).select(
        "t_ns", segment).sort("t_ns")
    goals = episodes(trajectories, referee).filter(pl.col("outcome") == "goal").select(
        pl.col("episode").cast(pl.Int64).alias("segment"), team="scorer", t_ns="over_ns")
    shot = shots.select(segment, pl.col("team").cast(pl.String), "t_ns")

    def followed(events: pl.DataFrame, side: str) -> int:
        own = events.filter(pl.col("team") == side).sort("t_ns").select("segment", "t_ns")
        found = samples.join_asof(
            own.with_columns(then="t_ns"), on="t_ns", by="segment", strategy="forward",
            tolerance=round(SOON_S * 1e9), check_sortedness=False)
        return found["then"].count()

    counts = {side: (followed(shot, side), followed(goals, side)) for side in SIDES}
    return {side: FollowedSamples(samples.height, *counts[side], *counts[other])
            for side, other in (SIDES, SIDES[::-1])}


def control_over_matches(each: list[FollowedSamples]) -> Paid | None:
    """The control over a team's sides in matches; None without a sample. Its shares have no interval."""
    n, *hits = (sum(values) for values in zip(*each, strict=True)) if each else (0,)
    if not n:
        return None
    return Paid("any", None, *(Share(count, n, None, None) for count in hits))
