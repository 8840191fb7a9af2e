"""A Prefect server and progress bars, for the commands that run flows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from pitchlore.flows.commands.printing import bars, warn
from pitchlore.flows.serving import serving
from pitchlore.pipeline.engine.progress import listener
from pitchlore.pipeline.store import Store


@contextmanager
def orchestrated(store: Store) -> Iterator[Callable[[], None]]:
    """Progress bars, and a Prefect server, for the flows that the body runs.

    Yields:
        A function to call before the first flow. The body imports the flow first: Prefect takes seconds to
        load, and meanwhile the server starts, if one has to be started.
    """
    with bars() as progress, serving(store.root, warn) as ready:

        def begin() -> None:
            ready()
            listener.set(progress)

        yield begin
