"""Physics of the arena: the numbers, their units and their sources.

If sources disagree, a measurement beats a simulator's setting (docs/decisions/arena.md).
"""

from __future__ import annotations

from pydantic import Field

from pitchlore.pipeline.base.bounds import Amount, Count, Positive
from pitchlore.pipeline.base.toml import Frozen

#: Standard gravity, m/s².
GRAVITY = 9.80665


class PhysicsSettings(Frozen):
    """Motion of bodies; the defaults are those of a VSSS match.

    Pymunk multiplies the restitutions (and frictions) of two bodies that touch. The ball's restitution is 1
    here, so the ball meets walls and robots with theirs; two robots meet with ``robot_restitution`` squared.
    The ball touches without friction and does not turn about the vertical.

    Attributes:
        hz: frames a second; cameras of the league give 60 (MIROSOT'96 winner, Warwick).
        substeps: equal steps of a frame. With 2 steps a ball of 6 m/s moves 5 cm a step, less than half a
            robot plus its own radius, so it cannot pass through a robot. 0.4 s after a kick it is 2 mm
            (median) from its place with 64 steps. Contacts are noticed only when bodies overlap, by up to
            one step's travel. A ball pressed into a wall was seen 14.9 mm inside it (its radius is 21.35),
            a robot's corner 9.9 mm. The tests' bounds are 16 and 15 mm; 15 mm is one step's travel of the
            corner of a spinning robot, 1.8 m/s. A ball is more than 5 mm inside in one frame of 700 between
            static teams, of 20,000 between random ones (data/studies/world). 4 steps halve the overlap and
            take up to 1.6 times as long. More ``iterations`` or ``stiffness`` do not change it.
        iterations: iterations of the contact solver in each step.
        slop: overlap that touching bodies may keep, metres; it keeps them in touch.
        stiffness: share of the overlap beyond ``slop`` that is removed in a sixtieth of a second.
        wheel_speed: top speed of a wheel's rim, m/s. rSim has 440 rpm of 26 mm radius; TraveSim has 1.7.
        wheel_acceleration: greatest change of a rim's speed, m/s². It is below the floor's limit
            (``forward_grip``: 7.8 m/s²), so wheels slip when a robot is pushed or turned too hard, not at
            every start. 90 % of the forward accelerations in the rSim sample are below 5.5. TraveSim's 16
            is twice the floor's limit.
        axle: metres from wheel to wheel (TraveSim).
        robot_mass: kilograms (TraveSim's model of a real robot; rSim's weighs 0.15 with its wheels).
        ball_mass: kilograms (rules: a golf ball).
        forward_grip: friction of a wheel on the floor along its rolling direction, as a share of its load
            (rSim; on an inclined plane its authors measured 0.84, the mean of 14).
        sideways_grip: the same across the rolling direction (rSim).
        rolling: deceleration of the ball, m/s². Mean over five runs of a golf ball filmed on a robot-soccer
            field (0.22 to 0.53, fitted to the times in Robotex 2011). FIRASim's 0.06 g is 0.59; the ball of
            the rSim sample has 0.14.
        wall_restitution: speed of the ball after a wall, once it rolls again, over its speed before. FIRASim
            has 0.5. TraveSim has 0.9 before the ball's forward spin slows it. After a bounce of e a sphere
            that keeps its spin is left with (e - 0.4) / 1.4, and one that loses it with e / 1.4: 0.36 to
            0.64. In the rSim sample it is 0.28.
        robot_restitution: the same for a robot. A struck ball starts without spin and keeps 5/7 of its
            speed when it rolls. With golf's bounce of 0.8 and the two masses, this equals a restitution of
            0.3.
        friction: friction of robots at robots and at walls; an estimate for plastic on plastic or painted
            wood (TraveSim has 0.1 for the body).
    """

    hz: float = Field(default=60.0, ge=1, le=10_000)
    substeps: Count = 2
    iterations: Count = 10
    slop: Amount = 0.0005
    stiffness: float = Field(default=0.3, gt=0, lt=1)
    wheel_speed: Positive = 1.2
    wheel_acceleration: Positive = 6.0
    axle: Positive = 0.071
    robot_mass: Positive = 0.18
    ball_mass: Positive = 0.046
    forward_grip: Positive = 0.8
    sideways_grip: Positive = 1.0
    rolling: Amount = 0.34
    wall_restitution: float = Field(default=0.5, ge=0, le=1)
    robot_restitution: float = Field(default=0.3, ge=0, le=1)
    friction: Amount = 0.2
