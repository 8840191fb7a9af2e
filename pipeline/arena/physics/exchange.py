"""State out of pymunk and forces into it: in one call by its batch interface, or body by body.

Both ways give the same bytes. Pymunk calls the first experimental; the second stands in for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import pymunk
from pymunk import batch
from pymunk._chipmunk import ffi, lib

from pipeline.bodies import COLUMNS, F64, OMEGA, THETA, VX, VY, X, Y

_STATE = (
    batch.BodyFields.POSITION | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY | batch.BodyFields.ANGULAR_VELOCITY
)  # fmt: skip
_FORCES = batch.BodyFields.FORCE | batch.BodyFields.TORQUE
_GET = ffi.addressof(lib, "pmSpaceBodyGetIteratorFuncBatched")
_SET = ffi.addressof(lib, "pmSpaceBodySetIteratorFuncBatched")


class Exchange(Protocol):
    """Arrays for the bodies of a space, one row for each body in the order of their addition.

    Attributes:
        state: float64 [at least bodies, 6], columns of ``pipeline.bodies``, THETA not wrapped.
        forces: float64 [at least bodies, 3], see ``pipeline.arena.physics.drive``.
    """

    state: F64
    forces: F64

    def attach(self, space: pymunk.Space, bodies: Sequence[pymunk.Body]) -> None:
        """Serve this space from now on, and take its state. It must have the same number of bodies."""

    def take(self) -> None:
        """Bring ``state`` up to date."""

    def give(self) -> None:
        """Let ``forces`` act in the next step of the space; pymunk forgets them after it."""


class ByBatch:
    """By pymunk's batch interface, which walks through all bodies of a space, its static one last.

    Its functions pack their arguments anew at each call, which takes longer than the walk. Here the
    arguments are packed once, and the walk is called directly, as those functions call it.
    """

    def __init__(self, count: int) -> None:
        self._out, self._in = batch.Buffer(), batch.Buffer()
        self.state: F64 = np.zeros((1 + count, COLUMNS))
        self.forces: F64 = np.zeros((1 + count, 3))
        self._in.set_float_buf(self.forces)
        self._asked, self._given = _packed(_STATE, self._out), _packed(_FORCES, self._in)

    def attach(self, space: pymunk.Space, bodies: Sequence[pymunk.Body]) -> None:  # noqa: D102
        self._space = space  # it lives as long as this
        self.take()
        # Pymunk's own memory: it has found its size in the first filling and stays where it is. An
        # array of ours pymunk would free and allocate anew when the last of its room is used.
        self.state = np.frombuffer(self._out.float_buf(), dtype=np.float64).reshape(-1, COLUMNS)

    def take(self) -> None:  # noqa: D102
        self._asked.floatArray.num = 0
        lib.cpSpaceEachBody(self._space._space, _GET, self._asked)

    def give(self) -> None:  # noqa: D102
        self._given.floatArray.num = 0
        lib.cpSpaceEachBody(self._space._space, _SET, self._given)


def _packed(fields: batch.BodyFields, buffer: batch.Buffer) -> Any:
    """The argument of pymunk's walk, as in ``batch.get_space_bodies``."""
    packed = ffi.new("pmBatchedData *")
    packed.fields, packed.floatArray, packed.intArray = fields.value, buffer._float_arr, buffer._int_arr
    return packed


class ByAttribute:
    """Body by body, by pymunk's attributes."""

    def __init__(self, count: int) -> None:
        self.state: F64 = np.zeros((count, COLUMNS))
        self.forces: F64 = np.zeros((count, 3))

    def attach(self, space: pymunk.Space, bodies: Sequence[pymunk.Body]) -> None:  # noqa: D102
        self._bodies = bodies
        self.take()

    def take(self) -> None:  # noqa: D102
        for row, body in zip(self.state, self._bodies, strict=True):
            row[X], row[Y] = body.position
            row[THETA] = body.angle
            row[VX], row[VY] = body.velocity
            row[OMEGA] = body.angular_velocity

    def give(self) -> None:  # noqa: D102
        for (fx, fy, torque), body in zip(self.forces.tolist(), self._bodies, strict=True):
            body.force, body.torque = (fx, fy), torque
