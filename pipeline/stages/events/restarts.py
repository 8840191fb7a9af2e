"""Restarts: kick-offs, penalties, free kicks and so on, with what came of each."""

from __future__ import annotations

import re

import polars as pl

from pitchlore.pipeline.stages.events.control import Control
from pitchlore.schemas import SIDES, Restarts

#: A part of the source's word, letters alone, to the kind; the first that is found counts.
_KINDS = {
    "kickoff": "kick-off", "penalty": "penalty", "goalkick": "goal kick", "corner": "corner",
    "kickin": "kick-in", "throwin": "kick-in", "freeball": "free ball", "dropball": "free ball",
    "freekick": "free kick", "direct": "free kick",  # and indirect
}


def kind_of(event: str, note: str | None) -> str:
    """The kind of a restart, one of RESTARTS, from the referee's event and the source's word for it."""
    if event == "kick-off":
        return "kick-off"
    word = re.sub("[^a-z]", "", (note or "").lower())
    return next((kind for part, kind in _KINDS.items() if part in word), "other")


def restarts(
    control: Control, shots: pl.DataFrame, referee: pl.DataFrame, over: pl.DataFrame
) -> pl.DataFrame:
    """Rows of schema Restarts of one match.

    Args:
        control: control of the match.
        shots: rows of schema Shots of the match.
        referee: rows of schema Referee of the match.
        over: how its segments ended (:func:`pipeline.game.episodes.episodes`).
    """
    given = referee.filter(pl.col("event").is_in(["kick-off", "fault"])).sort("t_ns", maintain_order=True)
    ball, contacts = control.ball, control.contacts
    begins = pl.DataFrame({"segment": ball.segment, "begins": ball.t_ns}).group_by("segment").agg(
        pl.col("begins").min())
    touched = pl.DataFrame({
        "segment": ball.segment[contacts.first], "taken_ns": ball.t_ns[contacts.first],
    }).group_by("segment").agg(pl.col("taken_ns").min())
    # the segment that begins with the event, or at the first sample after it
    following = given.with_columns(next_ns=pl.col("t_ns").shift(-1)).join_asof(
        begins.sort("begins"), left_on="t_ns", right_on="begins", strategy="forward").with_columns(
        segment=pl.when(pl.col("next_ns").is_null() | (pl.col("begins") < pl.col("next_ns"))).then("segment"))
    segment = pl.col("segment").cast(pl.Int64)
    first = shots.group_by(segment, scorer=pl.col("team").cast(pl.String)).agg(pl.col("t_ns").min())
    scored = over.filter(pl.col("outcome") == "goal").select(
        "scorer", segment=pl.col("episode").cast(pl.Int64), t_ns="over_ns")
    kinds = [kind_of(*row) for row in given.select("event", "note").iter_rows()]
    rows = following.with_columns(pl.Series("kind", kinds, dtype=pl.String)).join(
        touched, on="segment", how="left", maintain_order="left")
    sides = []
    for side, other in (SIDES, SIDES[::-1]):
        columns = rows.with_columns(own=pl.col("team") == side, team=pl.lit(side))
        for name, table, team in (
            ("shot_ns", first, side), ("against_ns", first, other),
            ("goal_ns", scored, side), ("conceded_ns", scored, other),
        ):
            own = table.filter(pl.col("scorer") == team).select("segment", pl.col("t_ns").alias(name))
            columns = columns.join(own, on="segment", how="left", maintain_order="left")
        sides.append(columns)
    schema = pl.Schema(Restarts.dtypes())
    return pl.concat(sides).select(list(schema)).cast(schema).sort("t_ns", "team", maintain_order=True)
