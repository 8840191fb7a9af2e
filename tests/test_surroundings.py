"""Words, encodings and limits of a command: one line, or an answer; no traceback, no surrogate printed."""

import os
import subprocess

import numba
import pytest
from numba.core.caching import CacheImpl
from support.outputs import put_goal
from support.processes import pitchlore

from pitchlore.flows.cli import _unforeseen
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.store import Store

C = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
ODD = os.fsdecode(b"\xff")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A data folder with a name that is no ASCII."""
    data = tmp_path_factory.mktemp("surroundings") / "é日"
    put_goal(Store(data), "m-1", 1)
    refresh(Store(data))
    return data


@pytest.mark.parametrize(("words", "environment", "out", "err"), [
    (("sql", f"select {ODD}"), {}, "", "pitchlore: select \\xff: is not UTF-8. Write it in UTF-8, or name what is there.\n"),
    (("sql", "select ?", ODD), {}, "", "pitchlore: \\xff: is not UTF-8. Write it in UTF-8, or name what is there.\n"),
    ((f"k{ODD}",), {}, "", "pitchlore: k\\xff: is not UTF-8. Write it in UTF-8, or name what is there.\n"),
    (("sql", "select 'é┃日' as x", "--csv"), C, "x\né┃日\n", ""),
    (("sql", "select '日' as x", "--csv"), {"PYTHONIOENCODING": "latin-1"}, "",
     "pitchlore: standard output: its encoding latin-1 has no '\\u65e5'. Set PYTHONIOENCODING=utf-8, or ask with --json.\n"),
    (("sql", "select '日' as x", "--json"), {"PYTHONIOENCODING": "latin-1"}, '[\n {\n  "x": "\\u65e5"\n }\n]\n', ""),
])
def test_encodings(data, words, environment, out, err):
    """A word that is no text is refused; output that an encoding cannot hold is not printed otherwise."""
    done = subprocess.run(pitchlore(*words, "--data", data), capture_output=True, env={**os.environ, **environment})
    assert (done.stdout.decode(), done.stderr.decode(), done.returncode) == (out, err, int(not out))


def test_odd_names(call, tmp_path, derby):
    """A recording whose name is no UTF-8 is read all the same."""
    file = derby.rename(tmp_path / f"m{ODD}.csv")
    assert call("import", file, "--data", tmp_path / "data")[0] == 0


@pytest.mark.parametrize(("limit", "said"), [
    ("-v 2000000", "ulimit -v: allows 2.0 GB of address space. Allow 4 GB"),
    ("-u 8", "ulimit -u: allows 8 processes and threads, and 32 more cannot be started. Allow more"),
])
def test_limits(data, limit, said):
    """A limit by which libraries would end the process is one line."""
    before = "import pitchlore.flows.surroundings as s; s._can_start = lambda _: False\n"  # root has no such limit
    command = pitchlore("sql", "select 1", "--data", data, before=before)
    done = subprocess.run(["bash", "-c", f'ulimit {limit}; exec "$@"', "bash", *command], capture_output=True, text=True)
    assert done.stderr.startswith(f"pitchlore: {said}"), done.stderr
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)


def test_no_more_threads():
    """Threads and processes that cannot be started later are one line, too."""
    for error in (RuntimeError("can't start new thread"), BlockingIOError(11, "Resource temporarily unavailable")):
        assert _unforeseen(error).startswith("no more processes or threads may be started (")


def test_no_home(monkeypatch):
    """Where neither the code's folder nor a home may be written, compiled functions cannot be kept: one line with a cure."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", "/proc/nowhere")
    monkeypatch.setattr(CacheImpl, "_locator_classes", CacheImpl._locator_classes[:1])
    with pytest.raises(RuntimeError) as raised:
        numba.njit(cache=True)(test_no_home)
    for error in (raised.value, RuntimeError("Could not determine home directory.")):  # the latter is Python's
        assert "Set HOME or XDG_CACHE_HOME to a folder" in _unforeseen(error)
