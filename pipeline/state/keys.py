"""State keys: the elements of the state that a key keeps, and states as integers.

``full36`` keeps all elements, so a state by any other key is a projection of it.

The 36 elements cannot give the 80,621,568 states that the paper counts: that number is 2^12 3^9, while
eleven elements have three levels. Two keys with fewer elements give it exactly.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.numbers.arrays import I64, U8
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.state.table import (
    AFTER_BALL,
    BALL_DISTANCE,
    BALL_ORIENTATION,
    DIRECTION,
    ELEMENTS,
    GOAL_DISTANCE,
    GOAL_ORIENTATION,
    LEVELS,
    SCORE,
    SITUATION,
    SPEED,
)
from pitchlore.schemas import ROLES
from pitchlore.schemas.table import Key

_GLOBALS = (DIRECTION, SPEED, SCORE, SITUATION)
#: Keys that look at the deciding robot more closely than at the others.
_OF_ONE_ROBOT: tuple[Key, ...] = ("ego19", "self9", "self6")


class KeyDigit(NamedTuple):
    """One digit of an encoded state.

    Attributes:
        element: index in :data:`pipeline.state.table.TABLE`.
        levels: how many values the digit has; with fewer than the element, its last ones fall
            together ("front" or not).
    """

    element: int
    levels: int


def columns(key: Key, slot: int = 0) -> tuple[KeyDigit, ...]:
    """The digits of an encoded state, the most significant first.

    ``full36`` is all of Table 2, ``full35`` all but the score. ``ego19`` keeps distance and position
    of all robots, the orientations of the deciding one (to the ball in two levels), and the four last
    elements; ``team19`` those of the own team, and the four last. These two have 80,621,568 states.
    ``self9`` is the deciding robot (distance and orientation to the ball, orientation to both goals,
    position) and the ball (distance to both goals, direction, speed); ``self6`` is the same without
    the orientation to the own goal and the ball's motion; ``role0`` keeps nothing: one state.

    Args:
        key: name of the kept elements.
        slot: own slot (0, 1, 2) of the deciding robot; only ``ego19``, ``self9`` and ``self6``
            depend on it.
    """
    own_goal = GOAL_ORIENTATION + 2 * slot
    alone = (BALL_DISTANCE + slot, BALL_ORIENTATION + slot, AFTER_BALL + slot)
    ball = (GOAL_DISTANCE, GOAL_DISTANCE + 1)
    if key == "full36":
        return _whole(range(ELEMENTS))
    if key == "full35":
        return _whole(e for e in range(ELEMENTS) if e != SCORE)
    if key == "ego19":
        return (
            *_whole((*range(BALL_DISTANCE, BALL_DISTANCE + 6), *range(AFTER_BALL, AFTER_BALL + 6))),
            KeyDigit(BALL_ORIENTATION + slot, 2),
            *_whole((own_goal, own_goal + 1, *_GLOBALS)),
        )
    if key == "team19":
        own = (
            *range(BALL_DISTANCE, BALL_DISTANCE + 3),
            *range(BALL_ORIENTATION, BALL_ORIENTATION + 3),
            *range(GOAL_ORIENTATION, GOAL_ORIENTATION + 6),
            *range(AFTER_BALL, AFTER_BALL + 3),
        )
        return _whole((*own, *_GLOBALS))
    if key == "self9":
        return _whole((*alone, own_goal, own_goal + 1, *ball, DIRECTION, SPEED))
    if key == "self6":
        return _whole((*alone, own_goal + 1, *ball))
    return ()


def _whole(elements: Iterable[int]) -> tuple[KeyDigit, ...]:
    """Elements with all of their levels."""
    return tuple(KeyDigit(e, int(LEVELS[e])) for e in elements)


class Radix(NamedTuple):
    """The digits of a key for :func:`encode_one`, the most significant first.

    Attributes:
        digits: int64 [D], index of each digit's element.
        levels: int64 [D], number of values of each digit.
    """

    digits: I64
    levels: I64


@cache
def radix(key: Key, slot: int = 0) -> Radix:
    """The digits of a key; shared read-only arrays. Arguments as in :func:`columns`."""
    digits = np.array(columns(key, slot), dtype=np.int64).reshape(-1, 2).T.copy()
    digits.flags.writeable = False
    return Radix(digits[0], digits[1])


@njit(cache=True, nogil=True, error_model="numpy")
def encode_one(elements: U8, by: Radix) -> np.int64:
    """One moment's state as an integer; callable from other kernels.

    Args:
        elements: uint8 [36].
        by: the digits of the key.
    """
    state = np.int64(0)
    for d in range(len(by.digits)):
        state = state * by.levels[d] + min(np.int64(elements[by.digits[d]]), by.levels[d] - 1)
    return state


@njit(cache=True, nogil=True, error_model="numpy")
def _encode_rows(elements: U8, rows: I64, by: Radix, out: I64) -> None:
    for row in rows:
        out[row] = encode_one(elements[row], by)


def encode(elements: U8, key: Key, slot: npt.NDArray[np.integer] | None = None) -> I64:
    """States as integers in mixed radix, the first digit the most significant.

    Args:
        elements: uint8 [K, 36].
        key: name of the kept elements.
        slot: [K], own slot (0, 1, 2) of the deciding robot: the index of its role. Needed by
            ``ego19``, ``self9`` and ``self6`` only.

    Returns:
        int64 [K], below the product of the key's levels.

    Raises:
        BadSettings: if slots are needed and not given.
    """
    states = np.zeros(len(elements), dtype=np.int64)
    if key not in _OF_ONE_ROBOT:
        _encode_rows(elements, np.arange(len(elements)), radix(key), states)
        return states
    if slot is None:
        raise BadSettings(f"state key {key} needs the deciding robot's slot", next_step="Give slot")
    for own in range(len(ROLES)):
        _encode_rows(elements, np.flatnonzero(slot == own), radix(key, own), states)
    return states


def decode(states: I64, key: Key) -> U8:
    """The digits of encoded states, uint8 [K, len(columns(key))]; the inverse of :func:`encode`."""
    digits = np.empty((len(states), len(columns(key))), dtype=np.uint8)
    left = states.copy()
    for i, column in reversed(list(enumerate(columns(key)))):
        left, digits[:, i] = np.divmod(left, column.levels)
    return digits


def project(states: I64, key: Key, slot: npt.NDArray[np.integer] | None = None) -> I64:
    """The same states by a key that keeps fewer elements.

    Args:
        states: int64 [K], by ``full36``.
        key: name of the kept elements.
        slot: as in :func:`encode`.

    Returns:
        int64 [K]: ``encode(elements, key, slot)`` of the elements that were encoded.

    Raises:
        BadSettings: if slots are needed and not given.
    """
    return states if key == "full36" else encode(decode(states, "full36"), key, slot)
