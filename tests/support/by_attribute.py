"""Steps with state and forces body by body, by pymunk's attributes and its own step: what ours must equal."""

from collections.abc import Callable

import numpy as np
import pymunk

from pitchlore.pipeline.arena.physics.arena import Arena
from pitchlore.pipeline.arena.physics.drive import drive, publish
from pitchlore.pipeline.game.bodies import COLUMNS, OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.pitch import Pitch


class ByAttribute:
    """In place of ``pipeline.arena.physics.exchange.Exchange``."""

    def __init__(self, count: int) -> None:
        self.state = np.zeros((count, COLUMNS))
        self.forces = np.zeros((count, 3))

    def attach(self, space: pymunk.Space) -> None:
        self._space, self._bodies = space, space.bodies
        self._take()

    def advance(self, steps, step_s, wheels, rims, of, bodies) -> bool:
        for _ in range(steps):
            if not drive(self.state, wheels, rims, of, self.forces):
                return False
            self._give()
            self._space.step(step_s)
            self._take()
        publish(self.state, bodies)
        return True

    def _take(self) -> None:
        for row, body in zip(self.state, self._bodies, strict=True):
            row[X], row[Y] = body.position
            row[THETA] = body.angle
            row[VX], row[VY] = body.velocity
            row[OMEGA] = body.angular_velocity

    def _give(self) -> None:
        for (fx, fy, torque), body in zip(self.forces.tolist(), self._bodies, strict=True):
            body.force, body.torque = (fx, fy), torque


def body_by_body(pitch: Pitch, robots: int) -> Arena:
    """An arena that exchanges state body by body: the same bytes, slower."""
    arena = Arena(pitch, robots)
    arena._exchange = ByAttribute(len(arena.bodies))
    arena.place(arena.bodies.copy())
    return arena


def pymunk_alone(pitch: Pitch, frames: int) -> Callable[[], None]:
    """The steps of so many frames in an arena's space, with no floor, nobody who drives and nobody who looks."""
    arena = Arena(pitch, 3)
    bodies = arena.bodies.copy()
    bodies[:, VX:] = np.random.default_rng(1).uniform(-1, 1, (7, 3))
    arena.place(bodies)
    step, step_s = arena._space.step, arena._step_s

    def go() -> None:
        for _ in range(frames * arena.settings.substeps):
            step(step_s)

    return go
