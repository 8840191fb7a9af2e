"""Analysts' tables of a match: tried passes, running, phases, pressing, space, stamina (docs/explanation/analysts.md).

Nothing on the way to a policy reads them. All places are seen by the row's team, which attacks +x.
"""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import ROLES, SIDES, Table, match_id, unit

#: What came of a pass that was tried.
CAME = ("arrives", "intercepted", "contested", "out")
#: Phases of a team that has the ball.
PHASES = ("transition", "build-up", "middle", "attack")


class PassAttempts(Table):
    """One pass that was tried: the ball leaves a robot, and the next that touches it is another. Sorted by t_ns.

    As in loganalyzer3's `pass_probability` the ball goes at least 2 m on a pitch of 105 m (in proportion on
    others) and nobody touches it on its way. A row of the table shots is no pass, unless a robot of the team
    touches next (outcome own). Those that arrive are the rows of the table passes: their share is the team's
    pass completion.
    """

    NAME: ClassVar[str] = "pass_attempts"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team that passes")
    t_ns = dy.Int64(description="last touch of the robot that passes", metadata=unit("ns"))
    until_ns = dy.Int64(description="next touch, or the last sample before play stops", metadata=unit("ns"))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")
    robot = dy.Int16(description="number of the robot that passes")
    next_robot = dy.Int16(nullable=True, description=(
        "number of the robot that touches next: the receiver if it arrives, else of the other team; null if contested or out"
    ))
    x = dy.Float32(description="place of the ball at t_ns, along the pitch, the team attacks +x", metadata=unit("m"))
    y = dy.Float32(description="the same across the pitch, to the left of +x", metadata=unit("m"))
    to_x = dy.Float32(description="place of the ball at until_ns, along the pitch", metadata=unit("m"))
    to_y = dy.Float32(description="the same across the pitch", metadata=unit("m"))
    length = dy.Float32(min=0, description="straight distance between the two", metadata=unit("m"))
    came = dy.Enum(CAME, description=(
        "arrives: a robot of the team touches next; intercepted: one of the other team does; contested: "
        "both do at once; out: play stops before, without a goal. loganalyzer3 leaves those out"
    ))


class Efforts(Table):
    """Running of one robot in play. Sorted by team, robot.

    Distances are sums of speed times time, as in databallpy's `get_covered_distance`. floodlight's sums steps
    between positions, which adds the noise of positions. A sprint's least speed is football's 7 m/s for people;
    robots: 90 % of the league's top cruising speed (pipeline.game.pitch). Fast is 5.5 m/s, or 60 %.
    """

    NAME: ClassVar[str] = "efforts"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(min=0, description="number of the robot")
    role = dy.Enum(ROLES, nullable=True, description="role that it had most often; null where it had none")
    seconds = dy.Float64(min=0, description="time in play in which it is seen", metadata=unit("s"))
    distance = dy.Float64(min=0, description="distance covered", metadata=unit("m"))
    fast = dy.Float64(min=0, description="distance covered at least fast, sprints included", metadata=unit("m"))
    sprinted = dy.Float64(min=0, description="distance covered in sprints", metadata=unit("m"))
    sprints = dy.Int32(min=0, description="number of sprints: stretches above the sprint's speed for the setting sprint or longer")
    top_speed = dy.Float64(min=0, description="speed that it exceeds in a hundredth of the time", metadata=unit("m/s"))
    space = dy.Float64(nullable=True, min=0, max=1, description=(
        "mean share of the pitch that it reaches first (table space); null where no instant was sampled"
    ))


class Phases(Table):
    """One stretch of a team's possession in one phase. Sorted by start_ns.

    The other team defends against it then: against build-up it presses high. While nobody has the ball there is
    no row. Football has no one definition; ours is by time since the ball was won and by thirds of the pitch.
    """

    NAME: ClassVar[str] = "phases"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team that has the ball (table possession)")
    start_ns = dy.Int64(description="start", metadata=unit("ns"))
    end_ns = dy.Int64(description="end, exclusive", metadata=unit("ns"))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")
    phase = dy.Enum(PHASES, description=(
        "transition: the setting transition after the ball was won from the other team in play; after "
        "that build-up, middle, attack: the ball in the own, the middle, the adversary's third"
    ))


class Pressing(Table):
    """A team's pressing in a match. Sorted by team.

    PPDA is football's measure (Trainor, 2014): passes that the adversary tries in its own 60 % of the pitch, for
    each defensive action there. Ours counts balls won and duels as actions, for fouls and tackles are not told.
    """

    NAME: ClassVar[str] = "pressing"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team that presses")
    passes = dy.Int32(min=0, description="passes that the adversary tried from its own 60 % of the pitch (table pass_attempts)")
    actions = dy.Int32(min=0, description="possessions of the adversary that ended there: the ball was won, or both touched")
    ppda = dy.Float64(nullable=True, min=0, description="passes by actions; less is more pressing; null without actions")
    presses = dy.Int32(min=0, description="rows of the table pressure")
    high = dy.Int32(min=0, description="of these with the ball in the adversary's third")
    won = dy.Int32(min=0, description="of all these won the ball")
    lost = dy.Int32(min=0, description="possessions that the adversary ended in play")
    regained = dy.Int32(min=0, description="of these the next possession in the same stretch of play, within the setting regain, was the team's again")


class Space(Table):
    """Space of a team at one instant in play: the share of the pitch that its robots reach first. Sorted by t_ns, team.

    Each robot goes on as it moves for a reaction time, then straight at the same speed, as in unravelsports'
    time to intercept without its time to turn. So the first is the one whose place after the reaction time is
    nearest. databallpy's and floodlight's Voronoi go by the places alone.
    """

    NAME: ClassVar[str] = "space"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    t_ns = dy.Int64(description="sample's time", metadata=unit("ns"))
    team = dy.Enum(SIDES, description="the team")
    robots = dy.Int16(min=0, description="number of its robots that are seen")
    share = dy.Float32(min=0, max=1, description="share of the pitch")
    ahead = dy.Float32(min=0, max=1, description="share of the third in front of the adversary's goal")


class Stamina(Table):
    """Stamina of one player of a RoboCup 2D match, at the first line of each ten seconds. Sorted by t_ns, team, robot.

    As the server's log has it, of players on the pitch; other formats have none. A dash spends stamina, and each cycle
    gives some back. Source: rcssserver's ``player.cpp``.
    """

    NAME: ClassVar[str] = "stamina"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    t_ns = dy.Int64(description="time of the line", metadata=unit("ns"))
    team = dy.Enum(SIDES, description="team of the player")
    robot = dy.Int16(min=0, description="number of the player")
    stamina = dy.Float32(min=0, description="what it can spend on dashes; 8,000 at most, by the server's default")
    effort = dy.Float32(min=0, description="share of a dash's power that takes effect; falls while stamina is low")
    recovery = dy.Float32(min=0, description=(
        "share of the usual gain of stamina that a cycle brings; falls while stamina is low, and does not come back in play"
    ))
    capacity = dy.Float32(nullable=True, min=0, description=(
        "stamina that can still come back; null in logs of version 4, which have none"
    ))
