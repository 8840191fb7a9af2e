"""SplitMix64 random numbers: the state is an array, which numba takes in 0.2 µs; a Generator takes 7 µs.

A team's frame takes less than a microsecond, so a Generator in each call would be most of a match's time.
Source: Steele, Lea and Flood 2014, doi:10.1145/2660193.2660195.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from pitchlore.pipeline.numbers.kernels import njit

#: State of a stream, uint64 [1]; every draw changes it.
SplitMix = npt.NDArray[np.uint64]

_STEP = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_A, _B, _C, _UNUSED = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


def seeded(rng: Generator) -> SplitMix:
    """A state that one draw of ``rng`` decides."""
    return rng.integers(2**64, size=1, dtype=np.uint64)


@njit(cache=True, nogil=True, error_model="numpy")
def bits(splitmix: SplitMix) -> np.uint64:
    """64 random bits."""
    splitmix[0] += _STEP
    z = splitmix[0]
    z = (z ^ (z >> _A)) * _FIRST
    z = (z ^ (z >> _B)) * _SECOND
    return np.uint64(z ^ (z >> _C))


@njit(cache=True, nogil=True, error_model="numpy")
def uniform(splitmix: SplitMix) -> float:
    """A number in [0, 1), a multiple of 2^-53."""
    return float(bits(splitmix) >> _UNUSED) * 2.0**-53


@njit(cache=True, nogil=True, error_model="numpy")
def normal(splitmix: SplitMix) -> float:
    """A number of mean 0 and variance 1, normally distributed (Box and Muller 1958)."""
    radius = math.sqrt(-2.0 * math.log(1.0 - uniform(splitmix)))
    return radius * math.cos(2.0 * math.pi * uniform(splitmix))
