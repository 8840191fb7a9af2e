"""How the small functions that a step of learning is made of are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {
    "cache": True, "nogil": True, "error_model": "numpy", "forceinline": True, "_nrt": False
}


def kernel(function: F) -> F:
    """Compile a function that is called millions of times and owns no arrays.

    LLVM inlines it, and numba does not count references to array arguments, which took three quarters
    of the time of a step of learning. A function that allocates or returns an array cannot be compiled so.
    """
    return cast("F", njit(**_OPTIONS)(function))
