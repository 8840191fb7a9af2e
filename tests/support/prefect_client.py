"""Questions of tests to Prefect's server, by Prefect's client: while the database is busy it asks again."""

from typing import Any
from uuid import UUID

from prefect.client.orchestration import get_client
from prefect.client.schemas.objects import FlowRun
from prefect.exceptions import ObjectNotFound


def flow_run(name: str) -> FlowRun | None:
    """The flow run of an id as the server has it, None if it has none."""
    with get_client(sync_client=True) as client:
        try:
            return client.read_flow_run(UUID(name))
        except ObjectNotFound:
            return None


def post(path: Any, body: dict[str, Any]) -> Any:
    """The answer to a request.

    Raises:
        httpx.HTTPStatusError: if the server refuses.
    """
    with get_client(sync_client=True) as client:
        return client.request("POST", path, json=body).json()
