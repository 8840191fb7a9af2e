"""Options: what a robot does from one decision to the next."""

from __future__ import annotations

from typing import Any, ClassVar

import dataframely as dy
import polars as pl

from pitchlore.schemas.appraisals import Appraisals
from pitchlore.schemas.sights import SIGHT
from pitchlore.schemas.table import ROLES, SIDES, Table, match_id, unit

#: The codes of Table 1 that a robot can do on purpose, ascending: the options. Moves randomly is none.
OPTIONS: tuple[int, ...] = (
    1, 11, 21, 22, 23, 33, 34, 44, 45, 46, 47, 57, 67, 68, 78, 88, 98, 108, 118, 128, 138, 139, 140, 150, 151, 152,
    162, 163, 173, 174, 184,
)


class Options(Table):
    """One option of one robot, recovered from the motion of bodies alone.

    A situation says what came about, an option what a robot did meanwhile. Options have the codes of the
    situations that they would end in: a robot on its way to the ball is in 046 (approaches the ball), and its
    option may be 044 (reaches it). Those of one robot never overlap. Sorted by team (home, away), robot, start_ns.
    """

    NAME: ClassVar[str] = "options"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(description="the robot's number")
    role = dy.Enum(ROLES, nullable=True, description="the robot's role when the option starts; null where it is unknown")
    start_ns = dy.Int64(description="start, inclusive", metadata=unit("ns"))
    end_ns = dy.Int64(description="end, exclusive", metadata=unit("ns"))
    option = dy.Int16(min=1, max=193, description="code of Table 1: what the robot most probably did")
    probability = dy.Float32(min=0, max=1, description=(
        "of this option, given the motion; small where several options drive alike there"
    ))
    target = dy.String(nullable=True, description=(
        "what it is done to: ball, own-goal, adversary-goal, or a robot as home-3; null for 184"
    ))
    logged = dy.Int16(nullable=True, min=1, max=194, description=(
        "the option that the team itself logged for the start; null where it logged none"
    ))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")

    @dy.rule()
    def ends_after_start(cls: Any) -> pl.Expr:  # noqa: N805
        """An option lasts."""
        return pl.col("end_ns") > pl.col("start_ns")


class Clues(Table):
    """One window of one robot: how well each option explains its motion there, and what it saw.

    Sorted by team, robot, start_ns.
    """

    NAME: ClassVar[str] = "clues"
    VERSION: ClassVar[int] = 1
    PUBLIC: ClassVar[bool] = False

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(description="the robot's number")
    role = dy.Enum(ROLES, nullable=True, description="the robot's role at the start")
    start_ns = dy.Int64(description="start, inclusive", metadata=unit("ns"))
    end_ns = dy.Int64(description="end, exclusive", metadata=unit("ns"))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")
    sight = dy.Array(dy.Float32(nullable=True), len(SIGHT), description=(
        "what the robot sees at the start: schemas.sights.SIGHT, in that order; null where it is not known"
    ))
    ratios = dy.Array(dy.Float32(), len(OPTIONS), description=(
        "logarithm of how much more probable the motion is with each option than with others, but for a constant"
    ))


class Habits(Table):
    """How often a role of a team takes an option, in one version of the knowledge.

    Only options that the role takes often enough are its habits (knowledge.habits.least_share). Sorted by role and
    option.
    """

    NAME: ClassVar[str] = "habits"
    VERSION: ClassVar[int] = 1

    version = dy.Int32(min=1, description="version of the knowledge")
    team = dy.String(description="team or pool of teams that has them")
    kind = dy.String(description="its league")
    role = dy.Enum(ROLES, description="role of the robot")
    option = dy.Int16(min=1, max=193, description="code of Table 1")
    windows = dy.Float64(min=0, description="expected number of the role's windows (options.window_s) in which it takes the option")
    share = dy.Float64(min=0, max=1, description="their share of all windows of the role")


class HabitTrees(Appraisals):
    """The habits of a team at what its robots see: the logarithm of each option's probability, but for what is common.

    They have the form of appraisals. An option that is none of the team's has one leaf.
    """

    NAME: ClassVar[str] = "habit_trees"
    VERSION: ClassVar[int] = 1
    PUBLIC: ClassVar[bool] = False
