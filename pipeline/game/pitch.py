"""Pitches and leagues: markings, and the lengths and speeds that everything else scales with.

Axes everywhere: metres, origin at the centre, x along the pitch, y to the left of +x,
angles in radians counter-clockwise from +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict, Field


class Kind(StrEnum):
    """A league, which decides sizes and speeds of robots and ball; ``human`` is football."""

    VSSS = "vsss"
    SSL = "ssl"
    SIM2D = "2d"
    HUMAN = "human"


class Pitch(BaseModel):
    """The field of play.

    Attributes:
        kind: the league whose robots play on it.
        length: goal line to goal line, metres.
        width: side line to side line, metres.
        goal_width: post to post, metres.
        goal_depth: goal line to the back of the net, metres.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    kind: Kind
    length: float = Field(ge=0.1, le=1000)
    width: float = Field(ge=0.1, le=1000)
    goal_width: float = Field(ge=0.01, le=1000)
    goal_depth: float = Field(default=0.1, ge=0, le=100)

    @property
    def goal_x(self) -> float:
        """Distance of each goal line from the centre, metres."""
        return self.length / 2


class Markings(NamedTuple):
    """The lines of a league's pitch, metres; the left half is the mirror image of the right one.

    Attributes:
        circle: radius of the centre circle.
        areas: depth and width of the areas before the goal.
        corner: legs of the triangles that cut the corners, 0 without them.
        marks: points in the right half.
    """

    circle: float
    areas: tuple[tuple[float, float], ...]
    corner: float
    marks: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Scales:
    """Lengths and speeds that scale the fuzzy terms of a league (docs/decisions/numbers.md).

    Distances are the 0.5 crossings of the Distance variable, metres.

    Attributes:
        contact: robot centre to ball centre when they touch (2D: when the ball is kickable).
        contact_fade: half the width of the slope around ``contact``.
        body: robot centre to ball centre when the bodies touch. It is less than ``contact`` only where
            robots kick from afar, as in 2D.
        body_fade: half the width of the slope around ``body``.
        close: about two robot lengths, or a quarter of a second of travel.
        near: about half a second of travel.
        far: about half a pitch.
        faces: how many of a robot's sides play the ball: 2 (front and back), 1 (the front), or 0 for all
            around.
        speed: top cruising speed over that of a VSSS robot (1.2 m/s); velocity terms scale by it.
        robot_radius: metres.
        ball_radius: metres.
        max_ball_speed: a ball that moves faster was not moved by anybody, m/s.
        max_robot_speed: the same for a robot, m/s.
        omnidirectional: whether robots drive sideways as well; their course is then their direction of
            motion, else it is where they head or, reversing, the opposite.
        heads_as_it_moves: whether a body whose heading is not known heads where it moves, and, standing,
            where it last moved. People mostly do, and no camera tells where they look.
        reach: height above which nobody plays the ball, metres; only where its height is given.
    """

    contact: float
    contact_fade: float
    body: float
    body_fade: float
    close: float
    near: float
    far: float
    faces: int
    speed: float
    robot_radius: float
    ball_radius: float
    max_ball_speed: float
    max_robot_speed: float
    omnidirectional: bool = False
    heads_as_it_moves: bool = False
    reach: float = math.inf


PITCHES: dict[Kind, Pitch] = {
    Kind.VSSS: Pitch(kind=Kind.VSSS, length=1.5, width=1.3, goal_width=0.4, goal_depth=0.1),
    Kind.SSL: Pitch(kind=Kind.SSL, length=12.0, width=9.0, goal_width=1.8, goal_depth=0.18),
    Kind.SIM2D: Pitch(kind=Kind.SIM2D, length=105.0, width=68.0, goal_width=14.02, goal_depth=2.44),
    Kind.HUMAN: Pitch(kind=Kind.HUMAN, length=105.0, width=68.0, goal_width=7.32, goal_depth=2.0),
}

_FOOTBALL = Markings(9.15, ((16.5, 40.32), (5.5, 18.32)), 0.0, ((41.5, 0.0),))

#: Markings of each league: the one table of all painters, of the arena's laws and of its walls.
MARKINGS: dict[Kind, Markings] = {
    # field_default_3v3.h of VSSReferee; corners by the IEEE Very Small rules 2008
    Kind.VSSS: Markings(0.2, ((0.15, 0.7),), 0.07, ((0.375, 0.0), (0.375, 0.4), (0.375, -0.4))),
    Kind.SSL: Markings(0.5, ((1.8, 3.6),), 0.0, ()),
    Kind.SIM2D: _FOOTBALL,
    Kind.HUMAN: _FOOTBALL,
}

SCALES: dict[Kind, Scales] = {
    Kind.VSSS: Scales(
        contact=0.0775, contact_fade=0.0075, body=0.0775, body_fade=0.0075, close=0.20, near=0.45, far=0.85,
        faces=2, speed=1.0,
        robot_radius=0.0375, ball_radius=0.02135, max_ball_speed=6.0, max_robot_speed=3.0,
    ),
    # robot of 18 cm with a flat front; ball speed is limited to 6.5 m/s by the rules
    Kind.SSL: Scales(
        contact=0.125, contact_fade=0.015, body=0.125, body_fade=0.015, close=0.50, near=1.20, far=6.0,
        faces=1, speed=2.5,
        robot_radius=0.09, ball_radius=0.02135, max_ball_speed=10.0, max_robot_speed=6.0,
        omnidirectional=True,
    ),
    # kickable_margin 0.7 + player 0.3 + ball 0.085; speeds are metres a cycle of 0.1 s
    Kind.SIM2D: Scales(
        contact=1.085, contact_fade=0.10, body=0.41, body_fade=0.02, close=2.5, near=6.0, far=52.5,
        faces=0, speed=8.0,
        robot_radius=0.3, ball_radius=0.085, max_ball_speed=33.0, max_robot_speed=13.0,
    ),
    # a stride and a leg, and the error of cameras, about half a metre; people cruise at 5 m/s and sprint at 9
    Kind.HUMAN: Scales(
        contact=1.5, contact_fade=0.25, body=0.5, body_fade=0.05, close=3.0, near=7.0, far=52.5,
        faces=0, speed=4.0,
        robot_radius=0.5, ball_radius=0.11, max_ball_speed=45.0, max_robot_speed=13.0,
        omnidirectional=True, heads_as_it_moves=True, reach=2.2,
    ),
}
