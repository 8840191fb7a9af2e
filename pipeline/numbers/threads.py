"""Fits on one thread: the numbers do not depend on the machine, and small ones take less time."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[Any]:
    """The libraries of numpy and scikit-learn use one thread in the body; whoever fits has loaded both."""
    limited: AbstractContextManager[Any] = _libraries().limit(limits=1)
    return limited


@cache
def _libraries() -> Any:
    """The libraries of this process; to look for them takes 10 ms."""
    return ThreadpoolController()  # type: ignore[no-untyped-call]
