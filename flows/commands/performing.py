"""Work that a command does: by the engine, or by Prefect where there is a server."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import ParamSpec, TypeVar

from pydantic import BaseModel

from pitchlore.flows.commands.waiting import bars
from pitchlore.flows.server import Keeper, named
from pitchlore.pipeline.store import Store

P = ParamSpec("P")
R = TypeVar("R", bound=BaseModel)


def perform(store: Store, flow: str, result: type[R], work: Callable[P, R], *, as_flow: bool = False,
            ) -> Callable[P, R]:
    """A piece of work with progress bars, done by the engine or by its flow.

    It is a flow where PREFECT_API_URL names a server, or the data folder keeps one. Otherwise nothing of
    Prefect is loaded and nothing is started, unless the flow is asked for.

    Args:
        store: store of the data folder.
        flow: name of the flow in ``flows/run.py``.
        result: model of the result.
        work: function of the engine; the flow has the same arguments.
        as_flow: bring the data folder's server for it, if there is none. It ends with the work.
    """

    def done(*given: P.args, **how: P.kwargs) -> R:
        with ExitStack() as stack:
            stack.enter_context(bars())
            url = named(store.root)
            if url is None and not as_flow:
                return work(*given, **how)
            keeper = Keeper(store.root)
            # it ends with this command: no other may depend on it
            own = stack.enter_context(keeper.running(shared=False)) if url is None else None
            from pitchlore.flows import run  # noqa: PLC0415 (Prefect takes seconds to load)
            from pitchlore.flows.serving import serving  # noqa: PLC0415

            stack.enter_context(serving(own.api if own else str(url), own, keeper.results))
            return result.model_validate(getattr(run, flow)(*given, **how))

    return done
