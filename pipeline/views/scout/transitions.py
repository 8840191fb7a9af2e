"""Transitions between behaviours: counts of the public table decisions."""

from __future__ import annotations

from typing import NamedTuple

import polars as pl

from pitchlore.schemas.behaviours import moves_randomly

#: Neighbours of a behaviour that a card names, before it and after it.
_NAMED = 2


class Followed(NamedTuple):
    """Frequent neighbours of a behaviour, after it or before it.

    Attributes:
        behaviour: its id.
        times: how often.
        of: how often the other one was begun.
    """

    behaviour: str
    times: int
    of: int


class Successions(NamedTuple):
    """How often behaviours were begun, and which one the same robot began next.

    Attributes:
        begun: columns behaviour_id, role and n (how often), the most frequent first.
        counts: columns behaviour_id, then (the next one) and times, the most frequent first. The next one is
            of the same match, robot and episode; after the last one of an episode nothing follows.
    """

    begun: pl.DataFrame
    counts: pl.DataFrame


def transitions(decisions: pl.DataFrame) -> Successions:
    """The transitions in decisions of one team.

    Args:
        decisions: rows of schema Decisions, in its order.
    """
    rows = decisions.select(
        "match_id", "team", "robot", "episode", behaviour_id=pl.coalesce("behaviour_id", moves_randomly()),
        role=pl.coalesce(pl.col("behaviour_id").str.extract(r"^([a-z]+)-"), pl.col("role").cast(pl.String)))
    begun = rows.group_by("behaviour_id", "role").agg(n=pl.len()).sort(
        "n", "behaviour_id", descending=[True, False])
    following = pl.col("behaviour_id").shift(-1).over("match_id", "team", "robot", "episode")
    counts = rows.with_columns(then=following).drop_nulls("then").group_by("behaviour_id", "then").agg(
        times=pl.len()).sort("times", "behaviour_id", "then", descending=[True, False, False])
    return Successions(begun, counts)


def neighbours_of(found: Successions) -> dict[str, tuple[list[Followed], list[Followed]]]:
    """By behaviour: up to two that came before most often, and up to two that followed."""
    total = dict(found.begun.select("behaviour_id", "n").iter_rows())
    near: dict[str, tuple[list[Followed], list[Followed]]] = {name: ([], []) for name in total}
    for before, after, times in found.counts.iter_rows():
        for own, other, place in ((after, before, 0), (before, after, 1)):
            if len(near[own][place]) < _NAMED:
                near[own][place].append(Followed(other, times, total[own]))
    return near
