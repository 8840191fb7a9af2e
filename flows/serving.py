"""Prefect's settings for the flows of a command, and a watch on their server.

If the server ends or falls silent while flows run, the command ends within seconds: Prefect itself would
try for minutes.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread

import httpx
from prefect.client.orchestration import get_client
from prefect.exceptions import PrefectHTTPStatusError
from prefect.settings import (
    PREFECT_API_REQUEST_TIMEOUT,
    PREFECT_API_URL,
    PREFECT_CLIENT_MAX_RETRIES,
    PREFECT_FLOWS_HEARTBEAT_FREQUENCY,
    PREFECT_LOCAL_STORAGE_PATH,
    temporary_settings,
)

from pitchlore.flows.server import REPLY_S, Kept, ServerFailed
from pitchlore.pipeline.base.errors import in_one_line
from pitchlore.pipeline.base.text import without_password
from pitchlore.pipeline.engine.interrupt import KEPT, end

#: How long a server that is there may take to answer, seconds: one that other commands keep busy takes some.
ANSWER_S = 15.0
#: How often to ask whether the server is there, seconds; after so many times in vain it counts as ended.
WATCH_S, SILENT = 2.0, 3
#: How long one request of a flow may take, seconds, and how often it is sent again, each time after twice as
#: long: a server says 503 while other commands write to its database. If that is locked for good, it lets
#: each request wait a minute. Prefect's own: 60 s and five times.
REQUEST_S, AGAIN = 7.0, 3
#: Libraries whose errors say that the server does not answer.
_CLIENTS = ("httpx", "httpcore")


@contextmanager
def serving(url: str, own: Kept | None = None, results: Path | None = None) -> Iterator[None]:
    """Let the flows of the body talk to a server.

    Args:
        url: address of its API.
        own: its record, if it is to end with this command: one that hangs is killed.
        results: folder for the flows' results, unless the user's settings name one; None: Prefect's home.

    Raises:
        ServerFailed: if nobody answers there, if the answer is not that of Prefect's API, or if the server
            fails while the body runs.
    """
    _check(url)
    # the thread that sends a flow's heartbeats sleeps a second at a time, and the flow waits for it
    place = {} if results is None else {PREFECT_LOCAL_STORAGE_PATH: results}
    with temporary_settings({PREFECT_API_URL: url}, set_defaults={
        PREFECT_FLOWS_HEARTBEAT_FREQUENCY: None, PREFECT_API_REQUEST_TIMEOUT: REQUEST_S,
        PREFECT_CLIENT_MAX_RETRIES: AGAIN, **place,
    }), _watched(url, own):
        yield


@contextmanager
def _watched(url: str, own: Kept | None) -> Iterator[None]:
    """End this process if the server ends or falls silent while the body runs."""
    done = Event()

    def watch() -> None:
        silent = 0
        while not done.wait(WATCH_S):
            silent = 0 if _replies(url) else silent + 1
            if silent == SILENT:
                if own is not None:
                    with suppress(ProcessLookupError):
                        os.kill(own.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
                end(f"The Prefect server {without_password(url)} does not answer", 1)

    Thread(target=watch, name="server", daemon=True).start()
    try:
        yield
    except Exception as error:
        if type(error).__module__.partition(".")[0] not in _CLIENTS and not _of_the_server(error):
            raise
        answer = getattr(error, "response", None)
        said = in_one_line(error) if answer is None else f"{answer.status_code} {answer.reason_phrase}"
        advice = "Free space or mend its folder"
        if said.startswith(("401", "403")):
            advice = "Set PREFECT_API_KEY or PREFECT_API_AUTH_STRING to what it asks for"
        raise ServerFailed(
            f"the Prefect server failed ({said})", where=url, next_step=f"{advice}. {KEPT.rstrip('.')}",
        ) from error
    finally:
        done.set()


def _of_the_server(error: Exception) -> bool:
    """True if Prefect's client says by this that the server does not answer, or fails."""
    unreached = isinstance(error, RuntimeError) and str(error).startswith("Failed to reach API")
    return unreached or isinstance(error, PrefectHTTPStatusError)


def _replies(url: str) -> bool:
    """True if a server answers anything within :data:`flows.server.REPLY_S`."""
    with _only(url), get_client({"timeout": REPLY_S}, sync_client=True) as client:
        said = client.api_healthcheck()
    return said is None or hasattr(said, "response")


def _check(url: str) -> None:
    """Check that a server answers.

    Raises:
        ServerFailed: if nobody answers, or if the answer is not that of Prefect's API.
    """
    with _only(url), get_client({"timeout": ANSWER_S}, sync_client=True) as client:
        try:
            answer = client.hello()
        except httpx.HTTPStatusError as error:  # Prefect Cloud knows no hello
            answer = error.response
        except (httpx.TransportError, httpx.InvalidURL) as error:
            raise ServerFailed(
                f"no Prefect server answers ({' '.join(str(error).split()) or type(error).__name__})",
                where=url, next_step="Start it, or correct PREFECT_API_URL in the environment",
            ) from error
    if "json" not in answer.headers.get("content-type", "") or (answer.is_error and "/api" not in url):
        raise ServerFailed("is not the address of a Prefect API", where=url,
                           next_step=f"Set PREFECT_API_URL to {url.rstrip('/')}/api")


@contextmanager
def _only(url: str) -> Iterator[None]:
    """Prefect's settings for one request to a server."""
    with temporary_settings({PREFECT_API_URL: url, PREFECT_CLIENT_MAX_RETRIES: 0}):
        yield
