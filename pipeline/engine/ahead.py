"""Work of a run that is begun before its turn, beside other legs, because its inputs are there."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from threading import Event, Thread
from typing import Any, NamedTuple

from pitchlore.pipeline.engine.costs import Cost, spending


class Early(NamedTuple):
    """A piece of work that may be begun early.

    Attributes:
        key: tells all that its result depends on.
        work: gives the result that it would give in its turn.
    """

    key: str
    work: Callable[[], Any]


class Ahead:
    """At most one piece of work that was begun before its turn, in a thread of its own.

    It makes nothing that its turn would not make: if it fails, or is not what is wanted, the work is done in
    its turn.
    """

    def __init__(self) -> None:
        self._thread: Thread | None = None
        self._key = Future[str | None]()
        self._result = Future[Any]()
        self._given_up = Event()
        self._cost = Cost()

    def begin(self, prepare: Callable[[], Early | None]) -> None:
        """Begin a piece of work.

        Args:
            prepare: tells the work, in the thread; None: there is none.
        """
        self._thread = Thread(target=copy_context().run, args=(self._do, prepare), daemon=True)
        self._thread.start()

    def go_on(self) -> None:
        """Nothing while somebody may want the work; it calls this between its steps.

        Raises:
            CancelledError: once nobody does.
        """
        if self._given_up.is_set():
            raise CancelledError

    def take(self, key: str) -> Any:
        """The result of the work, once it is there; None if none of this key was begun, or it failed."""
        if self._thread is None or self._key.result() != key or self._result.exception() is not None:
            return None
        result, (seconds, bytes_in, bytes_out) = self._result.result()
        self._cost = Cost(seconds=seconds, bytes_in=bytes_in, bytes_out=bytes_out)
        return result

    def paid(self) -> Cost:
        """The cost of the work that was taken, without pieces of its own; nothing if none was."""
        return self._cost

    def _do(self, prepare: Callable[[], Early | None]) -> None:
        try:
            with spending() as spent:
                early = prepare()
                self._key.set_result(None if early is None else early.key)
                result = None if early is None else early.work()
                self._result.set_result((result, spent()))
        except BaseException as error:
            # in its turn it is done again, and whatever is wrong is said
            if not self._key.done():
                self._key.set_result(None)
            self._result.set_exception(error)

    def give_up(self, *, wait: bool) -> None:
        """Stop the work at its next step; wait until it has stopped, if so asked."""
        self._given_up.set()
        if wait and self._thread is not None:
            self._thread.join()


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
