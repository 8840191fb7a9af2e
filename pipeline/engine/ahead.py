"""Work of a run that is begun before its turn, beside other legs, because its inputs are there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from threading import Event, Thread
from typing import Any

from pitchlore.pipeline.engine.costs import Cost, Costed, spending

#: A key that tells all that a result depends on, and work that gives the result it would give in its turn.
Early = tuple[str, Callable[[], Any]]


class Ahead:
    """At most one piece of work that was begun before its turn, in a thread of its own.

    If it fails, or is not what is wanted, the work is done in its turn.

    Attributes:
        cost: cost of the work, without a piece of its own, once it was taken.
    """

    def __init__(self) -> None:
        self.cost = Cost()
        self._thread: Thread | None = None
        self._key, self._result = Future[str | None](), Future[Costed]()
        self._stopped = Event()

    def begin(self, prepare: Callable[[], Early | None]) -> None:
        """Begin the work that a function tells, in the thread; None: there is none."""
        self._thread = Thread(target=copy_context().run, args=(self._do, prepare), daemon=True)
        self._thread.start()

    def take(self, key: str) -> Any:
        """The result of the work, once it is there; None if none of this key was begun, or it failed."""
        if self._thread is None or self._key.result() != key or self._result.exception() is not None:
            return None
        result, (seconds, bytes_in, bytes_out) = self._result.result()
        self.cost = Cost(seconds=seconds, bytes_in=bytes_in, bytes_out=bytes_out)
        return result

    def give_up(self, *, wait: bool) -> None:
        """Stop the work at its next step; wait until it has stopped, if so asked."""
        self._stopped.set()
        if wait and self._thread is not None:
            self._thread.join()

    def _do(self, prepare: Callable[[], Early | None]) -> None:
        _given_up.set(self._stopped)
        try:
            with spending() as spent:
                key, work = prepare() or (None, lambda: None)
                self._key.set_result(key)
                self._result.set_result(Costed(work(), spent()))
        except BaseException as error:
            if not self._key.done():
                self._key.set_result(None)
            self._result.set_exception(error)  # whatever is wrong is said in its turn


def go_on() -> None:
    """Nothing, unless this is work before its turn that nobody wants any more: it asks between its steps.

    Raises:
        CancelledError: then.
    """
    if (stopped := _given_up.get()) is not None and stopped.is_set():
        raise CancelledError


_given_up: ContextVar[Event | None] = ContextVar("given_up", default=None)
#: What the running flow has begun before its turn.
ahead: ContextVar[Ahead] = ContextVar("ahead", default=Ahead())  # noqa: B039 (nobody begins anything there)


@contextmanager
def looking_ahead() -> Iterator[Ahead]:
    """Room for work that is begun before its turn, while the body runs. What fails ends without waiting."""
    own = Ahead()
    token = ahead.set(own)
    try:
        yield own
        own.give_up(wait=True)
    finally:
        own.give_up(wait=False)
        ahead.reset(token)
