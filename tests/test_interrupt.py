"""Ctrl-C, kill, a server that fails: a command stops at any moment, says what is kept, and leaves no process behind."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import time
from contextlib import ExitStack, closing

import pytest
from support.processes import alive, eventually, pitchlore
from support.sessions import migrated
from support.terminal import terminal

from pitchlore.flows import serving
from pitchlore.flows.server import Keeper, database
from pitchlore.pipeline.engine import imports
from pitchlore.pipeline.store import Store

pytestmark = pytest.mark.slow

STOPPED = "pitchlore: Stopped. What was finished is kept; run the command again to go on.\r\n"
#: It takes 2 s at most; a busy machine may take longer, what hangs takes a minute.
SOON_S = 20.0

#: What a command is made to wait in for longer than any test.
MOMENTS = {
    "a task runs": """
import time, pitchlore.pipeline.engine.imports
def forever(*_): print("moment", flush=True); time.sleep(600)
pitchlore.pipeline.engine.imports.take_in = forever
""",
    "a file is written": """
import os, time
replace = os.replace
def forever(source, target):
    if str(target).endswith("receipt.json"): print("moment", flush=True); time.sleep(600)
    replace(source, target)
os.replace = forever
""",
    "a cluster is there": """
import distributed, time
wait_for = distributed.Client.wait_for_workers
def forever(*given, **named):
    wait_for(*given, **named)
    print("moment", flush=True)
    time.sleep(600)
distributed.Client.wait_for_workers = forever
""",
    "it is loaded": """
import time, pitchlore.flows.cli
def forever(): print("moment", flush=True); time.sleep(600)
pitchlore.flows.cli.command_line = forever
""",
    "a compiled module is loaded": """
import os, sys, tempfile, pitchlore.flows.cli
def forever():
    folder = tempfile.mkdtemp()
    with open(f"{folder}/compiled.py", "w") as file:
        file.write("import os, time\\nprint('moment', flush=True)\\n"
                   "try: time.sleep(600)\\nexcept KeyboardInterrupt: os.abort()\\n")
    sys.path.append(folder)
    import compiled
pitchlore.flows.cli.command_line = forever
""",
    "a library calls it an error": """
import time, pitchlore.flows.cli
def forever():
    print("moment", flush=True)
    try: time.sleep(600)
    except KeyboardInterrupt as error: raise ValueError("cannot serialize") from error
pitchlore.flows.cli.command_line = forever
""",
    "a compiled library makes a type": """
import polars as pl, pitchlore.flows.cli
from polars.datatypes import classes
table = pl.DataFrame({"a": ["a"]}, schema={"a": pl.Enum(["a"])})
def forever():
    code = classes.Enum.__init__.__code__
    wait = "def __init__(self, categories):\\n print('moment', flush=True)\\n import time; time.sleep(600)"
    made = {}
    exec(compile(wait, code.co_filename, "exec"), made)
    classes.Enum.__init__ = made["__init__"]
    print(table.dtypes)
pitchlore.flows.cli.command_line = forever
""",
    "it has a child": """
import multiprocessing, time, pitchlore.flows.cli
deaf = "import os, time; os.setsid(); print('moment', flush=True); time.sleep(600)"
def forever():
    multiprocessing.get_context("spawn").Process(target=exec, args=(deaf,)).start()
    time.sleep(600)
pitchlore.flows.cli.command_line = forever
""",
    "the main thread is deaf": """
import ctypes, pitchlore.pipeline.engine.catalog
def forever(*_):
    print("moment", flush=True)
    while True:
        try: ctypes.CDLL(None).sleep(600)
        except KeyboardInterrupt: pass
pitchlore.pipeline.engine.catalog.catalog.listing = forever
""",
    "a query runs": """
import threading
from pitchlore.pipeline.face import league
ask = league.ask
def told(*arguments):
    threading.Timer(0.5, print, ["moment"], {"flush": True}).start()  # into the query
    return ask(*arguments)
league.ask = told
""",
}


@pytest.fixture
def flow(derby, tmp_path, monkeypatch):
    """A data folder with a recording in its inbox, whose server finds a database; there is no other server."""
    data = tmp_path / "data"
    (data / "inbox").mkdir(parents=True)
    derby.rename(data / "inbox" / derby.name)
    migrated(Keeper(data).folder, database())
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    return data


def assert_stopped(command, presses=1):
    for _ in range(presses):
        command.press()
        time.sleep(0.2)
    assert command.end(SOON_S) == 130
    assert command.text.count(STOPPED) == 1
    assert "Traceback" not in command.text
    assert command.text.endswith(STOPPED)
    assert "nexpected" not in command.text
    assert "panicked" not in command.text
    assert command.left(SOON_S) == []


@pytest.mark.parametrize(("moment", "presses", "words", "there"), [
    ("a file is written", 2, ("run",), False), ("a file is written", 2, ("import", "{inbox}/derby.csv"), False),
    ("a file is written", 2, ("run", "--flow"), True),
    ("a task runs", 1, ("run", "--flow"), False), ("a cluster is there", 1, ("run", "--on", "dask:local:1"), False)])
def test_work_stops(flow, prefect_server, relayed, moment, presses, words, there):
    """Ctrl-C stops work between a file and its receipt; so it does in a flow, and a task that never ends.

    There is a server for one flow, and the other starts one.
    """
    server = {"PREFECT_API_URL": prefect_server} if there else relayed
    words = [word.format(inbox=flow / "inbox") for word in words]
    with terminal(*words, "--data", flow, before=MOMENTS[moment], environment=server) as command:
        command.until("moment")
        assert_stopped(command, presses)
    assert list(Store(flow).receipts("matches")) == []


def test_stop_while_starting(tmp_path):
    """Ctrl-C stops a flow while Prefect starts."""
    (tmp_path / "inbox").mkdir()
    with terminal("run", "--flow", "--data", tmp_path) as command:
        command.until("starting")
        time.sleep(1.0)
        assert_stopped(command)


@pytest.mark.parametrize(("moment", "words"), [
    *((moment, ("kb", "list")) for moment in (
        "it is loaded", "a compiled module is loaded", "a compiled library makes a type", "it has a child", "a library calls it an error")),
    ("the main thread is deaf", ("sql", "select 1")),
    ("a query runs", ("sql", "select count(*) from range(100000) a, range(100000) b, range(1000) c where ? is not null", "x"))])
def test_stop(finished, moment, words):
    """Ctrl-C is heard before anything slow is loaded, leaves no child behind, is no error of a library, and stops a query.

    Compiled code that returns to Python only to swallow the interrupt is ended after the grace.
    """
    with terminal(*words, "--data", finished, before=MOMENTS[moment]) as command:
        command.until("moment")
        assert_stopped(command)


def test_ignored_ctrl_c(finished):
    """A command that was started with SIGINT ignored goes on, as a shell's background jobs do."""
    ignoring = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); print('deaf', flush=True)"
    with terminal("kb", "list", "--json", "--data", finished, before=ignoring) as command:
        command.until("deaf")
        command.press()
        assert command.end(120.0) == 0


