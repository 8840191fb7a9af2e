"""Shots and goals, for and against, within some seconds after the occurrences of behaviours."""

from __future__ import annotations

from typing import NamedTuple

import polars as pl

from pitchlore.schemas import SIDES

#: Seconds after an occurrence's end within which what comes counts as having followed it.
FOLLOWS_S = 10.0
#: What may follow: whether a shot or a goal, and whether it is the team's own.
KINDS = {"shot": ("shots", True), "goal": ("goals", True),
         "against": ("shots", False), "conceded": ("goals", False)}


class Following(NamedTuple):
    """Shots and goals after the occurrences of a behaviour.

    Attributes:
        n: number of occurrences.
        shot, goal: numbers of these that a shot and a goal of the team followed.
        against, conceded: the same of the adversary.
    """

    n: int
    shot: int
    goal: int
    against: int
    conceded: int


def followed_by(
    found: pl.DataFrame, shots: pl.DataFrame, goals: pl.DataFrame, trajectories: pl.DataFrame
) -> pl.DataFrame:
    """Masks of the occurrences that a shot or a goal followed.

    It counts from an occurrence's start to FOLLOWS_S after its end (both included), before play stops. So a
    shot within the occurrence counts, too. Shots past the post count.

    Args:
        found: columns team, t_ns, done_ns and episode, of one match.
        shots: rows of schema Shots of the match.
        goals: rows of schema Goals of the match.
        trajectories: rows of schema Trajectories of the match.

    Returns:
        The occurrences with a Boolean column for each of KINDS.
    """
    starts = trajectories.drop_nulls("segment").group_by(episode="segment").agg(
        since_ns=pl.col("t_ns").min()).select("since_ns", "episode").sort("since_ns")
    # a goal that is logged with the restart ends the play before it
    scored = goals.drop_nulls("team").select("team", "t_ns", before_ns=pl.col("t_ns") - 1).sort(
        "before_ns").join_asof(starts, left_on="before_ns", right_on="since_ns", strategy="backward")
    came = {"shots": shots.select("team", "t_ns", episode="segment"),
            "goals": scored.select("team", "t_ns", "episode")}
    until = pl.col("done_ns") + round(FOLLOWS_S * 1e9)
    found = found.with_columns(pl.col("team").cast(pl.String)).sort("t_ns")
    other = dict(zip(SIDES, SIDES[::-1], strict=True))
    for name, (table, own) in KINDS.items():
        team = pl.col("team").cast(pl.String)
        right = came[table].select(
            "episode", team=team if own else team.replace_strict(other),
            came_ns="t_ns").with_columns(at_ns="came_ns").sort("at_ns")
        found = found.join_asof(
            right, left_on="t_ns", right_on="at_ns", by=("team", "episode"), strategy="forward",
            check_sortedness=False,
        ).with_columns((pl.col("came_ns") <= until).fill_null(value=False).alias(name)).drop(
            "came_ns", "at_ns")
    return found


def following(found: pl.DataFrame) -> dict[str, Following]:
    """Shots and goals after each behaviour, by its id, from occurrences of :func:`followed_by`."""
    counts = found.group_by("behaviour_id").agg(pl.len(), *(pl.col(name).sum() for name in KINDS))
    return {row[0]: Following(*row[1:]) for row in counts.iter_rows()}
