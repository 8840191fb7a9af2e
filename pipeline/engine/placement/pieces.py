"""Pieces of work that are given to executors together: a failed piece stops no other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from pitchlore.pipeline.base.errors import WorkerLost, in_one_line
from pitchlore.pipeline.engine.placement.executors import Executors

#: Named arguments of each piece of work, by its label.
Pieces = Mapping[str, Mapping[str, Any]]

#: Parts for each worker, if there is work for them, so that all workers have work to the end.
_PARTS_EACH = 4


class Failure(NamedTuple):
    """Stand-in for the result of a piece of work that has failed.

    Attributes:
        line: the error in one line.
        transient: whether it may help to try again.
    """

    line: str
    transient: bool = False


class TryAgain(Exception):
    """Some pieces of a part have failed, and may succeed if they are tried again."""

    transient = True


class Part:
    """Pieces of work that one worker does, one after the other. What is done is not done again.

    Args:
        executors: executors of the task.
        function: a module's; does a piece. Its result may have ``transient`` as :class:`Failure`, and a
            method ``after`` that makes it one with the result of an earlier try.
        pieces: its named arguments, by label.

    Attributes:
        pieces: as given.
        results: results of the function by label, in place of some a :class:`Failure`.
    """

    def __init__(self, executors: Executors, function: Callable[..., Any], pieces: Pieces) -> None:
        self._executors, self._function, self.pieces = executors, function, pieces
        self.results: dict[str, Any] = {}

    def do(self) -> None:
        """Do the pieces, except those that an earlier try has done.

        Raises:
            TryAgain: if some may succeed later.
            PitchloreError: by which all others would fail, too.
        """
        todo = {label: arguments for label, arguments in self.pieces.items()
                if label not in self.results or _transient(self.results[label])}
        for label, result in self._done(todo).items():
            before = self.results.get(label)
            joined = before is not None and hasattr(result, "after") and not isinstance(before, Failure)
            self.results[label] = result.after(before) if joined else result
        again = [label for label in todo if _transient(self.results[label])]
        if again:
            raise TryAgain("; ".join(f"{label}: {self.results[label]}" for label in again))

    def _done(self, todo: Pieces) -> dict[str, Any]:
        """Results of some pieces. If their worker is lost, each is done by itself, and only one is lost."""
        try:
            return self._executors.run(each, self._function, todo)
        except WorkerLost as error:
            if len(todo) == 1:
                return dict.fromkeys(todo, Failure(str(error)))
        found: dict[str, Any] = {}
        for label, arguments in todo.items():
            found |= self._done({label: arguments})
        return found


def each(function: Callable[..., Any], pieces: Pieces) -> dict[str, Any]:
    """Do pieces of work one after the other; for each its result, or its :class:`Failure`.

    Raises:
        PitchloreError: by which all others would fail, too.
    """
    results: dict[str, Any] = {}
    for label, arguments in pieces.items():
        try:
            results[label] = function(**arguments)
        except Exception as error:
            if getattr(error, "for_all", False):
                raise
            results[label] = Failure(in_one_line(error), getattr(error, "transient", False))
    return results


def parted(pieces: Pieces, at_once: int, width: int) -> Iterator[Pieces]:
    """Pieces of work in parts of at most ``at_once``, for executors of some width."""
    labels = list(pieces)
    size = max(1, min(at_once, len(labels) // (_PARTS_EACH * width)))
    for begin in range(0, len(labels), size):
        yield {label: pieces[label] for label in labels[begin:begin + size]}


def _transient(result: object) -> bool:
    return bool(getattr(result, "transient", False))