@pytest.mark.parametrize(("moment", "number", "code"), [
    ("starting", signal.SIGKILL, -signal.SIGKILL), ("moment", signal.SIGKILL, -signal.SIGKILL), ("moment", signal.SIGTERM, 143)])
def test_ended_command(flow, relayed, moment, number, code):
    """No process outlives a command that is killed, and so no server of its flow. SIGTERM ends one with a line."""
    server = {} if moment == "starting" else relayed
    with terminal("run", "--flow", "--data", flow, before=MOMENTS["a task runs"], environment=server) as command:
        command.until(moment)
        os.kill(command.process.pid, number)
        assert command.end(SOON_S) == code
        said = "pitchlore: Terminated. What was finished is kept; run the command again to go on." in command.text
        assert said == (number == signal.SIGTERM)
        assert command.left(SOON_S) == []


#: A command whose flow, when it would import a recording, stops its server and waits.
HANGS = """
import os, signal, time
import pitchlore.pipeline.engine.imports
from pitchlore.flows import serving
watched, servers = serving._watched, []
serving._watched = lambda url, own: servers.append(own.pid) or watched(url, own)
def wait(*_):
    os.kill(servers[0], signal.SIGSTOP)
    serving.WATCH_S, serving.REPLY_S = 0.2, 0.5
    print(servers[0], flush=True)
    time.sleep(600)
pitchlore.pipeline.engine.imports.take_in = wait
"""


def test_server_that_hangs_meanwhile(flow, relayed):
    """If its server hangs while flows run, the command ends within seconds, and the server with it."""
    words = pitchlore("run", "--flow", "--data", flow, before=HANGS)
    with subprocess.Popen(words, text=True, env=os.environ | relayed, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as command:
        assert command.stdout is not None
        number, begun = int(command.stdout.readline()), time.monotonic()
        _, err = command.communicate(timeout=60.0)
    assert time.monotonic() - begun < 15
    assert command.returncode == 1
    assert "Traceback" not in err
    assert err.rstrip().endswith("does not answer. What was finished is kept; run the command again to go on.")
    assert eventually(lambda: not alive(number), 5)


#: A command that waits, before it imports, until there is a file.
WAITS = """
import time
from pathlib import Path
from pitchlore.pipeline.engine import imports
take_in = imports.take_in
def waiting(*given, **named):
    print("moment", flush=True)
    while not Path({file!r}).exists(): time.sleep(0.02)
    return take_in(*given, **named)
imports.take_in = waiting
"""


@pytest.mark.parametrize("words", [["--flow"], []])
def test_two_at_once(flow, tmp_path, words):
    """The server that a command brings ends with it, and no other command depends on it; at their first use, too."""
    with ExitStack() as both:
        begun = []
        for number, how in enumerate((["--flow"], words)):
            begun.append(both.enter_context(terminal(
                "run", *how, "--data", flow, before=WAITS.format(file=str(tmp_path / f"go-{number}")))))
            begun[-1].until("moment")
        for number, command in enumerate(begun):
            (tmp_path / f"go-{number}").touch()
            assert command.end(60.0) == 0, command.text


def test_database_locked_meanwhile(flow, monkeypatch, call):
    """If another process locks Prefect's database while flows run, the command does not wait minutes for it."""
    monkeypatch.setattr(serving, "REQUEST_S", 1.0)
    monkeypatch.setattr(serving, "AGAIN", 1)
    monkeypatch.setattr("pitchlore.flows.server.STOP_S", 0.5)
    with closing(sqlite3.connect(flow / "server" / database(), check_same_thread=False)) as other:
        locked: list[float] = []

        def lock(*_: object) -> None:
            other.execute("begin immediate")
            locked.append(time.monotonic())
            raise ValueError("refused")

        monkeypatch.setattr(imports, "take_in", lock)
        code, _, err = call("run", "--flow", "--data", flow)
    assert time.monotonic() - locked[0] < 15
    assert code == 1
    assert "Traceback" not in err
    assert "the Prefect server failed (ReadTimeout: timed out" in err
    assert err.endswith("What was finished is kept; run the command again to go on.\n")
