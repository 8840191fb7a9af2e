"""State out of pymunk and forces into it, in one call by its batch interface, which it calls experimental."""

from __future__ import annotations

from typing import Any

import numpy as np
import pymunk
from pymunk import batch
from pymunk._chipmunk import ffi, lib

from pipeline.arrays import F64
from pipeline.bodies import COLUMNS

_STATE = (
    batch.BodyFields.POSITION | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY | batch.BodyFields.ANGULAR_VELOCITY
)  # fmt: skip
_FORCES = batch.BodyFields.FORCE | batch.BodyFields.TORQUE
_GET = ffi.addressof(lib, "pmSpaceBodyGetIteratorFuncBatched")
_SET = ffi.addressof(lib, "pmSpaceBodySetIteratorFuncBatched")


class Exchange:
    """Arrays for the bodies of a space, one row for each body in the order of their addition.

    Pymunk's batch interface walks through all bodies of a space, its static one last. Its functions pack
    their arguments anew at each call, which takes longer than the walk. Here the arguments are packed once,
    and the walk is called directly, as those functions call it.

    Attributes:
        state: float64 [1 + bodies, 6], columns of ``pipeline.bodies``, THETA not wrapped.
        forces: float64 [1 + bodies, 3], see ``pipeline.arena.physics.drive``.
    """

    def __init__(self, count: int) -> None:
        self._out, self._in = batch.Buffer(), batch.Buffer()
        self.state: F64 = np.zeros((1 + count, COLUMNS))
        self.forces: F64 = np.zeros((1 + count, 3))
        self._in.set_float_buf(self.forces)
        self._asked, self._given = _packed(_STATE, self._out), _packed(_FORCES, self._in)

    def attach(self, space: pymunk.Space) -> None:
        """Serve this space from now on, and take its state. It must have the same number of bodies."""
        self._space = space  # it lives as long as this
        self.take()
        # Pymunk's own memory: it has found its size in the first filling and stays where it is. An
        # array of ours pymunk would free and allocate anew when the last of its room is used.
        self.state = np.frombuffer(self._out.float_buf(), dtype=np.float64).reshape(-1, COLUMNS)

    def take(self) -> None:
        """Bring ``state`` up to date."""
        self._asked.floatArray.num = 0
        lib.cpSpaceEachBody(self._space._space, _GET, self._asked)

    def give(self) -> None:
        """Let ``forces`` act in the next step of the space; pymunk forgets them after it."""
        self._given.floatArray.num = 0
        lib.cpSpaceEachBody(self._space._space, _SET, self._given)


def _packed(fields: batch.BodyFields, buffer: batch.Buffer) -> Any:
    """The argument of pymunk's walk, as in ``batch.get_space_bodies``."""
    packed = ffi.new("pmBatchedData *")
    packed.fields, packed.floatArray, packed.intArray = fields.value, buffer._float_arr, buffer._int_arr
    return packed
