"""The Prefect server of a command's flows.

It is the first of these: the one that PREFECT_API_URL names in the environment; the one that the data
folder keeps (`pitchlore server start`); the one that Prefect's settings name; one that is started for this
process and ends with it. The last keeps its history in Prefect's home, or nowhere if that cannot be used.

If the server ends or falls silent while flows run, the command ends within seconds: Prefect itself would
try for minutes.
"""

from __future__ import annotations

import atexit
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from shutil import rmtree
from signal import SIGKILL
from tempfile import mkdtemp
from threading import Event, Thread

from pitchlore.flows.interrupt import KEPT, end
from pitchlore.flows.server import Keeper, Process, ServerFailed, trouble
from pitchlore.pipeline.base.errors import in_one_line

#: How long a server that is there may take to answer, seconds: one that other commands keep busy takes some.
ANSWER_S = 15.0
#: How often to ask whether the server is there, and how long it may take to answer, seconds; after so many
#: times in vain it counts as ended.
WATCH_S, REPLY_S, SILENT = 2.0, 3.0, 3
#: How long one request of a flow may take, seconds, and how often it is sent again, each time after twice as
#: long: a server says 503 while other commands write to its database. If that is locked for good, it lets
#: each request wait a minute. Prefect's own: 60 s and five times.
REQUEST_S, AGAIN = 7.0, 3
#: Libraries whose errors say that the server does not answer.
_CLIENTS = ("httpx", "httpcore")


@contextmanager
def serving(root: Path, notice: Callable[[str], None]) -> Iterator[Callable[[], None]]:
    """A Prefect server for the flows of a data folder, while the body runs.

    Args:
        root: the data folder.
        notice: called with one line if the folder's server has died.

    Yields:
        A function that waits until the server answers; then flows may run. Load slow modules, Prefect
        above all, before calling it: the server starts meanwhile.

    Raises:
        ServerFailed: from that function, if the server does not start or answer.
    """
    kept = None if "PREFECT_API_URL" in os.environ else _kept(root, notice)
    own = kept is None and not _is_named()
    if "prefect" not in sys.modules:
        _find_home(notice if own else lambda _: None)
    if own:
        _own()
    with ExitStack() as stack:

        def ready() -> None:
            from prefect.settings import (  # noqa: PLC0415 (see above)
                PREFECT_API_REQUEST_TIMEOUT,
                PREFECT_API_URL,
                PREFECT_CLIENT_MAX_RETRIES,
                PREFECT_FLOWS_HEARTBEAT_FREQUENCY,
                temporary_settings,
            )

            there = kept or PREFECT_API_URL.value()
            if there:
                _check(there)
            else:
                _own().wait()
            url = there or _own().api
            stack.enter_context(_watched(url, _alive(root, kept, there)))
            # the thread that sends a flow's heartbeats sleeps a second at a time, and the flow waits for it
            stack.enter_context(temporary_settings(
                {PREFECT_API_URL: url},
                set_defaults={
                    PREFECT_FLOWS_HEARTBEAT_FREQUENCY: None, PREFECT_API_REQUEST_TIMEOUT: REQUEST_S,
                    PREFECT_CLIENT_MAX_RETRIES: AGAIN,
                },
            ))

        yield ready


def there_is_one(root: Path, notice: Callable[[str], None]) -> bool:
    """Whether the flows of a data folder have a server that does not end with this process."""
    return "PREFECT_API_URL" in os.environ or _kept(root, notice) is not None or _prefect_names_one()


def _kept(root: Path, notice: Callable[[str], None]) -> str | None:
    """Address of the API of the data folder's server, None if none runs."""
    alive, record = Keeper(root).look()
    if record is not None and not alive:
        notice(f"The Prefect server of {root} has died; this command brings its own."
               " `pitchlore server start` starts it again.")
    return record.api if alive and record is not None else None


def _is_named() -> bool:
    """Whether a server is named, as far as can be told without loading Prefect."""
    return "PREFECT_API_URL" in os.environ or ("prefect" in sys.modules and _prefect_names_one())


def _prefect_names_one() -> bool:
    from prefect.settings import PREFECT_API_URL  # noqa: PLC0415 (looking at a data folder needs no Prefect)

    return bool(PREFECT_API_URL.value())


def _find_home(notice: Callable[[str], None]) -> None:
    """Give Prefect another home if its own cannot be used; call it before Prefect is loaded."""
    home = Path(os.environ.get("PREFECT_HOME") or "~/.prefect").expanduser()
    why = trouble(home)
    if why is None:
        return
    notice(f"{home}: {why}. The history of this command's runs is kept nowhere.")
    other = mkdtemp(prefix="pitchlore-")
    atexit.register(rmtree, other, ignore_errors=True)
    os.environ |= {
        "PREFECT_HOME": other, "PREFECT_API_DATABASE_CONNECTION_URL": "sqlite+aiosqlite:///:memory:",
        "PREFECT_PROFILES_PATH": str(home / "profiles.toml"),
    }


