"""Commands: what the players of a RoboCup 2D match had the server do."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import SIDES, Table, match_id, unit

COMMANDS = ("kick", "dash", "turn", "catch", "tackle")


class Commands(Table):
    """Commands of one kind that one robot of a RoboCup 2D match gave between a sample and the one before.

    Sorted by team, robot, t_ns, command. Matches of other formats have none. Source: the counters in
    rcssserver's ``serializermonitor.cpp``, which its ``player.cpp`` raises.
    """

    NAME: ClassVar[str] = "commands"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(description="the robot's number")
    t_ns = dy.Int64(metadata=unit("ns"), description=(
        "time of the first sample that counts them; it already has their effect: after a kick the ball's new "
        "velocity, after a dash or turn the robot's velocity or heading"
    ))
    command = dy.Enum(COMMANDS, description=(
        "kick, catch: only those that the server did not refuse, so the ball was within reach; "
        "tackle: also one that missed; dash, turn: also while play is stopped"
    ))
    count = dy.Int32(min=1, description="commands since the robot's line before: 1, or more if lines are missing")
