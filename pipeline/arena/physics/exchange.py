"""Steps of a pymunk space, with forces into it and state out of it, without Python in between.

State and forces go by pymunk's batch interface, which it calls experimental. Its functions and Chipmunk's are
called by their addresses from compiled code.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pymunk
from llvmlite import binding
from numba import types
from pymunk import batch
from pymunk._chipmunk import ffi, lib

from pitchlore.pipeline.arena.physics.drive import FX, TORQUE, drive, publish
from pitchlore.pipeline.game.bodies import COLUMNS
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.numbers.kernels import njit

_STATE = (
    batch.BodyFields.POSITION | batch.BodyFields.ANGLE
    | batch.BodyFields.VELOCITY | batch.BodyFields.ANGULAR_VELOCITY
)  # fmt: skip
_FORCES = batch.BodyFields.FORCE | batch.BodyFields.TORQUE

#: Entries of the addresses.
_SPACE, _GET, _ASKED, _SET, _GIVEN = range(5)
#: Where pymunk counts the numbers that went out and came in.
_OUT, _IN = 0, ffi.sizeof("pmFloatArray") // ffi.sizeof("int")


def _address(thing: Any) -> int:
    return int(ffi.cast("uintptr_t", thing))


def _compiled(name: str, *arguments: types.Type) -> Any:
    """A function of Chipmunk that returns nothing, for compiled code; its pointers are numbers."""
    binding.add_symbol(name, _address(ffi.addressof(lib, name)))  # type: ignore[no-untyped-call]
    return types.ExternalFunction(name, types.void(*arguments))


_each_body = _compiled("cpSpaceEachBody", types.int64, types.int64, types.int64)
_step = _compiled("cpSpaceStep", types.int64, types.float64)


class Exchange:
    """Arrays for the bodies of a space, one row for each body in the order of their addition.

    Pymunk walks through all bodies of a space, its static one last. The walk's arguments are packed once.

    Attributes:
        state: float64 [1 + bodies, 6], columns of ``pipeline.game.bodies``, THETA not wrapped.
        forces: float64 [1 + bodies, 3], see ``pipeline.arena.physics.drive``.
    """

    def __init__(self, count: int) -> None:
        # A row more than needed: pymunk frees an array, and allocates another, when its room is used up.
        room = np.zeros((2 + count, COLUMNS)), np.zeros((2 + count, TORQUE - FX + 1))
        self.state: F64 = room[0][:-1]
        self.forces: F64 = room[1][:-1]
        self._floats = ffi.new("pmFloatArray[2]")
        for floats, array in zip(self._floats, room, strict=True):
            floats.max, floats.arr = array.size, ffi.cast("double *", array.ctypes.data)
        self._counts: npt.NDArray[np.int32] = np.frombuffer(ffi.buffer(self._floats), dtype=np.int32)
        self._ints = ffi.new("pmIntArray *")  # none of the fields is a whole number
        self._walks = [ffi.new("pmBatchedData *") for _ in room]
        for walk, floats, fields in zip(self._walks, self._floats, (_STATE, _FORCES), strict=True):
            walk.floatArray, walk.intArray, walk.fields = ffi.addressof(floats), self._ints, fields.value
        self._addresses: I64 = np.zeros(5, dtype=np.int64)
        self._addresses[[_ASKED, _GIVEN]] = [_address(walk) for walk in self._walks]
        self._addresses[_GET] = _address(ffi.addressof(lib, "pmSpaceBodyGetIteratorFuncBatched"))
        self._addresses[_SET] = _address(ffi.addressof(lib, "pmSpaceBodySetIteratorFuncBatched"))

    def attach(self, space: pymunk.Space) -> None:
        """Serve this space from now on, and take its state. It must have the same number of bodies."""
        self._space = space  # it lives as long as this
        self._addresses[_SPACE] = _address(space._space)
        _take(self._addresses, self._counts)

    def advance(self, steps: int, step_s: float, wheels: F64, rims: F64, of: F64, bodies: F64) -> bool:
        """Drive the robots for some steps, and publish the state of the bodies after them.

        Args:
            steps: number of steps.
            step_s: length of each, seconds.
            wheels: float64 [2 N, 2], commanded left and right rim speeds, m/s.
            rims: float64 [2 N, 2], the speeds that rims have; changed.
            of: float64 [10], see ``pipeline.arena.physics.drive.constants``.
            bodies: float64 [bodies, 6], written.

        Returns:
            False, and nothing has moved, if a command is missing or not a finite number.
        """
        return _advance(
            self._addresses, self._counts, self.state, self.forces, steps, step_s, wheels, rims, of, bodies)


@njit(cache=True, nogil=True)
def _take(addresses: I64, counts: npt.NDArray[np.int32]) -> None:
    """Bring the state up to date."""
    counts[_OUT] = 0
    _each_body(addresses[_SPACE], addresses[_GET], addresses[_ASKED])


@njit(cache=True, nogil=True)
def _advance(
    addresses: I64, counts: npt.NDArray[np.int32], state: F64, forces: F64, steps: int, step_s: float,
    wheels: F64, rims: F64, of: F64, bodies: F64,
) -> bool:
    for _ in range(steps):
        if not drive(state, wheels, rims, of, forces):
            return False
        counts[_IN] = 0
        _each_body(addresses[_SPACE], addresses[_SET], addresses[_GIVEN])  # forces act in one step
        # Always as long: with another length pymunk would take back more of a contact's last
        # impulse than it has given, and bodies would gain energy.
        _step(addresses[_SPACE], step_s)
        _take(addresses, counts)
    publish(state, bodies)
    return True
