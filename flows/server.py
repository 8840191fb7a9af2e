"""The Prefect server of a data folder: started once, found by every command, stopped. Nothing loads Prefect.

Its database is in the data folder, one for each version of Prefect: no other Prefect of the machine reads or
changes it. It is in the user's own folder where the data folder is closed to them, or in a bucket.
"""

from __future__ import annotations

import os
import re
import secrets
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from hashlib import sha256
from http.client import HTTPConnection, HTTPException
from importlib.metadata import version
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import TemporaryFile
from threading import Thread
from typing import IO

from filelock import FileLock, Timeout
from pydantic import BaseModel, ConfigDict, ValidationError

from pitchlore.flows.server_process import HEADER, TAKEN
from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.sealed import pretty

#: Where a data folder keeps its server: Prefect's home and database, the record, the log.
FOLDER = "server"
#: So that the database does not grow for ever: the history of four weeks is kept, events of one.
_BOUNDED = {
    "PREFECT_SERVER_SERVICES_DB_VACUUM_ENABLED": "events,flow_runs",
    "PREFECT_SERVER_SERVICES_DB_VACUUM_RETENTION_PERIOD": str(28 * 86_400),
    "PREFECT_SERVER_EVENTS_RETENTION_PERIOD": "P7D",
}
#: How long a server may take until it answers, seconds: on a busy machine the first start takes a minute.
START_S = 120.0
#: How long a server that is told to stop may take, seconds; then it is killed.
STOP_S = 5.0
#: How long one look at a server may take, seconds.
REPLY_S = 3.0
_POLL_S = 0.05
#: How long a database may be locked by others, seconds.
_LOCKED_S = 2.0
#: Databases up to this size are checked whole before a server uses them.
_CHECKED_BYTES = 64 << 20
#: The last line of a traceback.
_ERROR = re.compile(r"([a-zA-Z_]\w*\.)*\w*(Error|Exception)\b")


class ServerFailed(PitchloreError):
    """A Prefect server cannot be started, or does not answer."""


def database() -> str:
    """Name of the database of the installed Prefect."""
    return f"prefect-{version('prefect')}.db"


def trouble(file: Path) -> str | None:
    """Reason why a server cannot use a database, None if it can or would make a new one."""
    if not file.exists():
        return None
    try:
        with closing(sqlite3.connect(file, timeout=_LOCKED_S, isolation_level=None)) as connection:
            connection.execute("begin immediate")
            connection.execute("rollback")
            if file.stat().st_size <= _CHECKED_BYTES:
                ((found, *_), *_) = connection.execute("pragma quick_check(1)").fetchall()
                if found != "ok":
                    return f"{file.name} is damaged ({' '.join(str(found).split())})"
    except sqlite3.Error as error:
        return f"{file.name} cannot be used ({error})"
    return None


