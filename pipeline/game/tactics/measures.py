"""Lengths, speeds and times that teams decide by, as plain floats for numba."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.game.bodies import Records
from pitchlore.pipeline.game.pitch import SCALES, Pitch

#: A robot's half-length on the VSSS pitch, metres; lengths of tactics are stretched from there.
_VSSS_RADIUS = 0.0375
_VSSS_LENGTH = 1.5


class Measures(NamedTuple):
    """A pitch, its robots and the clock, as a team sees them; metres, m/s, radians, seconds.

    Attributes:
        goal_x: each goal line from the centre.
        half_width: each side line from the centre.
        half_goal: half the goal's width.
        area_depth: how far the goal area reaches into the pitch.
        area_half_width: half the goal area's width.
        contact: robot centre to ball centre when they touch, at most.
        touch: the same when the ball lies in the middle of the robot's face.
        radius: radius of a robot.
        close: crossing of the fuzzy distances CLOSE and NEAR.
        near: crossing of NEAR and FAR.
        far: crossing of FAR and VERY_FAR.
        moving: a body at least so fast is not EQUAL in speed to a standing one.
        fast: a ball at least so fast is MUCH_FASTER than a standing body.
        top: greatest speed of a wheel.
        axle: between the wheels.
        gain: turn rate asked for per radian of error in heading, 1/s.
        arrival: speed asked for per metre that is left to a place to stop at, 1/s.
        frame_s: between two calls of a player.
    """

    goal_x: float
    half_width: float
    half_goal: float
    area_depth: float
    area_half_width: float
    contact: float
    touch: float
    radius: float
    close: float
    near: float
    far: float
    moving: float
    fast: float
    top: float
    axle: float
    gain: float
    arrival: float
    frame_s: float

    def packed(self) -> Records:
        """One record of all fields, shape [1]: numba takes it in a fifth of the time of a tuple."""
        return np.array([tuple(self)], dtype=[(name, np.float64) for name in self._fields])

    @classmethod
    def of(cls, pitch: Pitch, *, top: float, axle: float, acceleration: float, frame_s: float) -> Measures:
        """The measures of a pitch and of robots that can do so much.

        The goal area of a VSSS pitch, 0.15 m deep and 0.70 m wide, grows with the pitch's length. The
        gains are the greatest that neither the wheels (a turn or a run that slows down in proportion to
        what is left of it brakes by its gain squared times that) nor the clock (a quarter of the error
        a frame) forbid; the wheels are reckoned for a turn of half a circle and a run of a tenth of a
        metre on the VSSS pitch.

        Args:
            pitch: where they play.
            top: greatest speed of a wheel, m/s, more than 0 as all that follow.
            axle: between the wheels, metres.
            acceleration: greatest of a wheel, m/s².
            frame_s: between two calls of a player, seconds.
        """
        scales = SCALES[pitch.kind]
        quick = 0.25 / frame_s
        stretch = scales.robot_radius / _VSSS_RADIUS
        return cls(
            goal_x=pitch.goal_x, half_width=pitch.width / 2, half_goal=pitch.goal_width / 2,
            area_depth=0.15 / _VSSS_LENGTH * pitch.length,
            area_half_width=pitch.goal_width / 2 + 0.15 / _VSSS_LENGTH * pitch.length,
            contact=scales.contact, touch=scales.robot_radius + scales.ball_radius,
            radius=scales.robot_radius,
            close=scales.close, near=scales.near, far=scales.far,
            moving=0.075 * scales.speed, fast=0.5 * scales.speed,
            top=top, axle=axle,
            gain=min(quick, math.sqrt(2 * acceleration / axle / math.pi)),
            arrival=min(quick, math.sqrt(acceleration / (0.1 * stretch))),
            frame_s=frame_s,
        )
