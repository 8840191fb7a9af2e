"""Trajectories: every body at every sample."""

from __future__ import annotations

from typing import ClassVar

import dataframely as dy

from pitchlore.schemas.table import BODIES, ROLES, Table, match_id, unit


class Trajectories(Table):
    """One body at one sample; a body that is missing at a sample has no row there.

    Sorted by team (ball, home, away), robot, t_ns. The pitch frame is turned so that the home
    team attacks +x throughout the match.
    """

    NAME: ClassVar[str] = "trajectories"
    VERSION: ClassVar[int] = 1

    match_id = match_id()
    frame = dy.UInt32(description="number of the sample, from 0 in order of time")
    t_ns = dy.Int64(description="time since the first sample", metadata=unit("ns"))
    team = dy.Enum(BODIES, description="team of the robot, or 'ball'")
    robot = dy.Int16(nullable=True, description="the robot's number; null for the ball")
    role = dy.Enum(ROLES, nullable=True, description="role at this sample, by distance to the own goal; null for the ball")
    x = dy.Float32(description="along the pitch, 0 at the centre, home attacks +x", metadata=unit("m"))
    y = dy.Float32(description="across the pitch, to the left of +x", metadata=unit("m"))
    theta = dy.Float32(nullable=True, description="heading, counter-clockwise from +x, in (-pi, pi]", metadata=unit("rad"))
    vx = dy.Float32(nullable=True, description="estimated velocity along x; null where it cannot be estimated", metadata=unit("m/s"))
    vy = dy.Float32(nullable=True, description="estimated velocity along y; null where it cannot be estimated", metadata=unit("m/s"))
    omega = dy.Float32(nullable=True, description="estimated turning rate; null where it cannot be estimated", metadata=unit("rad/s"))
    segment = dy.Int32(nullable=True, min=0, description="stretch of uninterrupted play; null while play is stopped")
    suspect = dy.Bool(description="whether the body jumped implausibly here: kept as logged, not used downstream")
    turned = dy.Bool(description="whether the log's pose was turned by half a turn, because home attacked -x")
