"""The arena: a pitch with walls, two teams of square robots on two wheels, and a ball, in pymunk."""

from __future__ import annotations

import math

import numpy as np
import pymunk

from pitchlore.pipeline.arena.physics.drive import constants, publish, roll
from pitchlore.pipeline.arena.physics.exchange import Exchange
from pitchlore.pipeline.arena.physics.settings import PhysicsSettings
from pitchlore.pipeline.arena.physics.walls import walls
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import BALL, COLUMNS, THETA, X, Y
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.numbers.arrays import F64


class Arena:
    """N against N robots and a ball that move a frame at a time.

    After ``place``, motion depends only on the placed bodies and the commands since. The same bodies and
    wheels give the same bytes in every arena with the same settings.

    Args:
        pitch: its walls, goals and, by its kind, the sizes of robots and ball.
        robots: N, robots a side.
        settings: physics.

    Attributes:
        bodies: float64 [1 + 2 N, 6] of ``pipeline.game.bodies``, the same array always; THETA in (-pi, pi].
            At first all are at rest, teams in line at the middle of their halves, facing each other.

    Raises:
        BadSettings: if there is not at least one robot a side.
    """

    def __init__(self, pitch: Pitch, robots: int, settings: PhysicsSettings | None = None) -> None:
        if robots < 1:
            raise BadSettings(
                f"an arena needs at least one robot a side, not {robots}", where="robots",
                next_step="Ask for 1 or more",
            )
        self.pitch = pitch
        self.robots = robots
        self.settings = settings or PhysicsSettings()
        count = 1 + 2 * robots
        self._exchange = Exchange(count)
        self._box = (2 * SCALES[pitch.kind].robot_radius,) * 2
        self._moment = pymunk.moment_for_box(self.settings.robot_mass, self._box)
        self._constants = constants(self.settings, self._moment)
        self._substeps = self.settings.substeps
        self._step_s = 1 / (self.settings.hz * self._substeps)
        self._rims = np.zeros((2 * robots, 2))
        self.bodies: F64 = np.zeros((count, COLUMNS))
        self.place(self._line_up())

    def place(self, bodies: F64) -> None:
        """Give all bodies new places and velocities.

        Wheels turn as the robots move. Bodies that overlap are pushed apart in the next frames. The ball's
        THETA and OMEGA become 0.

        Args:
            bodies: float64 [1 + 2 N, 6], copied.

        Raises:
            BadSettings: if the shape is another, or a number is not finite.
        """
        if bodies.shape != self.bodies.shape or not np.isfinite(bodies).all():
            raise BadSettings(
                f"bodies must be finite numbers of shape {self.bodies.shape}, these have {bodies.shape}",
                where="Arena.place", next_step="Give a row each to the ball and to every robot",
            )  # fmt: skip
        # A new space: the old one remembers contacts and the order of its index, which would make
        # the last bits of what follows depend on what was.
        self._space = self._build(bodies)
        self._exchange.attach(self._space)
        publish(self._exchange.state, self.bodies)
        roll(self.bodies, self._constants, self._rims)

    def frame(self, wheels: F64) -> F64:
        """Advance by one frame, ``1 / settings.hz`` seconds.

        Args:
            wheels: float64 [2 N, 2], commanded speeds of the left and right rim, m/s, home's robots first.

        Returns:
            ``bodies``, at the end of the frame.

        Raises:
            BadSettings: if a command is missing or not a finite number; nothing has moved then.
        """
        if not self._exchange.advance(
            self._substeps, self._step_s, wheels, self._rims, self._constants, self.bodies
        ):
            raise BadSettings(
                f"wheel speeds must be finite numbers of shape {self._rims.shape}",
                where="Arena.frame", next_step="Look at what the players command",
            )  # fmt: skip
        return self.bodies

    def _build(self, bodies: F64) -> pymunk.Space:
        """A space with all bodies in it, in order."""
        settings, scales = self.settings, SCALES[self.pitch.kind]
        space = pymunk.Space()
        space.iterations = settings.iterations
        # Contacts that open and close again within three steps would start with the impulse that they ended
        # with, which pymunk then takes back without having given it, and bodies would gain energy.
        space.collision_persistence = 1
        space.collision_slop = settings.slop
        space.collision_bias = (1 - settings.stiffness) ** 60
        for row, (x, y, theta, vx, vy, omega) in enumerate(bodies.tolist()):
            if row == BALL:
                body = pymunk.Body(settings.ball_mass, math.inf)
                shape: pymunk.Shape = pymunk.Circle(body, scales.ball_radius)
                shape.elasticity, shape.friction = 1.0, 0.0
            else:
                body = pymunk.Body(settings.robot_mass, self._moment)
                shape = pymunk.Poly.create_box(body, self._box)
                shape.elasticity, shape.friction = settings.robot_restitution, math.sqrt(settings.friction)
                body.angle, body.angular_velocity = theta, omega
            body.position, body.velocity = (x, y), (vx, vy)
            space.add(body, shape)
        for corners in walls(self.pitch):
            wall = pymunk.Poly(space.static_body, corners)
            wall.elasticity, wall.friction = settings.wall_restitution, math.sqrt(settings.friction)
            space.add(wall)
        return space

    def _line_up(self) -> F64:
        bodies = np.zeros_like(self.bodies)
        across = self.pitch.width * ((np.arange(self.robots) + 1) / (self.robots + 1) - 0.5)
        home, away = bodies[1 : 1 + self.robots], bodies[1 + self.robots :]
        home[:, X], home[:, Y] = -self.pitch.length / 4, across
        away[:, X], away[:, Y], away[:, THETA] = self.pitch.length / 4, -across, math.pi
        return bodies
