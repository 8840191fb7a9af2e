"""Prefect servers that Pitchlore starts: one ends with its process, the other is kept for a data folder."""

from __future__ import annotations

import fcntl
import os
import re
import select
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, NamedTuple

from pydantic import BaseModel, ConfigDict, ValidationError

from pitchlore.flows.server_process import TAKEN
from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.store.files import Files
from pitchlore.pipeline.store.sealed import pretty

#: Where a data folder keeps its server: Prefect's home and database, the record, the log.
FOLDER = "server"
#: Prefect's database in its home.
DATABASE = "prefect.db"
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
_POLL_S = 0.05
#: The last line of a traceback.
_ERROR = re.compile(r"([a-zA-Z_]\w*\.)*\w*(Error|Exception)\b")

#: How long a database may be locked by others, seconds.
_LOCKED_S = 2.0
#: Databases up to this size are checked whole before a server uses them.
_CHECKED_BYTES = 64 << 20


class ServerFailed(PitchloreError):
    """A Prefect server cannot be started, or does not answer."""


def trouble(home: Path) -> str | None:
    """Why a server cannot use a folder as its home, or the database in it; None if it can."""
    try:
        home.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=home):
            pass
    except OSError as error:
        return f"cannot be written ({error.strerror or error})"
    database = home / DATABASE
    if not database.exists():
        return None
    try:
        with closing(sqlite3.connect(database, timeout=_LOCKED_S, isolation_level=None)) as connection:
            connection.execute("begin immediate")
            connection.execute("rollback")
            if database.stat().st_size <= _CHECKED_BYTES:
                ((found, *_), *_) = connection.execute("pragma quick_check(1)").fetchall()
                if found != "ok":
                    return f"{DATABASE} is damaged ({' '.join(str(found).split())})"
    except sqlite3.Error as error:
        return f"{DATABASE} cannot be used ({error})"
    return None


