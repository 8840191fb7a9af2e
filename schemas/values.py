"""Values: how likely each team is to score soon, and what each situation changes of it."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import SIDES, Table, match_id, unit

#: The features of a moment, by name, with their meanings; seen by a team that attacks +x. The first
#: :data:`NAMED` are those of the logistic model.
FEATURES: dict[str, str] = {
    "ball_x": "the ball along the pitch, towards the adversary's goal, in half pitches",
    "ball_y": "the ball's distance from the line between the goals, in half widths",
    "goal_distance": "the ball to the middle of the adversary's goal, in lengths of the pitch",
    "goal_angle": "angle at which the ball sees the adversary's goal, rad",
    "ball_vx": "velocity of the ball towards the adversary's goal line, in top speeds of the league",
    "ball_speed": "speed of the ball, in top speeds",
    "on_target": "exp(-t) if the ball rolls straight into the adversary's goal within t seconds, else 0",
    "against_target": "the same for the own goal",
    "own_distance": "the nearest own robot to the ball, in the league's NEAR, at most 5",
    "their_distance": "the same of the adversary",
    "own_behind": "cosine between that own robot's way to the ball and the ball's way to the adversary's goal",
    "their_behind": "the same of the adversary",
    "own_goal_distance": "the ball to the middle of the own goal, in lengths of the pitch",
    "own_goal_angle": "angle at which the ball sees the own goal, rad",
    "ball_vy": "velocity of the ball towards the line between the goals, in top speeds",
    "cover": "least distance of an adversary from the line between ball and its goal, in half goals, at most 3",
    "own_cover": "the same of the own robots and the own goal",
    "keeper": "the adversary nearest to its goal, in half goals, at most 5",
    "own_keeper": "the same of the own robots and the own goal",
    "own_closing": "speed at which the nearest own robot comes nearer to the ball, in top speeds",
    "their_closing": "the same of the adversary",
    "own_heading": "cosine between that own robot's heading and its way to the adversary's goal",
    "their_heading": "the same of the adversary and the own goal",
    "own_second": "the second nearest own robot to the ball, as own_distance",
    "their_second": "the same of the adversary",
    "own_ahead": "share of the own robots that are nearer to the adversary's goal line than the ball",
    "their_ahead": "share of the adversaries that are nearer to the own goal line than the ball",
}
#: Number of features of the logistic model.
NAMED = 12


class Moments(Table):
    """A moment of play as one team sees it: features, and whether that team scores soon.

    Two rows a moment. Sorted by team (home, away), t_ns.
    """

    NAME: ClassVar[str] = "moments"
    VERSION: ClassVar[int] = 1
    PUBLIC: ClassVar[bool] = False

    match_id = match_id()
    team = dy.Enum(SIDES, description="team whose point of view it is")
    t_ns = dy.Int64(description="time of the sample", metadata=unit("ns"))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")
    features = dy.Array(dy.Float32(nullable=True), len(FEATURES), description="schemas.values.FEATURES, in that order")
    scores = dy.Bool(nullable=True, description=(
        "whether the team scores within the horizon and before play stops; null where the recording breaks off first"
    ))


class Values(Table):
    """How likely the teams are to score soon at a moment of play. Sorted by t_ns.

    A match's own goals have no part in its values but for two numbers, slope and offset of the calibration:
    the models are of other matches, of other minutes where there are few matches, or shipped.
    """

    NAME: ClassVar[str] = "values"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    t_ns = dy.Int64(description="time of the sample", metadata=unit("ns"))
    segment = dy.Int32(min=0, description="stretch of uninterrupted play that it lies in")
    home = dy.Float64(min=0, max=1, description="probability that home scores within the horizon (settings of the stage models) and before play stops")
    away = dy.Float64(min=0, max=1, description="the same for away")
    value = dy.Float64(min=-1, max=1, description="value of the moment to home: home minus away; to away, minus that")


class Worths(Table):
    """V before and after a situation, as its team sees it, and what it changed, goals included.

    One row a situation, in the order of the table situations.
    """

    NAME: ClassVar[str] = "worths"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    team = dy.Enum(SIDES, description="team of the robot")
    robot = dy.Int16(description="the robot's number")
    start_ns = dy.Int64(description="start of the situation, inclusive", metadata=unit("ns"))
    before = dy.Float64(nullable=True, min=-1, max=1, description="V of its team at the start; null where V is not known")
    after = dy.Float64(nullable=True, min=-1, max=1, description=(
        "V of its team at the end; 1 or -1 if the situation ends with a goal for or against; null where not known"
    ))
    change = dy.Float64(min=-2, max=2, description="after minus before; 0 where V is not known")
    x = dy.Float32(nullable=True, description="the robot's place at the start, along the pitch, its team attacks +x", metadata=unit("m"))
    y = dy.Float32(nullable=True, description="the same across the pitch, to the left of +x", metadata=unit("m"))