class Kept(BaseModel):
    """The record of a data folder's server.

    Attributes:
        pid: process number of its process.
        port: on 127.0.0.1.
        token: its word for itself in the header :data:`flows.server_process.HEADER` of each answer.
    """

    model_config = ConfigDict(frozen=True)

    pid: int
    port: int
    token: str

    @property
    def ui(self) -> str:
        """Address of its pages."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def api(self) -> str:
        """Address of its API, as PREFECT_API_URL takes it."""
        return f"{self.ui}/api"

    @property
    def answers(self) -> bool:
        """True if this server, and no other at its port, answers within :data:`REPLY_S`."""
        connection = HTTPConnection("127.0.0.1", self.port, timeout=REPLY_S)
        try:
            connection.request("GET", "/api/health")
            return connection.getresponse().getheader(HEADER) == self.token
        except (OSError, HTTPException):
            return False
        finally:
            connection.close()


class Process:
    """The process of a server; the terminal's Ctrl-C does not reach it.

    The server ends with this process, however this process ends, unless it is told to :meth:`stay`.

    Args:
        environment: variables of the server's process.
        port: port on 127.0.0.1; 0 takes a free one.
        log: file to which its errors are appended; None: a temporary one.

    Raises:
        ServerFailed: if the port is taken, or the process ends at once.
    """

    def __init__(self, environment: Mapping[str, str], *, port: int = 0, log: Path | None = None) -> None:
        self._log: IO[bytes] = TemporaryFile() if log is None else log.open("a+b")  # noqa: SIM115 (closed with it)
        self._begun = self._log.seek(0, os.SEEK_END)
        self._asked = port
        self._said = SimpleQueue[str]()
        token = secrets.token_hex(8)
        self._process = subprocess.Popen(  # noqa: S603 (our own interpreter and module)
            # -P: no modules of the working directory
            [sys.executable, "-P", "-m", "pitchlore.flows.server_process", str(port), token],
            env={**environment}, start_new_session=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=self._log, bufsize=0,
        )
        self._listener = Thread(target=self._listen, name="server's words", daemon=True)
        self._listener.start()
        self._end = time.monotonic() + START_S
        self.record = Kept(pid=self._process.pid, port=int(self._line()), token=token)

    def wait(self) -> None:
        """Wait until the server answers.

        Raises:
            ServerFailed: if it ends before, or takes longer than :data:`START_S`.
        """
        self._line()

    def stay(self) -> None:
        """Let the server outlive this process."""
        assert self._process.stdin is not None
        self._process.stdin.write(b"stay\n")
        self._hang_up()

    def stop(self) -> None:
        """Tell the server to end and wait for its end; kill it after :data:`STOP_S`."""
        self._process.terminate()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(STOP_S)
        self.kill()

    def kill(self) -> None:
        """End the server at once."""
        self._process.kill()
        self._process.wait()
        self._hang_up()

    def _hang_up(self) -> None:
        self._listener.join(STOP_S)  # its output ends when it is ready, or ends
        for stream in (self._process.stdin, self._process.stdout, self._log):
            assert stream is not None
            stream.close()

    def last_words(self) -> str:
        """The last error that the server has logged, else its last line."""
        self._log.seek(self._begun)
        lines = self._log.read().decode(errors="replace").split("\n")
        said = [line.strip() for line in lines if line.strip()]
        errors = [line for line in said if _ERROR.match(line)]
        return next(reversed(errors or said), "it said nothing")

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._said.put(line.decode().strip())
        self._said.put("")  # it has ended, or it is ready and writes to its log from then on

    def _line(self) -> str:
        """The next line that the server writes; without one it is killed."""
        try:
            line = self._said.get(timeout=max(0.0, self._end - time.monotonic()))
        except Empty:
            failed = self._failure(f"no answer in {START_S:.0f} s")
            self.kill()
            raise failed from None
        except BaseException:  # Ctrl-C, too, leaves none behind
            self.kill()
            raise
        if not line:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(STOP_S)
            failed = self._failure(self.last_words())
            self.kill()
            raise failed
        return line

    def _failure(self, why: str) -> ServerFailed:
        if self._process.returncode == TAKEN:
            return ServerFailed(f"port {self._asked} of 127.0.0.1 is taken", where="--port",
                                next_step="Name another port, or none: then a free one is taken")
        return ServerFailed(f"the Prefect server does not start ({why})", next_step=(
            "Run again with --debug and report what it says"))


class Keeper:
    """The server of a data folder.

    Args:
        root: the data folder.
    """

    def __init__(self, root: Path) -> None:
        self.folder = _home(root.resolve())
        self.log = self.folder / "server.log"
        self._lock = FileLock(self.folder / ".lock", timeout=START_S)
        self._record = self.folder / "server.json"
        #: Folder for the results of flows that talk to it; None where PREFECT_API_URL names another server.
        self.results = None if os.environ.get("PREFECT_API_URL") else self.folder / "results"

    def look(self) -> Kept | None:
        """Record of the server that was started last and not stopped; it may have died (``answers``).

        Raises:
            ServerFailed: if there is a record that cannot be read, or is damaged.
        """
        try:
            return Kept.model_validate_json(self._record.read_bytes())
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise ServerFailed(f"cannot be read ({error.strerror or error}), so a server may run",
                               where=str(self._record), next_step=(
                "Let this user read it, or call the command as its owner")) from error
        except ValidationError as error:
            raise ServerFailed("is damaged, so a server may run", where=str(self._record), next_step=(
                "End the server of this folder, if one runs, and remove the file")) from error

    @property
    def alive(self) -> Kept | None:
        """Record of the server that runs, None if none does."""
        record = self.look()
        return record if record is not None and record.answers else None

    def start(self, port: int = 0) -> tuple[Kept, bool]:
        """Start the server, unless it runs. Returns its record, and whether it was started now.

        Args:
            port: on 127.0.0.1; 0 takes a free one.

        Raises:
            ServerFailed: if the port is taken, or no server answers in the end.
        """
        record, process = self._find_or_start(port)
        if process is not None:
            process.stay()
        return record, process is not None

    @contextmanager
    def running(self, *, shared: bool = True) -> Iterator[Kept]:
        """The server while the body runs: the one that runs already, else one that ends with the body.

        Args:
            shared: whether other commands may find the one that ends with the body.

        Raises:
            ServerFailed: if no server answers in the end.
        """
        record, process = self._find_or_start(0, shared=shared)
        try:
            yield record
        finally:
            if process is not None:
                process.stop()
                if shared:
                    self._record.unlink(missing_ok=True)

    def stop(self) -> Kept | None:
        """Stop the server, by force if need be. Returns its record, None if none runs.

        Raises:
            ServerFailed: if it belongs to another user.
        """
        record = self.alive
        if record is not None:
            try:
                os.kill(record.pid, signal.SIGTERM)
                end = time.monotonic() + STOP_S
                while record.answers and time.monotonic() < end:
                    time.sleep(_POLL_S)
                if record.answers:
                    os.kill(record.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
            except ProcessLookupError:
                pass  # it has ended in this moment
            except PermissionError as error:
                raise ServerFailed(f"process {record.pid} belongs to another user", where=record.ui,
                                   next_step="Let them stop it") from error
        with suppress(OSError):
            self._record.unlink()
        return record

    def _find_or_start(self, port: int, *, shared: bool = True) -> tuple[Kept, Process | None]:
        """The record of the server, and its process if it was started now: that ends with this one."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with self._lock:
                record = self.alive
                return (record, None) if record is not None else self._start(port, shared=shared)
        except Timeout:
            raise ServerFailed("another command is starting the server, which does not answer",
                               where=str(self.folder), next_step=f"See {self.log}") from None
        except OSError as error:
            raise ServerFailed(f"cannot be used ({error.strerror or error})", where=str(self.folder),
                               next_step="Make it a folder that you may write, or remove it") from error

    def _start(self, port: int, *, shared: bool) -> tuple[Kept, Process]:
        why = trouble(self.folder / database())
        if why is not None:
            raise ServerFailed(why, where=str(self.folder), next_step=(
                f"Mend the folder, or remove {database()} in it: only the history of past runs is lost"))
        (self.folder / database()).touch()  # by the umask: SQLite would close it to the user's group
        process = Process(self._environment(), port=port, log=self.log)
        try:
            process.wait()
            if shared:
                Files(self.folder).write_bytes(self._record, pretty(process.record))
        except BaseException:  # Ctrl-C, too, leaves none behind
            process.kill()
            raise
        return process.record, process

    def _environment(self) -> dict[str, str]:
        """Variables for a Prefect of its own, which reads and changes nothing of the user's."""
        own = {
            "PREFECT_HOME": str(self.folder), "PREFECT_UI_ENABLED": "true",
            "PREFECT_API_DATABASE_CONNECTION_URL": f"sqlite+aiosqlite:///{self.folder / database()}",
            "PREFECT_UI_STATIC_DIRECTORY": str(self.folder / "pages"),
        }
        given = {name: value for name, value in os.environ.items() if name != "PREFECT_API_URL"}
        return _BOUNDED | given | own


def named(root: Path) -> str | None:
    """Address of the API of the server for the flows of a data folder; None if there is none.

    It is the one that PREFECT_API_URL names in the environment, else the one that the folder keeps.
    """
    if os.environ.get("PREFECT_API_URL"):
        return os.environ["PREFECT_API_URL"]
    kept = Keeper(root).alive
    return None if kept is None else kept.api


def _home(root: Path) -> Path:
    """The folder of a data folder's server: in it, else the user's own by the data folder's name."""
    inside = root / FOLDER
    first = next(folder for folder in (inside, root, *root.parents) if folder.exists())
    if os.access(first, os.W_OK):
        return inside
    state = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state")
    return state / "pitchlore" / f"{root.name}-{sha256(os.fsencode(root)).hexdigest()[:12]}"
