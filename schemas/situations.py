"""Situations: one robot, one code of Table 1, start and end."""

from __future__ import annotations

from typing import Any, ClassVar

import dataframely as dy
import polars as pl

from pitchlore.schemas.table import ROLES, SIDES, Table, match_id, unit

#: The paper's code of "robot moves randomly" (Table 1), given to time that no rule explains.
MOVES_RANDOMLY = 194


class Situations(Table):
    """One situation of one robot; those of one robot never overlap.

    Sorted by team (home, away), robot, start_ns. Source: paper section 3.2.1, Table 1.
    """

    NAME: ClassVar[str] = "situations"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot, whose point of view the situation takes")
    robot = dy.Int16(description="the robot's number")
    role = dy.Enum(ROLES, description="the robot's role when the situation starts")
    code = dy.Int16(min=1, max=194, description="the paper's code (Table 1); 194 is moves randomly")
    name = dy.String(description="the paper's name (Table 1)")
    start_ns = dy.Int64(description="start, inclusive", metadata=unit("ns"))
    end_ns = dy.Int64(description="end, exclusive", metadata=unit("ns"))
    strength = dy.Float32(
        nullable=True, min=0, max=1,
        description="lesser of the memberships of initial and final condition; null for 194, which has no rule",
    )
    target = dy.String(nullable=True, description=(
        "target: ball, own-goal, adversary-goal, or a robot as home-3; null for 184 and 194"
    ))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")

    @dy.rule()
    def ends_after_start(cls: Any) -> pl.Expr:  # noqa: N805
        """A situation lasts."""
        return pl.col("end_ns") > pl.col("start_ns")
