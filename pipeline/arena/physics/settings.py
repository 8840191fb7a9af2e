"""Physics of the arena: the numbers, their units and where they come from.

Where the sources disagree (DECISIONS.md, "The arena") a measurement beats a simulator's setting.
"""

from __future__ import annotations

from pydantic import Field

from pipeline.settings import Frozen

#: Standard gravity, m/s².
GRAVITY = 9.80665


class PhysicsSettings(Frozen):
    """Motion of bodies; the defaults are those of a VSSS match.

    Pymunk multiplies the restitutions (and frictions) of the two that touch. Here the ball's is 1, so
    those of walls and robots are what the ball meets; two robots meet with ``robot_restitution`` squared.
    The ball touches without friction and does not turn about the vertical.

    Attributes:
        hz: frames a second; cameras of the league give 60 (MIROSOT'96 winner, Warwick).
        substeps: equal steps that a frame is made of. With 2 a ball of 6 m/s goes 5 cm a step, less than
            half a robot and its own radius, so it cannot pass through; 0.4 s after a kick it is 2 mm
            (median) from where 64 steps take it. What touches is noticed once it overlaps, up to a step's
            way: a ball that is pressed into a wall was seen 12.1 mm in it (it has 21.35 to its middle), a
            robot's corner 9.9. The tests' bounds are 16 and 15 mm (the latter is a step's way of the corner
            of a robot that spins, 1.8 m/s); a ball is over 5 mm in one frame of 700 between static teams, of
            20,000 between random ones (data/studies/world). With 4 steps it is half as deep, in up to 1.6
            times the time; more ``iterations`` or ``stiffness`` do not change it.
        iterations: of the solver of contacts, a step.
        slop: metres that touching bodies may overlap, which keeps them in touch.
        stiffness: part of the overlap beyond it that is removed in a sixtieth of a second.
        wheel_speed: top speed of a wheel's rim, m/s. rSim's 440 rpm of 26 mm radius; TraveSim has 1.7.
        wheel_acceleration: most that a rim's speed changes, m/s². Less than the floor gives
            (``forward_grip``: 7.8 m/s²), so that wheels slip when pushed or turned too hard, not in every
            start; 90 % of the forward accelerations in the rSim sample are below 5.5. TraveSim's 16 is
            twice what the floor gives.
        axle: metres from wheel to wheel (TraveSim).
        robot_mass: kilograms (TraveSim's model of a real robot; rSim's weighs 0.15 with its wheels).
        ball_mass: kilograms (rules: a golf ball).
        forward_grip: friction of a wheel on the floor along its rolling direction, as a part of its load
            (rSim; on an inclined plane its authors measured 0.84, the mean of 14).
        sideways_grip: the same across it (rSim).
        rolling: deceleration of the ball, m/s². Mean over five runs of a golf ball filmed on a robot-soccer
            field (0.22 to 0.53, fitted to the times in Robotex 2011). FIRASim's 0.06 g is 0.59, the
            ball of the rSim sample loses 0.14.
        wall_restitution: speed of the ball off a wall over that on to it, once it rolls again. FIRASim
            has 0.5, TraveSim 0.9 before the ball's forward spin slows it: a sphere that keeps its spin in a
            bounce of e is left with (e - 0.4) / 1.4, and one that loses it with e / 1.4: 0.36 to 0.64. In
            the rSim sample it is 0.28.
        robot_restitution: the same off a robot. A struck ball starts without spin and keeps 5/7 of its
            speed when it rolls: with golf's bounce of 0.8 and the two masses, as if struck with 0.3.
        friction: of robots at robots and at walls; an estimate for plastic on plastic or painted wood
            (TraveSim gives the body 0.1).
    """

    hz: float = Field(default=60.0, gt=0)
    substeps: int = Field(default=2, ge=1)
    iterations: int = Field(default=10, ge=1)
    slop: float = Field(default=0.0005, ge=0)
    stiffness: float = Field(default=0.3, gt=0, lt=1)
    wheel_speed: float = Field(default=1.2, gt=0)
    wheel_acceleration: float = Field(default=6.0, gt=0)
    axle: float = Field(default=0.071, gt=0)
    robot_mass: float = Field(default=0.18, gt=0)
    ball_mass: float = Field(default=0.046, gt=0)
    forward_grip: float = Field(default=0.8, gt=0)
    sideways_grip: float = Field(default=1.0, gt=0)
    rolling: float = Field(default=0.34, ge=0)
    wall_restitution: float = Field(default=0.5, ge=0, le=1)
    robot_restitution: float = Field(default=0.3, ge=0, le=1)
    friction: float = Field(default=0.2, ge=0)
