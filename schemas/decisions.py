"""Decisions: the behaviour that a robot chose in a state, and its reward."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import ROLES, SIDES, Table, match_id, unit

ENDS = ("terminal", "truncated")

#: The first part of an episode that tables count by itself, seconds: what is decided there belongs to the restart.
FIRST_S = 1.0
#: A decision that lasts no longer is brief, frames.
BRIEF_FRAMES = 2


class Decisions(Table):
    """One decision of one robot: logged by the player that chose it, or read from its situations.

    Sorted by match, team, robot, t_ns. Consecutive rows of one (match, team, robot, episode) are the
    transitions that the trainer learns from.
    """

    NAME: ClassVar[str] = "decisions"
    VERSION: ClassVar[int] = 2

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(description="the robot's number")
    role = dy.Enum(ROLES, description="role at the decision")
    t_ns = dy.Int64(description="start of the behaviour", metadata=unit("ns"))
    end_ns = dy.Int64(description="start of the next decision, or end of the episode", metadata=unit("ns"))
    state = dy.Int64(min=0, description="state at the decision, all 36 elements in mixed radix (key full36, whatever the settings)")
    behaviour_id = dy.String(nullable=True, description="behaviour begun; null for moves randomly")
    chosen = dy.Bool(description="true: a player logged this choice; false: read from the robot's situations")
    random = dy.Bool(description="whether chosen at random")
    reward = dy.Float64(description="+1 goal for, -1 goal against at end_ns, else 0")
    episode = dy.Int32(min=0, description="segment of play that it lies in")
    ends = dy.Enum(ENDS, nullable=True, description=(
        "null: another decision follows; terminal: the episode ended here by a goal, a fault or the "
        "final whistle; truncated: the recording was cut here"
    ))
    value = dy.Float64(description="value of the behaviour's instance by its outcome, in (-1, 1)")
