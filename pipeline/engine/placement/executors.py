"""Executors of tasks."""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from pathlib import Path
from typing import ParamSpec, Protocol, TypeVar

from pitchlore.pipeline.base.system import cores

P = ParamSpec("P")
R = TypeVar("R")


class Executors(Protocol):
    """Executors of tasks; several threads may hand them tasks at once."""

    @property
    def width(self) -> int:
        """Number of pieces that are done at once; more of them wait."""

    def for_pieces(self, count: int) -> Executors:
        """Executors of so many pieces of work, which are given one after the other or at once."""

    def path(self, path: Path) -> Path:
        """A path of this process as the workers name it."""

    def run(self, work: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> R:
        """Do a piece of work, and wait for its result.

        Args:
            work: a function of a module; the function, its arguments and its result must be picklable.
            arguments: positional arguments of the function.
            named: named arguments of the function.

        Raises:
            WorkerLost: if the worker that did it was lost.
            Exception: whatever the work raised.
        """


class Here:
    """The threads of this process: each piece of work is done by the one that gives it.

    Args:
        width: number of threads that are to give work at once.
    """

    def __init__(self, width: int) -> None:
        self.width = width

    def for_pieces(self, count: int) -> Executors:
        """The same."""
        return self

    def path(self, path: Path) -> Path:
        """The same."""
        return path

    def run(self, work: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> R:
        """Do a piece of work."""
        return work(*arguments, **named)


#: The executors of the flow that runs.
executors: ContextVar[Executors] = ContextVar("executors", default=Here(cores()))  # noqa: B039 (nobody changes it)
