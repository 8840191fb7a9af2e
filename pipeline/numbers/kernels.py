"""Compiled functions: numba's, at less than half the time to compile those that only others call."""

from __future__ import annotations

import gc
from collections.abc import Callable
from functools import cached_property
from types import FunctionType
from typing import Any, TypeVar, cast

from numba import config, types
from numba.core.registry import CPUDispatcher

F = TypeVar("F", bound=Callable[..., Any])

#: A function between two compiled ones needs no form for C.
_CALLED_FROM_PYTHON = {"nopython": True, "boundscheck": None, "no_cfunc_wrapper": True}
#: Nor one for Python, which unpacks Python's objects: for a small function that is half of its machine code.
_CALLED_FROM_COMPILED = {**_CALLED_FROM_PYTHON, "no_cpython_wrapper": True}


def njit(*, cache: bool, **options: Any) -> Callable[[F], F]:
    """Make a :class:`Kernel` of a function, with the options of numba's decorator ``njit``."""

    def compiled(function: F) -> F:
        if config.DISABLE_JIT:  # type: ignore[attr-defined]
            return function
        kernel = Kernel(function, targetoptions=_CALLED_FROM_PYTHON | options)
        if cache:
            kernel.enable_caching()
        return cast("F", kernel)

    return compiled


class Kernel(CPUDispatcher):
    """A compiled function, which has two forms: for calls from Python, and for calls from compiled code.

    Each is compiled and kept when it is first needed, so most functions have one of them. A call from
    compiled code with the number 1 takes the form for all whole numbers; numba would make one more for 1.
    """

    def compile(self, sig: Any) -> Any:
        """Compile as numba does, without Python's collector, which took an eighth of the time."""
        collects = gc.isenabled()
        gc.disable()
        try:
            return super().compile(sig)
        finally:
            if collects:
                gc.enable()

    @cached_property
    def _inner(self) -> Any:
        """The form for compiled code, kept under a name of its own."""
        function = self.py_func
        copy = FunctionType(
            function.__code__, function.__globals__, function.__name__, function.__defaults__,
            function.__closure__)
        copy.__qualname__, copy.__module__ = f"{function.__qualname__}.inner", function.__module__
        inner = CPUDispatcher(copy, targetoptions=self.targetoptions | _CALLED_FROM_COMPILED)
        if self.stats.cache_path:
            inner.enable_caching()
        return inner

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """The signature for a call from compiled code: numba asks for it."""
        plain: Any = types.unliteral
        return self._inner.get_call_template(
            [plain(kind) for kind in args], {name: plain(kind) for name, kind in kws.items()})

    def get_overload(self, sig: Any) -> Any:
        """The compiled form for a signature that :meth:`get_call_template` gave."""
        return self._inner.get_overload(sig)
