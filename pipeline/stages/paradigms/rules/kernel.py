"""Compiled functions of a step of learning, and a compiled choice between several of them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any, TypeVar, cast

from pitchlore.pipeline.numbers.kernels import njit

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {
    "cache": True, "nogil": True, "error_model": "numpy", "forceinline": True, "_nrt": False
}


def kernel(function: F) -> F:
    """Compiled form of a function that is called millions of times and owns no arrays.

    LLVM inlines it, and numba does not count references to array arguments, which took three quarters of the
    time of a step of learning. A function that allocates or returns an array cannot be compiled so.
    """
    return njit(**_OPTIONS)(function)


def switch(name: str, functions: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """Kernel ``name(number, …)`` that calls ``functions[number]`` with its other arguments.

    numba inlines a function only if the source calls it by name; through a tuple of functions it calls by
    pointer, which made IQ-learning 1.4 times as slow. So the source is generated. It is compiled under the
    name of this file, beside which numba looks for its cache.

    Args:
        name: name of the kernel, unlike all others made here.
        functions: kernels with equal parameters; one kernel may stand at several numbers.
    """
    parameters = ", ".join(inspect.signature(functions[0]).parameters)
    scope: dict[str, Any] = {"__name__": __name__}
    lines = [f"def {name}(number, {parameters}):"]
    for place, function in enumerate(dict.fromkeys(functions)):
        scope[f"function_{place}"] = function
        numbers = [f"number == {number}" for number, other in enumerate(functions) if other is function]
        lines += [f"    if {' or '.join(numbers)}:", f"        return function_{place}({parameters})"]
    lines.append(f"    return function_0({parameters})")  # never reached; gives every path one type
    exec(compile("\n".join(lines), __file__, "exec"), scope)  # noqa: S102 - made of the names above alone
    return kernel(cast("Callable[..., Any]", scope[name]))
