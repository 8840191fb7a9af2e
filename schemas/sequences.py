"""Sequences: the situations of robots one after the other, with all that is learned from of them."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.decisions import ENDS, Decisions
from pitchlore.schemas.table import ROLES, SIDES, Table, match_id, unit


class Sequences(Table):
    """One situation of one robot, in the order of the table situations: its state, its values, its episode."""

    NAME: ClassVar[str] = "sequences"
    VERSION: ClassVar[int] = 2
    PUBLIC: ClassVar[bool] = False

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(description="the robot's number")
    role = dy.Enum(ROLES, description="the robot's role when the situation starts")
    code = dy.Int16(min=1, max=194, description="the paper's code (Table 1)")
    follows = dy.Bool(description="whether it follows the situation of the row before without a break")
    start_ns = dy.Int64(description="start, inclusive", metadata=unit("ns"))
    end_ns = dy.Int64(description="end, exclusive", metadata=unit("ns"))
    state = dy.Int64(nullable=True, min=0, description="state at the start, as the robot's team sees it (key full36); null where it is unknown")
    episode = dy.Int32(min=0, description="segment of play that it lies in")
    over_ns = dy.Int64(nullable=True, description="end of the episode: the event that ended it, else its last sample", metadata=unit("ns"))
    reward = dy.Float64(description="what the episode's end gives the robot's team: +1 goal for, -1 goal against, else 0")
    ends = dy.Enum(ENDS, description="terminal: the episode ended by an event; truncated: the recording was cut there")
    value = dy.Float64(min=-1, max=1, description="value by the next goal (paper section 3.2.2)")
    change = dy.Float64(nullable=True, min=-2, max=2, description=(
        "what it changes of V, goals included; null if groups are valued by the next goal (outcome = 'paper')"
    ))
    x = dy.Float32(nullable=True, description="the robot's place at the start, along the pitch, its team attacks +x", metadata=unit("m"))
    y = dy.Float32(nullable=True, description="the same across the pitch, to the left of +x", metadata=unit("m"))


class Choices(Decisions):
    """One decision that a player logged, with its value: a row of the table decisions."""

    NAME: ClassVar[str] = "choices"
    VERSION: ClassVar[int] = 1
    PUBLIC: ClassVar[bool] = False
