"""Tables of what SSL's game controller, automatic referees and trackers tell: their word, beside what we find."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import SIDES, Table, match_id, unit

STATES = ("event", "proposal", "accepted proposal")


class GameEvents(Table):
    """A game event of an SSL match, as the game controller tells it: a foul, a ball that left, a possible goal.

    Sorted by t_ns. Places are in the axes of `trajectories`: home attacks +x.
    """

    NAME: ClassVar[str] = "game_events"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    t_ns = dy.Int64(description="time at which it was first told", metadata=unit("ns"))
    event = dy.String(description="the league's word, such as BOT_CRASH_UNIQUE or POSSIBLE_GOAL")
    state = dy.Enum(STATES, description="whether it holds, or was only proposed by automatic referees")
    source = dy.String(description="names of the automatic referees that saw it; game controller for its own, people's included")
    team = dy.Enum(SIDES, nullable=True, description="team that it is of: of a foul who is guilty, of a goal who scores; null where none is told")
    robot = dy.Int16(nullable=True, description="number of the robot that did it")
    robot_team = dy.Enum(SIDES, nullable=True, description="team of that robot; of an own goal the other one")
    victim = dy.Int16(nullable=True, description="number of the other team's robot")
    x = dy.Float64(nullable=True, description="place of it along the pitch", metadata=unit("m"))
    y = dy.Float64(nullable=True, description="place of it across the pitch", metadata=unit("m"))
    from_x = dy.Float64(nullable=True, description="place where the kick or the dribbling began", metadata=unit("m"))
    from_y = dy.Float64(nullable=True, description="place where the kick or the dribbling began", metadata=unit("m"))
    measure = dy.String(nullable=True, description="what was measured: distance, speed, height (m, m/s) or a time (s)")
    value = dy.Float64(nullable=True, description="how much it was")
    note = dy.String(nullable=True, description="reason or message that was told with it")


class Kicks(Table):
    """A kick of an SSL match, as a tracker tells it: `kicked_ball`, its last estimate.

    Sorted by t_ns. Places and velocities are in the axes of `trajectories`: home attacks +x.
    """

    NAME: ClassVar[str] = "kicks"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    t_ns = dy.Int64(description="time of the kick", metadata=unit("ns"))
    source = dy.String(description="name of the tracker, else its uuid")
    team = dy.Enum(SIDES, nullable=True, description="team of the robot that kicked; null where none is told")
    robot = dy.Int16(nullable=True, description="its number")
    x = dy.Float64(nullable=True, description="place of the ball along the pitch", metadata=unit("m"))
    y = dy.Float64(nullable=True, description="place of the ball across the pitch", metadata=unit("m"))
    vx = dy.Float64(nullable=True, description="velocity of the ball just after the kick", metadata=unit("m/s"))
    vy = dy.Float64(nullable=True, description="velocity of the ball just after the kick", metadata=unit("m/s"))
    vz = dy.Float64(nullable=True, description="velocity upwards; above 0 the ball was chipped", metadata=unit("m/s"))
    stop_ns = dy.Int64(nullable=True, description="time at which the ball would come to rest", metadata=unit("ns"))
    stop_x = dy.Float64(nullable=True, description="place where it would", metadata=unit("m"))
    stop_y = dy.Float64(nullable=True, description="place where it would", metadata=unit("m"))
