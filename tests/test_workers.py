"""Processes that work: what one of them suffers the others do not."""

import ctypes
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import _threads_wakeups
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from support.processes import alive, eventually
from threadpoolctl import threadpool_info

from pitchlore.pipeline.base.errors import StorageFailed, WorkerLost
from pitchlore.pipeline.engine import child
from pitchlore.pipeline.engine.placement import processes
from pitchlore.pipeline.engine.placement.processes import Processes, WhenWorthwhile

pytestmark = pytest.mark.slow

HERE = Path(__file__).parent


def number(add=0):
    return os.getpid() + add


def slowly(seconds):
    time.sleep(seconds)
    return os.getpid()


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def fail():
    raise ValueError("no")


def refuse():
    raise StorageFailed("cannot be written", where="m.parquet", next_step="Free space")


def wait(file):
    Path(file).write_text(str(os.getpid()))
    time.sleep(60)


def wait_as_a_run(file):
    import pitchlore.flows.scheduled  # noqa: F401 (what Prefect unpickles first in the process of a run)

    wait(file)


def test_one_job():
    """With one job all work is done in this process."""
    with Processes(1) as workers:
        assert workers.run(number, add=1) == os.getpid() + 1
        with pytest.raises(ValueError, match="no"):
            workers.run(fail)
        assert workers.run(number) == os.getpid()


def test_here():
    """This process is one of the two, and the first to work."""
    with Processes(2, here=True) as workers:
        assert [workers.run(number) == os.getpid() for _ in range(3)] == [True, False, True]


def test_error_of_another_process():
    """An error of ours comes back from another process as itself."""
    with Processes(2) as workers, pytest.raises(StorageFailed) as refused:
        workers.run(refuse)
    assert str(refused.value) == "m.parquet: cannot be written. Free space."
    assert refused.value.transient


def test_killed_process(tmp_path):
    """A killed process takes only its own work with it."""
    with Processes(2) as workers, ThreadPoolExecutor(2) as threads:
        slow = threads.submit(workers.run, time.sleep, 2)
        with pytest.raises(WorkerLost, match=r"was killed.*--on"):
            workers.run(die)
        others = {workers.run(number) for _ in range(2)}
        slow.result()
    assert os.getpid() not in others


#: Runs a command, and says how many threads libraries have in it.
_THREADS_OF = """
import sys
from pitchlore.flows.cli import main
try:
    main(sys.argv[1:])
except SystemExit:
    from test_workers import threads
    print(*threads())
"""


def threads():
    """Threads of polars, and the most of any library of numpy's in this process."""
    assert np.eye(2).sum() == 2
    return pl.thread_pool_size(), max(pool["num_threads"] for pool in threadpool_info())


@pytest.mark.parametrize(("place", "expected"), [
    ((), "1 1"), (("--on", "processes:1"), "1 1"), (("--on=threads:2",), "2 2")])
def test_libraries_have_the_threads_of_the_place(tmp_path, place, expected):
    """Libraries have one thread in a command and in its processes, and as many as there are threads to work in."""
    env = {name: value for name, value in os.environ.items() if not name.endswith("_THREADS") and name != "PITCHLORE_ON"}
    done = subprocess.run([sys.executable, "-c", _THREADS_OF, "runs", *place, "--data", tmp_path], capture_output=True, text=True,
                          env=env | {"PYTHONPATH": f"{HERE.parent}:{HERE}"}, check=True)
    assert done.stdout.splitlines()[-1] == expected


def test_a_process_takes_one_core(monkeypatch):
    """Libraries have one thread in each process, if nobody said otherwise."""
    for name in child._THREADS:  # a command that was called here has set them
        monkeypatch.delenv(name, raising=False)
    with Processes(2) as workers:
        assert workers.run(threads) == (1, 1)


def test_processes_that_are_not_worthwhile(monkeypatch):
    """Pieces are done here until they have taken some seconds, and none is done here of many."""
    monkeypatch.setattr(processes, "HERE_S", 0.5)
    with WhenWorthwhile(2) as few, ThreadPoolExecutor(2) as threads:
        assert few.for_pieces(3) is few
        assert few.run(number) == os.getpid()
        slow = threads.submit(few.run, slowly, 1.0)
        time.sleep(0.1)
        assert few.run(number) != os.getpid(), "it waited for half a second"
        assert slow.result() == os.getpid()
        assert few.run(number) != os.getpid(), "it has worked long enough"
    with WhenWorthwhile(2) as many:
        assert many.for_pieces(processes.MANY).run(number) != os.getpid()


#: What a process is made to do for ever, by who made it: a command, or `serve` (as Prefect does it).
FOR_EVER = {
    "a command": "from pitchlore.pipeline.engine.placement.processes import Processes; from test_workers import wait\n"
                 "if __name__ == '__main__': Processes(2).run(wait, {0!r})",
    "serve": "import multiprocessing; from test_workers import wait_as_a_run\n"
             "if __name__ == '__main__': multiprocessing.get_context('spawn').Process(\n"
             "    target=wait_as_a_run, args=({0!r},)).start()",
}


@pytest.mark.parametrize("parent", FOR_EVER)
def test_killed_parent(tmp_path, parent):
    """Processes end with the one that started them, even if that is killed."""
    script = FOR_EVER[parent].format(str(tmp_path / "pid"))
    (tmp_path / "main.py").write_text(script)
    process = subprocess.Popen([sys.executable, tmp_path / "main.py"],
                               env={**os.environ, "PYTHONPATH": f"{HERE.parent}:{HERE}"})
    worker = int(eventually(lambda: (tmp_path / "pid").exists() and (tmp_path / "pid").read_text()))
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert eventually(lambda: not alive(worker))


#: Keeps a few of many pieces, so that what lies between them is free and no heap can shrink.
_PIECES = """
import re
from pitchlore.pipeline.base.system import give_back
def held():
    return int(re.search(r"RssAnon:\\s+(\\d+)", open("/proc/self/status").read()).group(1)) / 1000
pieces = [bytearray(100_000) for _ in range(2_000)]
kept = pieces[::50]
before = held()
del pieces
freed = held()
give_back()
print(before, freed, held())
"""


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "malloc_trim"), reason="not glibc")
def test_memory_is_given_back():
    """Memory that a process has freed in pieces goes back to the system; freeing alone keeps it."""
    said = subprocess.run([sys.executable, "-c", _PIECES], capture_output=True, text=True, check=True,
                          cwd=Path(__file__).parents[1])
    before, freed, now = map(float, re.findall(r"[\d.]+", said.stdout))
    assert freed > before - 50, "the control: it is kept"
    assert now < before - 150, "of 200 MB"


def test_pools_are_closed():
    """No pool closes after its work is done: Python, which ends meanwhile, would print a traceback."""
    with Processes(3) as workers:
        assert workers.run(os.getpid) != os.getpid()
    assert not any(thread.is_alive() for thread in _threads_wakeups)
