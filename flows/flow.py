"""A piece of work of the engine as a Prefect flow."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, ParamSpec, TypeVar, cast, get_type_hints

from prefect import Flow
from prefect.client.schemas.objects import State
from prefect.task_runners import ThreadPoolTaskRunner
from pydantic import BaseModel

from pitchlore.flows.pruning import OURS, prune_or_say
from pitchlore.flows.runner import as_tasks, tell_assets
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.settings import HistorySettings

P = ParamSpec("P")
R = TypeVar("R")


def our_flow(*, name: str) -> Callable[[Callable[P, R]], Flow[P, R]]:
    """A flow of ours: its result is JSON; the engine's tasks in it are Prefect's, each with a thread.

    A result that is a model of pydantic's becomes a dictionary. Where the flow has a parameter ``history``,
    our flow runs that are older than it says leave Prefect's database at the end.
    """

    def decorate(function: Callable[P, R]) -> Flow[P, R]:
        @wraps(function)
        def under_prefect(*given: P.args, **named: P.kwargs) -> Any:
            with as_tasks():
                result = function(*given, **named)
            call = signature(function).bind(*given, **named)
            call.apply_defaults()
            history = call.arguments.get("history")
            if isinstance(result, RunReport):
                tell_assets(call.arguments["data"], result)
            if isinstance(history, HistorySettings):
                prune_or_say(history)
            if isinstance(result, BaseModel) and not isinstance(result, State):
                return result.model_dump()
            return result

        # Prefect makes a model of the parameters, and knows no names of the function's module
        under_prefect.__signature__ = signature(function, eval_str=True)  # type: ignore[attr-defined]
        under_prefect.__annotations__ = get_type_hints(function)
        return Flow(
            under_prefect, name=name, version=OURS, persist_result=True, result_serializer="json",
            task_runner=cast("Any", ThreadPoolTaskRunner()),
        )

    return decorate
