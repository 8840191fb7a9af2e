"""Events of a match: possession, passes, shots, pressure.

Their definitions are those of the field where it has some: loganalyzer3 (opusymcomp, RoboCup 2D) and football's
event data. Where ours differ, the column says so. All places are seen by the row's team, which attacks +x.
"""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import ROLES, SIDES, Table, match_id, unit

#: How a team's possession ends.
ENDINGS = ("lost", "contested", "shot", "goal", "conceded", "stopped", "end")
#: Directions of a pass: quarters about the team's direction of attack.
DIRECTIONS = ("front", "left", "back", "right")
#: What came of a shot.
OUTCOMES = ("goal", "saved", "blocked", "own", "missed", "wide")


class Possession(Table):
    """One stretch in which a team has the ball. Sorted by start_ns.

    A team has the ball from its first touch until the other team touches it, both touch it at once, or play
    stops. That is loganalyzer3's "domination", which goes by the server's kicks: here a robot touches the ball
    when their centres are nearer than the league's contact distance, which all leagues have. While nobody has
    it there is no row.
    """

    NAME: ClassVar[str] = "possession"
    VERSION: ClassVar[int] = 2
    SINCE: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team that has the ball")
    start_ns = dy.Int64(description="its first touch", metadata=unit("ns"))
    end_ns = dy.Int64(description="end, exclusive", metadata=unit("ns"))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")
    robot = dy.Int16(description="number of the robot that touched first")
    last_robot = dy.Int16(description="number of the robot that touched last")
    touches = dy.Int32(min=1, description="number of touches; one goes on over two samples without contact")
    passes = dy.Int32(min=0, description="number of passes in it (table passes)")
    x = dy.Float32(description="place of the ball at the start, along the pitch, the team attacks +x", metadata=unit("m"))
    y = dy.Float32(description="the same across the pitch, to the left of +x", metadata=unit("m"))
    end_x = dy.Float32(description="place of the ball at the end, along the pitch", metadata=unit("m"))
    end_y = dy.Float32(description="the same across the pitch", metadata=unit("m"))
    ended = dy.Enum(ENDINGS, description=(
        "lost: the other team touched, and the last touch was no shot; contested: both touch; shot: the last touch was a shot (table shots) that was no goal; goal, conceded: play stopped with a goal of the "
        "team, or of the other; stopped: play stopped; end: the recording ends"
    ))


class Passes(Table):
    """One pass: the ball goes from a robot to another of its team. Sorted by t_ns.

    As in loganalyzer3 only passes that arrive are counted. Unlike there, nobody touches the ball on its way
    for a sample at least, so that two robots pushing it together pass nothing. Rows are the tried passes
    (table pass_attempts) that arrive: they go at least as far, and only shots with outcome own are among them.
    """

    NAME: ClassVar[str] = "passes"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team that passes")
    t_ns = dy.Int64(description="last touch of the robot that passes", metadata=unit("ns"))
    received_ns = dy.Int64(description="first touch of the one that receives", metadata=unit("ns"))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")
    robot = dy.Int16(description="number of the robot that passes")
    receiver = dy.Int16(description="number of the robot that receives")
    x = dy.Float32(description="place of the ball at t_ns, along the pitch, the team attacks +x", metadata=unit("m"))
    y = dy.Float32(description="the same across the pitch, to the left of +x", metadata=unit("m"))
    to_x = dy.Float32(description="place of the ball at received_ns, along the pitch", metadata=unit("m"))
    to_y = dy.Float32(description="the same across the pitch", metadata=unit("m"))
    direction = dy.Enum(DIRECTIONS, description=(
        "quarter about the direction of attack in which the ball went, as in loganalyzer3; 45 degrees are front, "
        "135 are back on both sides (there on one side each)"
    ))
    through = dy.Bool(description=(
        "through pass: at least 5 m forward, to a place at least 15 m inside the adversary's half and beyond its "
        "last robot but the goalkeeper at t_ns, on a pitch of 105 m (loganalyzer3), in proportion on others"
    ))


class Shots(Table):
    """One shot: a touch after which the ball would roll into the adversary's goal, or goes past it. Sorted by t_ns.

    A shot on target is as in loganalyzer3: on its straight line after the touch the ball would cross the goal
    line between the posts, and fast enough (2D: at more than 10 m/s; elsewhere: at all). loganalyzer3 counts
    only these: `outcome <> 'wide'`. Ours has three differences. A touch that the same robot follows up before
    anybody else touches is no shot. A ball aimed past a post that goes in all the same is on target. The first
    touch of a kick-off in the centre circle (9.15 m on a pitch of 105 m) is a shot only if it becomes a goal, or
    the ball gets half of its way to the goal line before the next touch.
    """

    NAME: ClassVar[str] = "shots"
    VERSION: ClassVar[int] = 2
    SINCE: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team that shoots")
    t_ns = dy.Int64(description="last touch before the ball leaves", metadata=unit("ns"))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")
    robot = dy.Int16(description="number of the robot that shoots")
    role = dy.Enum(ROLES, nullable=True, description="its role then; null where it is not seen")
    x = dy.Float32(description="place of the ball, along the pitch, the team attacks +x", metadata=unit("m"))
    y = dy.Float32(description="the same across the pitch, to the left of +x", metadata=unit("m"))
    speed = dy.Float32(min=0, description="speed of the ball after the touch", metadata=unit("m/s"))
    distance = dy.Float32(min=0, description="from the ball to the middle of the goal", metadata=unit("m"))
    angle = dy.Float32(min=0, description="angle at which the ball sees the goal", metadata=unit("rad"))
    outcome = dy.Enum(OUTCOMES, description=(
        "goal: it goes in, perhaps off adversaries (deflected_s of the settings); saved, blocked: the adversary touches next, its goalkeeper or "
        "another; own: another robot of the team touches next; missed: nobody touches and there is no goal; "
        "wide: aimed past a post by not more than wide allows (settings), fast enough, and at the goal line before "
        "the next touch"
    ))
    by = dy.Int16(nullable=True, description="number of the adversary's robot that saved or blocked it, else null")
    in_way = dy.Int16(nullable=True, min=0, description=(
        "number of adversaries in the way at t_ns: their centres lie in the angle at which the ball sees the "
        "goal, ahead of it and not beyond the net; null where no adversary is seen, and in files of version 1"
    ))
    cover = dy.Float32(nullable=True, min=0, description=(
        "least distance of an adversary's centre at t_ns from the straight way of the ball to the goal's middle; "
        "null as in_way"
    ), metadata=unit("m"))


class Pressure(Table):
    """One robot that presses the one with the ball. Sorted by team, robot, start_ns.

    A robot presses while it is within the league's CLOSE (pipeline.game.pitch) of an adversary that touches the
    ball. Football's event data (StatsBomb) take five yards of a person.
    """

    NAME: ClassVar[str] = "pressure"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team that presses")
    robot = dy.Int16(description="number of the robot that presses")
    start_ns = dy.Int64(description="start, inclusive", metadata=unit("ns"))
    end_ns = dy.Int64(description="last sample, inclusive", metadata=unit("ns"))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")
    carrier = dy.Int16(description="number of the adversary that is pressed first")
    x = dy.Float32(description="place of the ball at the start, along the pitch, the pressing team attacks +x", metadata=unit("m"))
    y = dy.Float32(description="the same across the pitch, to the left of +x", metadata=unit("m"))
    won = dy.Bool(description="whether the pressing team has the ball within won_s of the end (settings), before play stops")
