"""Sights: what a robot saw when it decided, in numbers, and what came of its choice."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import ROLES, SIDES, Table, match_id, unit

#: The numbers of a sight, by name, with their meanings: metres, m/s and cosines, seen by a team that attacks
#: +x. Where the ball's y is negative, the pitch is mirrored at the line between the goals.
SIGHT: dict[str, str] = {
    "ball_x": "the ball along the pitch",
    "ball_y": "the ball's distance from the line between the goals",
    "ball_vx": "its velocity along the pitch",
    "ball_vy": "its velocity across the pitch, away from that line",
    "x": "the robot along the pitch",
    "y": "the robot across the pitch, towards the ball's side",
    "vx": "its velocity along the pitch",
    "vy": "its velocity across the pitch",
    "ball_distance": "from the robot to the ball",
    "ball_dx": "from the robot to the ball, along the pitch",
    "ball_dy": "from the robot to the ball, across the pitch",
    "behind": "cosine between its way to the ball and the ball's way to the adversary's goal",
    "faces_ball": "cosine between its heading, forward or backward, and its way to the ball",
    "faces_shot": "cosine between its heading, forward or backward, and the ball's way to the adversary's goal",
    "nearer": "number of team-mates that are nearer to the ball",
    "mate_distance": "from the team-mate that is nearest to the ball to the ball",
    "adversary_distance": "from the adversary that is nearest to the ball to the ball",
    "deeper": "number of team-mates that are nearer to the own goal",
    "own_goal": "from the ball to the middle of the own goal",
    "their_goal": "from the ball to the middle of the adversary's goal",
    "adversary_behind": "cosine between that adversary's way to the ball and the ball's way to the own goal",
    "mate_x": "that team-mate along the pitch",
    "mate_y": "that team-mate across the pitch",
    "mate_behind": "cosine between that team-mate's way to the ball and the ball's way to the adversary's goal",
    "off_line": "from the robot to the straight line through the ball and the middle of the own goal",
    "along_line": "how far along that line it is, from the ball (0) to the own goal (1)",
    "home": "from the robot to the middle of the own goal",
    "adversary_x": "that adversary along the pitch",
    "to_own_line": "seconds until the ball, as it rolls, is at the own goal line; 9 if it does not roll there",
    "to_their_line": "the same of the adversary's goal line",
}


class Sights(Table):
    """One moment of one robot: what it saw, and what V did after it.

    V is the chance to score soon, less that of the adversary (table values). There is a row for each decision that
    a player logged (table decisions, ``chosen``). If grams.watched_s is set, there is also one for each robot of the
    other teams at each such time of play at which it was in a situation. Sorted by team, robot, t_ns.
    """

    NAME: ClassVar[str] = "sights"
    VERSION: ClassVar[int] = 2

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(description="the robot's number")
    t_ns = dy.Int64(description="time of the decision or the moment", metadata=unit("ns"))
    role = dy.Enum(ROLES, description="the robot's role then: at a decision, or at the start of the situation")
    code = dy.Int16(nullable=True, min=1, max=194, description="code of the situation that it was seen in; null at a decision")
    sight = dy.Array(dy.Float32(nullable=True), len(SIGHT), description="what it saw: schemas.sights.SIGHT, in that order; null where it is not known")
    change = dy.Float64(nullable=True, min=-2, max=2, description=(
        "V a second later (setting grams.ahead_s) less V then; 1 or -1 in place of the later V if a goal for or "
        "against ends play before; null where V is not known"
    ))
