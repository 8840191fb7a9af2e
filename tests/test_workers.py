"""Processes that work: what one of them suffers the others do not."""

import ctypes
import os
import re
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import polars as pl
import pytest
from support.processes import alive, eventually

from pitchlore.pipeline.base.errors import StorageFailed, WorkerLost
from pitchlore.pipeline.engine.placement.processes import Processes

pytestmark = pytest.mark.slow

HERE = Path(__file__).parent


def number(add=0):
    return os.getpid() + add


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


def test_processes_share_the_cores(monkeypatch):
    monkeypatch.setenv("POLARS_MAX_THREADS", "9")  # so that what it is set to is undone
    monkeypatch.delenv("POLARS_MAX_THREADS")
    monkeypatch.setattr("pitchlore.pipeline.engine.placement.executors.cores", lambda: 6)
    with Processes(3) as workers:
        assert workers.run(pl.thread_pool_size) == 2


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