class Process:
    """The process of a server; the terminal's Ctrl-C does not reach it.

    The server ends with this process, however this process ends, unless it is told to :meth:`stay`.

    Args:
        environment: variables of the server's process.
        port: port on 127.0.0.1; 0 takes a free one.
        log: file to which its errors are appended.
        held: descriptor of a file that the server holds open as long as it lives.

    Raises:
        ServerFailed: if the port is taken, or the process ends at once.
    """

    def __init__(self, environment: Mapping[str, str], *, port: int = 0, log: Path | None = None,
                 held: int | None = None) -> None:
        self._log: IO[bytes] = TemporaryFile() if log is None else log.open("a+b")  # noqa: SIM115 (closed with it)
        self._begun = self._log.seek(0, os.SEEK_END)
        self._asked = port
        self._heard = b""
        self._answers = False
        self._process = subprocess.Popen(  # noqa: S603 (our own interpreter and module)
            # -P: no modules of the working directory
            [sys.executable, "-P", "-m", "pitchlore.flows.server_process", str(port)],
            env={**environment}, start_new_session=True, pass_fds=() if held is None else (held,),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, bufsize=0,
        )
        self._end = time.monotonic() + START_S
        self.port = int(self._line())

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def api(self) -> str:
        """Address of its API, as PREFECT_API_URL takes it."""
        return f"http://127.0.0.1:{self.port}/api"

    @property
    def alive(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None

    def wait(self) -> None:
        """Wait until the server answers.

        Raises:
            ServerFailed: if it ends before, or takes longer than :data:`START_S`.
        """
        if not self._answers:
            self._answers = self._line() == "ready"

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
        for stream in (self._process.stdin, self._process.stdout, self._log):
            assert stream is not None
            stream.close()

    def _line(self) -> str:
        """The next line that the server writes.

        Raises:
            ServerFailed: if it ends before, or takes longer than :data:`START_S` since its start; it is
                killed then.
        """
        try:
            while b"\n" not in self._heard:
                self._heard += self._more()
        except BaseException:  # Ctrl-C, too, leaves none behind
            self.kill()
            raise
        line, _, self._heard = self._heard.partition(b"\n")
        return line.decode()

    def _more(self) -> bytes:
        assert self._process.stdout is not None
        left = max(0.0, self._end - time.monotonic())
        if not select.select([self._process.stdout], [], [], left)[0]:
            raise self._failure(f"no answer in {START_S:.0f} s")
        part: bytes = self._process.stdout.read(64)
        if not part:
            raise self._failure(self.last_words())
        return part

    def _failure(self, why: str) -> ServerFailed:
        with suppress(subprocess.TimeoutExpired):
            if self._process.wait(STOP_S) == TAKEN:
                return ServerFailed(f"port {self._asked} of 127.0.0.1 is taken", where="--port",
                                    next_step="Name another port, or none: then a free one is taken")
        return ServerFailed(f"the Prefect server does not start ({why})",
                            next_step="Run again with --debug and report what it says")

    def last_words(self) -> str:
        """The last error that the server has logged, else its last line."""
        self._log.seek(self._begun)
        lines = self._log.read().decode(errors="replace").split("\n")
        said = [line.strip() for line in lines if line.strip()]
        errors = [line for line in said if _ERROR.match(line)]
        return next(reversed(errors or said), "it said nothing")


class Kept(BaseModel):
    """The record of a data folder's server.

    Attributes:
        pid: of its process.
        port: on 127.0.0.1.
    """

    model_config = ConfigDict(frozen=True)

    pid: int
    port: int

    @property
    def ui(self) -> str:
        """Address of its pages."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def api(self) -> str:
        """Address of its API, as PREFECT_API_URL takes it."""
        return f"{self.ui}/api"


class Seen(NamedTuple):
    """State of a data folder's server.

    Attributes:
        alive: whether it runs or is being started.
        record: record of the server that runs, or of one that has died; None before it answers.
    """

    alive: bool
    record: Kept | None


class Keeper:
    """A data folder's server: started once, found by every command, stopped.

    The server holds a lock on a file as long as it lives. If nobody holds the lock, the recorded server has
    died, even if another process has its number by now.

    Args:
        root: the data folder.
    """

    def __init__(self, root: Path) -> None:
        self.folder = root.resolve() / FOLDER
        self.log = self.folder / "server.log"
        self._lock = self.folder / ".lock"
        self._record = self.folder / "server.json"

    def look(self) -> Seen:
        """State of the server; nothing is changed."""
        alive = False
        with suppress(OSError), self._lock.open("rb") as held:
            try:
                fcntl.flock(held, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                alive = True
        try:
            record = Kept.model_validate_json(self._record.read_bytes())
        except (OSError, ValidationError):
            record = None
        return Seen(alive, record)

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
    def running(self) -> Iterator[Kept]:
        """The server while the body runs: the one that runs already, else one that ends with the body.

        Raises:
            ServerFailed: if no server answers in the end.
        """
        record, process = self._find_or_start(0)
        try:
            yield record
        finally:
            if process is not None:
                process.stop()
                self._record.unlink(missing_ok=True)

    def stop(self) -> Kept | None:
        """Stop the server, by force if need be. Returns its record, None if none runs.

        Raises:
            ServerFailed: if it is just being started, or belongs to another user.
        """
        alive, record = self.look()
        if alive and record is None:
            raise ServerFailed("another command is starting the server", where=str(self.folder),
                               next_step="Try again when that command has ended")
        if alive and record is not None:
            try:
                os.kill(record.pid, signal.SIGTERM)
                if not self._ends_within(STOP_S):
                    os.kill(record.pid, signal.SIGKILL)
                    self._ends_within(STOP_S)
            except ProcessLookupError:
                pass  # it has ended in this moment
            except PermissionError as error:
                raise ServerFailed(f"process {record.pid} belongs to another user", where=record.ui,
                                   next_step="Have that user stop it") from error
        with suppress(NotADirectoryError):
            self._record.unlink(missing_ok=True)
        return record if alive else None

    def _find_or_start(self, port: int) -> tuple[Kept, Process | None]:
        """The record of the server, and its process if it was started now: that ends with this one."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock.open("ab").close()
        except OSError as error:
            raise ServerFailed(f"cannot be used ({error.strerror})", where=str(self.folder),
                               next_step="Make it a folder that you may write, or remove it") from error
        end = time.monotonic() + START_S
        while time.monotonic() < end:
            with self._held() as lock:
                if lock is not None:
                    return self._start(port, lock)
            alive, record = self.look()
            if alive and record is not None:
                return record, None
            time.sleep(_POLL_S)
        raise ServerFailed("another command is starting the server, which does not answer",
                           where=str(self.folder), next_step=f"See {self.log}")

    def _start(self, port: int, lock: int) -> tuple[Kept, Process]:
        self._record.unlink(missing_ok=True)
        why = trouble(self.folder)
        if why is not None:
            raise ServerFailed(why, where=str(self.folder), next_step=(
                f"Mend the folder, or remove {DATABASE} in it: only the history of past runs is lost"))
        process = Process(self._environment(), port=port, log=self.log, held=lock)
        try:
            process.wait()
            record = Kept(pid=process.pid, port=process.port)
            Files(self.folder).write_bytes(self._record, pretty(record))
        except BaseException:  # Ctrl-C, too, leaves none behind
            process.kill()
            raise
        return record, process

    @contextmanager
    def _held(self) -> Iterator[int | None]:
        """The lock, held while the body runs and by processes that inherit it; None if another has it."""
        with self._lock.open("ab") as held:
            try:
                fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                yield None
            else:
                yield held.fileno()

    def _environment(self) -> dict[str, str]:
        """Variables for a Prefect of its own, which reads and changes nothing of the user's."""
        own = {
            "PREFECT_HOME": str(self.folder), "PREFECT_UI_ENABLED": "true",
            "PREFECT_API_DATABASE_CONNECTION_URL": f"sqlite+aiosqlite:///{self.folder / DATABASE}",
            "PREFECT_UI_STATIC_DIRECTORY": str(self.folder / "pages"),
        }
        given = {name: value for name, value in os.environ.items() if name != "PREFECT_API_URL"}
        return _BOUNDED | given | own

    def _ends_within(self, seconds: float) -> bool:
        end = time.monotonic() + seconds
        while self.look().alive:
            if time.monotonic() > end:
                return False
            time.sleep(_POLL_S)
        return True