@contextmanager
def _watched(url: str, alive: Callable[[], bool]) -> Iterator[None]:
    """End this process if the server ends or falls silent while the body runs."""
    done = Event()

    def watch() -> None:
        silent = 0
        while not done.wait(WATCH_S):
            there = alive()
            silent = 0 if there and _replies(url) else silent + 1
            if silent == SILENT:
                if _own.cache_info().currsize:
                    with suppress(ProcessLookupError):
                        os.kill(_own().pid, SIGKILL)  # one that hangs would not end with this process
                end(f"The Prefect server {url} {'does not answer' if there else 'has ended'}", 1)

    Thread(target=watch, name="server", daemon=True).start()
    try:
        yield
    except Exception as error:
        if type(error).__module__.partition(".")[0] not in _CLIENTS and not _of_the_server(error):
            raise
        answer = getattr(error, "response", None)
        said = in_one_line(error) if answer is None else f"{answer.status_code} {answer.reason_phrase}"
        if _own.cache_info().currsize:
            said += f"; its log ends with: {_own().last_words()}"
        raise ServerFailed(
            f"the Prefect server failed ({said})", where=url,
            next_step=f"Free space or mend its folder. {KEPT.rstrip('.')}",
        ) from error
    finally:
        done.set()


def _of_the_server(error: Exception) -> bool:
    """Whether Prefect's client says by this that the server does not answer, or fails."""
    from prefect.exceptions import PrefectHTTPStatusError  # noqa: PLC0415 (see above)

    unreached = isinstance(error, RuntimeError) and str(error).startswith("Failed to reach API")
    return unreached or isinstance(error, PrefectHTTPStatusError)


def _alive(root: Path, kept: str | None, there: str | None) -> Callable[[], bool]:
    """Whether the server runs, as a function; one of others runs as long as it replies."""
    if kept is not None:
        return lambda: Keeper(root).look().alive
    if there is None:
        return lambda: _own().alive
    return lambda: True


def _replies(url: str) -> bool:
    """Whether a server answers anything within :data:`REPLY_S`."""
    from prefect.client.orchestration import get_client  # noqa: PLC0415 (see above)

    with _named(url), get_client({"timeout": REPLY_S}, sync_client=True) as client:
        said = client.api_healthcheck()
    return said is None or hasattr(said, "response")


@cache
def _own() -> Process:
    """The server of this process; before it ends, Prefect sends it all pending messages."""
    process = Process(os.environ | {
        "PREFECT_UI_ENABLED": "false", "PREFECT__SERVER_EPHEMERAL": "1", "PREFECT__SERVER_FINAL": "1"})
    atexit.register(process.stop)  # before Prefect is loaded: what it registers is called first
    return process


def _check(url: str) -> None:
    """Check that a server answers.

    Raises:
        ServerFailed: if nobody answers, or if the answer is not that of Prefect's API.
    """
    import httpx  # noqa: PLC0415 (Prefect brings it and has loaded it)
    from prefect.client.orchestration import get_client  # noqa: PLC0415

    with _named(url), get_client({"timeout": ANSWER_S}, sync_client=True) as client:
        try:
            answer = client.hello()
        except httpx.HTTPStatusError as error:  # Prefect Cloud knows no hello
            answer = error.response
        except (httpx.TransportError, httpx.InvalidURL) as error:
            raise ServerFailed(
                f"no Prefect server answers ({' '.join(str(error).split()) or type(error).__name__})",
                where=url, next_step=(
                    "Start it, or correct PREFECT_API_URL in the environment, .env or prefect.toml"),
            ) from error
    if "json" not in answer.headers.get("content-type", "") or (answer.is_error and "/api" not in url):
        raise ServerFailed("is not the address of a Prefect API", where=url,
                           next_step=f"Set PREFECT_API_URL to {url.rstrip('/')}/api")


def _named(url: str) -> AbstractContextManager[object]:
    """Prefect's settings for one request to a server, while the body runs."""
    from prefect.settings import (  # noqa: PLC0415 (see above)
        PREFECT_API_URL,
        PREFECT_CLIENT_MAX_RETRIES,
        temporary_settings,
    )

    return temporary_settings({PREFECT_API_URL: url, PREFECT_CLIENT_MAX_RETRIES: 0})
