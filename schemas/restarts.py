"""Restarts: what came of each kick-off, penalty, free kick and so on."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import SIDES, Table, match_id, unit

#: Kinds of restarts, whatever word the source has for them.
RESTARTS = ("kick-off", "penalty", "goal kick", "free kick", "corner", "kick-in", "free ball", "other")


class Restarts(Table):
    """One restart as one side sees it: each restart has two rows. Sorted by t_ns, team (home first).

    Restarts are the referee's events kick-off and fault. What came of a restart is looked for in the segment
    of play that begins with it, however long that is: a shot within 8 s is `shot_ns - taken_ns <= 8e9`.
    """

    NAME: ClassVar[str] = "restarts"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    t_ns = dy.Int64(description="the referee's event", metadata=unit("ns"))
    team = dy.Enum(SIDES, description="side that the row is about")
    own = dy.Bool(nullable=True, description=(
        "whether this side restarts; null if neither does, as with a free ball, or if it is not known who does"
    ))
    kind = dy.Enum(RESTARTS, description="kind, by the source's word; other: the source has no word that tells it")
    note = dy.String(nullable=True, description="the source's own word (table referee)")
    segment = dy.Int32(nullable=True, min=0, description=(
        "stretch of uninterrupted play that begins with it; null if no play follows before the next event"
    ))
    taken_ns = dy.Int64(nullable=True, description=(
        "first touch of the ball in the segment, by any robot; null if nobody touches"
    ), metadata=unit("ns"))
    shot_ns = dy.Int64(nullable=True, description=(
        "the side's first shot in the segment (table shots, wide ones included); null without one"
    ), metadata=unit("ns"))
    against_ns = dy.Int64(nullable=True, description="the other side's first shot in the segment; null without one",
                          metadata=unit("ns"))
    goal_ns = dy.Int64(nullable=True, description="the side's goal that ends the segment; null without one",
                       metadata=unit("ns"))
    conceded_ns = dy.Int64(nullable=True, description="the other side's goal that ends the segment; null without one",
                           metadata=unit("ns"))
