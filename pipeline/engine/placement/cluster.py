"""The workers of a Dask cluster: one for this command, or one that others keep.

Only this package imports distributed. Workers need neither Prefect's server nor its settings: Prefect's tasks
stay in the command's process, and wait there for the work of theirs (docs/decisions/processes.md, "Where work
is done", has what was measured).
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Lock
from typing import Any, ParamSpec, TypeVar

import dask
from distributed import Client, Future, LocalCluster
from distributed.comm.core import CommClosedError
from distributed.scheduler import KilledWorker
from distributed.security import Security

from pitchlore.pipeline.base.errors import ClusterFailed, PitchloreError, WorkerLost
from pitchlore.pipeline.base.system import locked, undisturbed
from pitchlore.pipeline.engine.child import hold_threads
from pitchlore.pipeline.engine.placement.executors import Executors
from pitchlore.pipeline.engine.placement.identity import first_difference, identity
from pitchlore.pipeline.engine.placement.processes import start_tracker
from pitchlore.pipeline.store.buckets import Bucket
from pitchlore.pipeline.store.mirrors import Mirror, ObjectChange, located, mirror_of
from pitchlore.pipeline.store.temporaries import temporary_beside

P = ParamSpec("P")
R = TypeVar("R")

#: How long a scheduler may take to answer, and a cluster to have its first worker, seconds.
ANSWER_S, WORKER_S = 5, 10
#: How long the scheduler may take to miss a worker that has ended, and how often to ask meanwhile, seconds.
GONE_S, _POLL_S = 5.0, 0.2
_SETTINGS = {
    "distributed.comm.timeouts.connect": ANSWER_S,
    "distributed.worker.daemon": True,
    "distributed.scheduler.http.routes": [],  # a page without a password
    "distributed.worker.http.routes": [],
    # the library's own words for what our errors say in one line
    "distributed.logging.distributed": "critical",
    "distributed.admin.large-graph-warning-threshold": "1GB",
}


class Cluster:
    """The workers of a Dask cluster. A worker that dies loses nothing: others do its work again.

    Args:
        client: connected to the scheduler.
        address: address of the scheduler, for errors.
        mirror: copy of the data folder, if that is in a bucket. Then workers need not see it: each has
            a copy of its own, and what a worker writes is told to the copy here.
    """

    def __init__(self, client: Client, address: str, mirror: Mirror | None = None) -> None:
        self._client = client
        self._address = address
        self._mirror = mirror
        self._moment = ""

    @property
    def width(self) -> int:
        """Number of threads of all workers, now.

        Raises:
            ClusterFailed: if the scheduler has ended.
        """
        try:
            return max(1, sum(self._client.nthreads().values()))  # type: ignore[no-untyped-call]
        except Exception as error:
            raise self._ended() from error

    def for_pieces(self, count: int) -> Executors:
        """The same."""
        return self

    def path(self, path: Path) -> Path:
        """The absolute path: workers are in folders of their own. In a bucket, the URL.

        Workers bring their copies of the bucket up to date before they do the work that is given from now on.
        """
        local = located(path)
        if self._mirror is None or not local.is_relative_to(self._mirror.folder):
            return local.resolve()
        self._moment = os.urandom(8).hex()
        return Path(self._mirror.where(local))

    def run(self, work: Callable[P, R], *arguments: P.args, **named: P.kwargs) -> R:
        """Do a task on one of the workers (:meth:`pipeline.engine.placement.executors.Executors.run`).

        Raises:
            ClusterFailed: if the scheduler ends, or if the worker has other code than this process.
        """
        future: Future[tuple[R, list[ObjectChange]]] | None = None
        bucket = None if self._mirror is None else (self._mirror.url, self._moment)
        try:
            future = self._client.submit(_call, identity(), bucket, work, arguments, named, pure=False)
            result, changes = future.result()
        except KilledWorker as error:
            raise WorkerLost(
                f"{error.allowed_failures + 1} workers that did this were killed, perhaps for lack of memory",
                where=self._address, next_step="Look at the logs of the workers",
            ) from error
        except Exception as error:
            if future is not None and future.status == "error":
                if self._mirror is not None:
                    self._mirror.sync()  # it may have written something before
                raise  # the work's own
            raise self._ended() from error
        if self._mirror is not None:
            self._mirror.learn(changes)
        return result

    def _ended(self) -> ClusterFailed:
        return ClusterFailed("the Dask scheduler has ended", where=self._address, next_step=(
            "Start it and its workers, and run the command again; finished work is kept"))


#: At a worker: the last moment of its copy, by URL.
_moments: dict[str, str] = {}
_syncing = Lock()


@contextmanager
def open_cluster(address: str, width: int, root: Path) -> Iterator[Cluster]:
    """A cluster's workers, after a check that they can do the work of this command.

    Args:
        address: the scheduler's, as tcp://host:port; empty for a cluster of processes for this command, which
            listen on loopback only, to who has a certificate that was made for it.
        width: number of these processes.
        root: the data folder; all workers have to see it under this path.

    Raises:
        ClusterFailed: if no scheduler answers, if it has no workers, or if one of these has other code, does
            not see the data folder, or does not respect its locks.
    """
    dask.config.set(_SETTINGS)
    for name in ("distributed", *logging.root.manager.loggerDict):
        if name.partition(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        if address:  # TLS, if Dask's settings of this machine say so
            address = f"{dask.config.get('distributed.comm.default-scheme')}://{address.rpartition('/')[2]}"
            client = stack.enter_context(_connected(address))
        else:
            hold_threads()
            start_tracker()
            # else any account of this machine could let the cluster run code
            closed = Security.temporary()  # type: ignore[no-untyped-call]
            try:
                with undisturbed():
                    local = stack.enter_context(LocalCluster(
                        n_workers=width, threads_per_worker=1, processes=True, host="127.0.0.1",
                        protocol="tls://", dashboard_address="127.0.0.1:0",
                        scheduler_kwargs={"dashboard": False}, security=closed, silence_logs=logging.CRITICAL,
                    ))  # type: ignore[no-untyped-call]
            except RuntimeError as error:  # as when one of its processes is killed
                raise ClusterFailed("the Dask workers of this command did not start", where="dask:local",
                                    next_step="Run the command again") from error
            client = stack.enter_context(Client(local, set_as_default=False))  # type: ignore[no-untyped-call]
        where = address or "dask:local"
        try:
            client.wait_for_workers(1, timeout=WORKER_S)
        except TimeoutError as error:
            raise ClusterFailed("the Dask scheduler has no workers", where=where,
                                next_step=f"Start some: dask worker {where}") from error
        mirror = mirror_of(root)
        _check(client, mirror or root, where)
        yield Cluster(client, where, mirror)


def _connected(address: str) -> Client:
    try:
        return Client(address, timeout=ANSWER_S, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, TimeoutError, ValueError) as error:
        raise ClusterFailed("no Dask scheduler answers", where=address,
                            next_step="Start one (dask scheduler), and its workers (dask worker)") from error


def _check(client: Client, place: Path | Mirror, where: str) -> None:
    """Check that all workers have the code of this process, and share its bucket, or its folder and locks."""
    wanted = os.urandom(16)
    root = place.resolve() if isinstance(place, Path) else place.url
    shown = _in_folder(place, wanted) if isinstance(place, Path) else _in_bucket(place, wanted)
    with shown as (look, *token):
        answers = _answers(client, look, *token)
    for worker, answer in answers.items():
        said = f"worker {worker} of {where}"
        if isinstance(answer, Exception):
            raise ClusterFailed(f"cannot work ({type(answer).__name__}: {answer})", where=said,
                                next_step="See that it runs, with this version of Pitchlore, and call again")
        theirs, seen, held = answer
        if (other := first_difference(theirs, identity())) is not None:
            raise ClusterFailed("has other code ({} {}, here {})".format(*other), where=said, next_step=(
                "Install the same version of Pitchlore and its packages there, and start the worker again"))
        if seen != wanted:
            raise ClusterFailed(f"does not see the data folder {root}", where=said, next_step=(
                "Mount it there under the same path, or take a bucket; workers need its credentials"))
        if not held:
            raise ClusterFailed(f"does not respect the locks of {root}", where=said, next_step=(
                "Mount the disk there so that flock works between machines, or take a bucket"))


def _answers(client: Client, look: Callable[..., Any], *token: Any) -> Mapping[str, Any]:
    """Answers of all workers. If one ends meanwhile, they are asked again until the scheduler misses it."""
    patience = time.monotonic() + GONE_S
    while True:
        answers: Mapping[str, Any] = client.run(look, *token, on_error="return")
        ended = any(isinstance(answer, CommClosedError) for answer in answers.values())
        if not ended or time.monotonic() > patience:
            return answers
        time.sleep(_POLL_S)


@contextmanager
def _in_folder(root: Path, wanted: bytes) -> Iterator[tuple[Any, ...]]:
    """A locked file with some bytes in a data folder, and how a worker looks at it."""
    root.mkdir(parents=True, exist_ok=True)
    token = temporary_beside(root / "token", "tmp")
    try:
        with token.open("wb") as held:
            held.write(wanted)
            held.flush()
            with locked(held, alone=True):
                yield _look, str(token.resolve())
    finally:
        token.unlink(missing_ok=True)


@contextmanager
def _in_bucket(mirror: Mirror, wanted: bytes) -> Iterator[tuple[Any, ...]]:
    """An object with some bytes in a bucket, and how a worker looks at it."""
    key = f".token-{wanted.hex()}"
    mirror.bucket.put(key, wanted)
    try:
        yield _look_into, mirror.url, key
    finally:
        mirror.bucket.delete(key)


def _look_into(url: str, key: str) -> tuple[dict[str, str], bytes | None, bool]:
    """The answer of a worker: its code, what it sees in an object, and that nobody needs locks there."""
    found = None
    with suppress(PitchloreError):
        found = Bucket(url).get(key)
    return identity(), None if found is None else found[0], True


def _look(token: str) -> tuple[dict[str, str], bytes | None, bool]:
    """The answer of a worker: its code, what it sees in a file, and whether that is locked for it."""
    seen, held = None, True
    with suppress(OSError), open(token, "rb") as file:  # noqa: PTH123 (a path of another machine is a text)
        seen = file.read()
        with suppress(BlockingIOError), locked(file, alone=False):
            held = False
    return identity(), seen, held


def _call(
    caller: dict[str, str], bucket: tuple[str, str] | None, work: Callable[..., R],
    arguments: tuple[Any, ...], named: Mapping[str, Any],
) -> tuple[R, list[ObjectChange]]:
    """Do a piece of work on a worker, which may have come after the check.

    Args:
        caller: the identity of its code.
        bucket: the URL of the data folder, and a moment, if it is in one.
        work: the task.
        arguments: its positional arguments.
        named: its named arguments.

    Returns:
        The result, and what was written to the bucket.

    Raises:
        ClusterFailed: if it has other code than the caller.
    """
    if (other := first_difference(identity(), caller)) is not None:
        raise ClusterFailed("a worker has other code than the command ({} {}, there {})".format(*other),
                            next_step="Install the same version there, and start it again")
    if bucket is None:
        return work(*arguments, **named), []
    url, moment = bucket
    mirror = mirror_of(located(Path(url)))
    assert mirror is not None
    with _syncing:
        if _moments.get(url) != moment:
            mirror.sync()
            _moments[url] = moment
    with mirror.journal() as changes:
        return work(*arguments, **named), changes
