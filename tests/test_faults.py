"""Faults outside are said in one line, and soon: disks, homes, databases and servers.

The same command works when the cause is gone.
"""

from __future__ import annotations

import logging
import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from threading import Thread

import pytest
from conftest import run
from hostile.make import DERBY
from support.outputs import put_goal
from support.processes import pitchlore
from support.terminal import terminal

from pitchlore.flows import scheduled, serving
from pitchlore.flows.cli import main
from pitchlore.flows.server import Keeper, ServerFailed, database, trouble
from pitchlore.pipeline.base.errors import StillWritten, StorageFailed
from pitchlore.pipeline.engine import catalog, matches
from pitchlore.pipeline.engine.catalog import refresh
from pitchlore.pipeline.engine.imports import import_all
from pitchlore.pipeline.engine.matches import take_in
from pitchlore.pipeline.engine.progress import RunReport
from pitchlore.pipeline.engine.recordings import Recording
from pitchlore.pipeline.engine.verify import verify_all
from pitchlore.pipeline.importers.source import SourceFile
from pitchlore.pipeline.settings import KnowledgeSettings, Settings
from pitchlore.pipeline.store import Store, locks, sealed

pytestmark = pytest.mark.slow

#: A command has to have ended by then, seconds; here it shares the machine with other tests.
SOON_S = 60.0


@contextmanager
def room(kib: int) -> Iterator[None]:
    """No file may grow beyond so many KiB: like a full disk, for a test that may not fill one. (Python ignores SIGXFSZ.)"""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (kib << 10, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def lines(err: str) -> list[str]:
    """Output of a command, without its progress bars."""
    return [line for line in err.splitlines() if "━" not in line and line.strip()]


# --- the process ------------------------------------------------------------------------------------


def test_leaves_at_once(tmp_path):
    """A command does not unwind threads that run on: those in compiled code would abort it."""
    script = """
import atexit, sys, threading, time
import pitchlore.flows.cli
def said(*_):
    threading.Thread(target=time.sleep, args=(600,), daemon=True).start()
    atexit.register(print, "cleared up")
    class Last:
        def __del__(self, write=sys.stdout.write): write("unwound")
    sys.kept = Last()
    sys.exit(0)
pitchlore.flows.cli.main = said
pitchlore.flows.cli.script()
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=SOON_S, check=True)
    assert done.stdout == "cleared up\n"


@pytest.mark.parametrize("closed", [(0,), (1,), (2,), (0, 1, 2)])
def test_closed_streams(tmp_path, closed):
    """Where a standard stream is closed, no file gets its number, and the command does its work."""

    def close() -> None:
        for number in closed:
            os.close(number)

    here = ("import os; from pitchlore.flows.cli import main\n"
            "import pitchlore.flows.cli\n"
            "pitchlore.flows.cli._call = lambda *_, **__: open(os.environ['TOLD'], 'w').write(' '.join(\n"
            "    str(os.fstat(n).st_rdev == os.stat('/dev/null').st_rdev) for n in range(3)))\n"
            "main([])")
    reported = tmp_path / "told"
    subprocess.run([sys.executable, "-c", here], check=True, preexec_fn=close, timeout=SOON_S,
                   env=os.environ | {"TOLD": str(reported)})
    found = reported.read_text().split()
    assert [found[number] for number in closed] == ["True"] * len(closed)


def test_working_directory(tmp_path, derby, monkeypatch):
    """Modules of the folder in which a command is called are not loaded; of one that ends well no process is left.

    That Prefect's home is no folder is nothing to it.
    """
    for name in ("uvicorn", "json", "prefect", "multiprocessing", "pipeline", "pitchlore"):
        (tmp_path / f"{name}.py").write_text(f"import pathlib; pathlib.Path('{name}-was-here').touch()")
    (tmp_path / "flows").mkdir()
    (tmp_path / "flows" / "__init__.py").touch()
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    with terminal("import", "--isolate", derby, "--data", "data", folder=tmp_path,
                  environment={"PREFECT_HOME": "/dev/null"}) as command:
        assert command.end(300.0) == 0
        assert "derby-" in command.text
        assert "pitchlore: " not in command.text
        assert command.left(20.0) == []
    assert not list(tmp_path.glob("*-was-here"))
    assert len(list(Store(tmp_path / "data").receipts("matches"))) == 1


# --- disks ------------------------------------------------------------------------------------------


def test_catalogue_on_a_full_disk(tmp_path, call):
    """A catalogue that cannot be written is one line, leaves nothing behind, and stays as it was."""
    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    refresh(store)
    put_goal(store, "m-2", 1)
    words = ("sql", "select count(*) n from goals", "--csv", "--data", tmp_path)
    with room(64):
        code, out, err = call(*words)
    assert (code, out) == (1, "")
    (line,) = lines(err)
    assert line.startswith(f"pitchlore: {tmp_path / 'catalog.duckdb'}: cannot be written (")
    assert "Free space or mend the folder" in line
    assert [path.name for path in tmp_path.glob(".*.tmp*")] == []
    assert call(*words)[:2] == (0, "n\n2\n")


def test_log_on_a_full_disk(tmp_path, call):
    """So is a match that cannot be logged."""
    with room(64):
        code, _, err = call("record", "--minutes", "0.5", "--data", tmp_path)
    assert code == 1
    assert "cannot be written (File too large). Free space" in lines(err)[-1]


def test_catalogue_without_room(tmp_path):
    """Wherever room runs out, a catalogue is whole or refused: DuckDB itself closes one without its tables."""
    found = set()
    for kib in range(64, 1_000, 96):
        path = tmp_path / f"{kib}.duckdb"
        with room(kib):
            try:
                catalog.catalog.build(path, {})
            except OSError:
                found.add("refused")
            else:
                found.add("built" if catalog.catalog.listing(path) is not None else f"broken at {kib} KiB")
    assert found == {"refused", "built"}


def test_a_folder_that_cannot_be_written(tmp_path, monkeypatch):
    """A data folder without write access is queried like any other, if its catalogue is up to date."""
    store = Store(tmp_path)
    put_goal(store, "m-1", 1)
    refresh(store)
    for lock in (".lock", ".commits"):
        (tmp_path / lock).unlink()
    opened = Path.open

    def refused(path: Path, mode: str = "r", *rest: object, **named: object):
        if path.is_relative_to(tmp_path) and mode[0] in "wa":
            raise OSError(30, "Read-only file system")
        return opened(path, mode, *rest, **named)

    monkeypatch.setattr(Path, "open", refused)
    assert refresh(store)[1] == []
    with pytest.raises(StorageFailed, match="Read-only file system"):
        put_goal(store, "m-2", 1)


# --- Prefect's home and database --------------------------------------------------------------------


def damaged(file: Path) -> None:
    file.write_bytes(b"no database" * 1000)


def bitten(file: Path) -> None:
    with closing(sqlite3.connect(file, isolation_level=None)) as connection:
        connection.execute("begin")
        connection.execute("create table t (a text, b text)")
        connection.executemany("insert into t values (?, ?)", [(f"x{i}", f"{i * 7919 % 2000:050}") for i in range(2000)])
        connection.execute("create index i on t (b)")
        connection.execute("commit")
    with file.open("r+b") as opened:
        opened.seek(3 * 4096)
        opened.write(b"\xff" * 20_000)


@pytest.mark.parametrize(("harm", "said"), [(damaged, "not a database"), (bitten, "damaged|malformed")])
def test_damaged_database(tmp_path, harm, said):
    """A damaged database of Prefect's is reported before a server starts, with what to do."""
    keeper = Keeper(tmp_path)
    keeper.folder.mkdir()
    assert trouble(keeper.folder / database()) is None
    harm(keeper.folder / database())
    with pytest.raises(ServerFailed, match=rf"({said}).*remove {database()} in it: only the history") as refused:
        keeper.start()
    assert str(keeper.folder) in str(refused.value)
    assert keeper.look() is None


def test_locked_database(tmp_path):
    """So is one that another process has locked for good."""
    file = tmp_path / database()
    with closing(sqlite3.connect(file, isolation_level=None)) as other:
        other.execute("begin exclusive")
        begun = time.monotonic()
        assert trouble(file) == f"{file.name} cannot be used (database is locked)"
        assert time.monotonic() - begun < 10
    assert trouble(file) is None


class Greeting(BaseHTTPRequestHandler):
    """Answers as a server of Prefect's does."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("content-type", "application/json")
        self.send_header("content-length", "2")
        self.end_headers()
        self.wfile.write(b"{}")

    def log_message(self, *_: object) -> None:
        pass


def test_server_that_ends_meanwhile(monkeypatch):
    """If a server ends while flows run, the command ends with a line."""
    ended: Queue[tuple[object, ...]] = Queue()
    for name, value in (("end", lambda *said: ended.put(said)), ("WATCH_S", 0.05), ("SILENT", 3)):
        monkeypatch.setattr(serving, name, value)
    greeter = ThreadingHTTPServer(("127.0.0.1", 0), Greeting)
    Thread(target=greeter.serve_forever).start()
    url = f"http://127.0.0.1:{greeter.server_port}/api"
    with serving.serving(url):
        with pytest.raises(Empty):
            ended.get(timeout=0.5)
        greeter.shutdown()
        greeter.server_close()
        assert ended.get(timeout=SOON_S) == (f"The Prefect server {url} does not answer", 1)


def test_version_that_cannot_be_made(copied, monkeypatch):
    """Knowledge that cannot be made is one more failure of a run; the others are still in its report."""
    (copied / "inbox" / "empty.csv").write_bytes(b"")

    def full(*_: object, **__: object) -> None:
        raise StorageFailed("cannot be written (No space left on device)", where="knowledge")

    monkeypatch.setattr(Store, "commit_version", full)
    report = run(copied, settings=Settings(knowledge=KnowledgeSettings(state_key="ego19")))
    assert report.failures.keys() == {f"matches {copied}/inbox/empty.csv", "knowledge version"}
    assert report.stage("policies").failed == {}


def test_waiting_is_said(tmp_path, monkeypatch, caplog):
    """A command that waits long for another's lock says so, and goes on when it is free."""
    monkeypatch.setattr(locks, "PATIENCE_S", 0.05)
    monkeypatch.setattr(logging.getLogger("pitchlore"), "propagate", True)
    store, done = Store(tmp_path), []
    waiting = Thread(target=lambda: done.append(put_goal(store, "m-1", 1)))
    with store.removing():
        waiting.start()
        waiting.join(0.5)
        assert done == []
        assert f"{tmp_path}: waiting until another command lets go of it" in caplog.text
    waiting.join()
    assert done


@pytest.mark.parametrize("words", [["sql", "select 1"], ["sql", "select 1", "--json"]])
def test_full_standard_output(finished, words):
    """Output that has no room is said in one line."""
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(pitchlore(*words, "--data", finished), stdout=full, text=True,
                              stderr=subprocess.PIPE, check=False, timeout=SOON_S)
    assert done.returncode == 1
    assert done.stderr == (
        "pitchlore: standard output: cannot be written (No space left on device). Free space or name another.\n")


def test_devices_are_not_replaced(finished, tmp_path, call):
    """A page, a film or an export never takes the place of a device or pipe."""
    os.mkfifo(pipe := tmp_path / "pipe")
    code, _, err = call("replay", "early", "-o", pipe, "--data", finished)
    assert (code, "is no regular file, and is not replaced by one. Name a file." in err, pipe.is_fifo()) == (1, True, True)


@pytest.mark.parametrize("whole", [True, False])
def test_half_a_copy(derby, tmp_path, monkeypatch, whole):
    """A recording that is still being copied is neither kept nor refused; when it is complete, it is imported."""
    store, complete, open_ = Store(tmp_path / "data"), derby.read_bytes(), matches.open_parts

    def meanwhile(*arguments: object) -> SourceFile:
        found = open_(*arguments)
        derby.write_bytes(complete)
        return found

    derby.write_bytes(complete[:len(complete) // 2] if whole else b"frame,t,team,player,x,y\n0,0,ba")
    monkeypatch.setattr(matches, "open_parts", meanwhile)
    with pytest.raises(StillWritten, match="the next run takes it"):
        take_in(store, Recording(file=derby))
    monkeypatch.undo()
    assert [list(store.receipts("matches")), store.quarantined()] == [[], []]
    assert take_in(store, Recording(file=derby))[1]


def test_half_a_copy_that_stood_still(derby, tmp_path, monkeypatch):
    """Half a recording that was taken for a whole one is named when the whole one comes, and can be forgotten."""
    store, data = Store(tmp_path / "data"), derby.read_bytes()
    monkeypatch.setattr(sealed, "_TICK_NS", 0)  # the file is old
    derby.write_bytes(data[:data.rindex(b"\n", 0, len(data) // 2) + 1])
    (half,) = import_all(store, [Recording(file=derby)]).made
    derby.write_bytes(data)
    report = import_all(store, [Recording(file=derby)])
    assert len(report.made) == 1
    line = f"{derby}: a part of it was imported as {half}, before it was whole: `pitchlore forget {half}` removes that."
    assert line in report.notes
    assert line in scheduled.said_of(RunReport(stages=[report]))
    os.utime(derby)
    assert import_all(store, [Recording(file=derby)]).notes == []
    derby.write_bytes(data.replace(b"0.1", b"0.2") + b"\n")
    assert not any("a part of it" in note for note in import_all(store, [Recording(file=derby)]).notes)


def test_a_recording_written_over(derby, tmp_path, monkeypatch):
    """Another recording in the same file, of the same size and time, as `cp -p` leaves it, is imported, too."""
    store, seen = Store(tmp_path / "data"), derby.stat()
    monkeypatch.setattr(sealed, "_TICK_NS", 0)  # the file is old
    assert [len(import_all(store, [Recording(file=derby)]).made) for _ in "ab"] == [1, 0]
    with derby.open("r+b") as file:
        file.write(derby.read_bytes().replace(b"0.1", b"0.2"))
    os.utime(derby, ns=(seen.st_atime_ns, seen.st_mtime_ns))
    assert len(import_all(store, [Recording(file=derby)]).made) == 1


#: Stops itself at its first commit of a situation, as by SIGSTOP or a machine that is suspended.
STANDS_STILL = """
import os, signal
replace = os.replace
def still(source, target):
    if "/situations/" in str(target) and "receipt" in str(target):
        os.replace = replace
        print("still", flush=True)
        os.kill(os.getpid(), signal.SIGSTOP)
    replace(source, target)
os.replace = still
"""


def test_writer_that_stands_still(copied, derby):
    """While a writer stands still others answer, or wait; when it goes on, all end well, and nothing is torn."""
    shutil.rmtree(copied / "situations")
    (copied / "inbox").rename(copied.parent / "recordings")
    others = [("kb", "list"), ("sql", "select 1"), ("import", derby), ("run",), ("verify",), ("prune",)]
    with ExitStack() as held:
        def begin(*words: object, before: str = "") -> subprocess.Popen[str]:
            return held.enter_context(subprocess.Popen(
                pitchlore(*words, "--data", copied, before=before), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))

        writer = begin("run", before=STANDS_STILL)
        held.callback(writer.kill)
        assert writer.stdout is not None
        assert writer.stdout.readline() == "still\n"
        begun = [begin(*words) for words in others]
        assert begun[0].wait(SOON_S) == 0, "it only reads what stands"
        time.sleep(2.0)
        os.kill(writer.pid, signal.SIGCONT)
        said = [process.communicate(timeout=SOON_S)[1] for process in (writer, *begun)]
    assert [process.returncode for process in (writer, *begun)] == [0] * (1 + len(others)), said
    assert verify_all(Store(copied)).problems == []
    assert run(copied).failures == {}


def test_arrivals(tmp_path):
    """Recordings that arrive while others are imported come in once each, and none is refused."""
    store, count = Store(tmp_path / "data"), 60
    (store.root / "inbox").mkdir(parents=True)

    def arrive() -> None:
        for number in range(count):
            (tmp_path / "half").write_bytes(DERBY.replace(b"0.1,", b"0.%d1," % (number + 1)))
            (tmp_path / "half").rename(store.root / "inbox" / f"{number}.csv")

    arriving = Thread(target=arrive)
    arriving.start()
    made: list[str] = []
    while arriving.is_alive() or not made or len(made) < count:
        report = import_all(store)
        assert report.failed == {}
        made += report.made
    assert len(set(made)) == len(made) == count == len(list(store.receipts("matches")))
    assert store.quarantined() == []


@pytest.mark.parametrize("words", [
    ["record", "--minutes", "0.05"], ["forget", "early"], ["run"],
])
def test_nothing_is_masked(copied, capsys, monkeypatch, words):
    """A catalogue that fails hides neither what a command made nor what else failed."""
    (copied / "inbox" / "pipe.csv").symlink_to("/dev/null")

    def full(*_: object) -> None:
        raise StorageFailed("cannot be written (No space left on device)", where="catalog.duckdb")

    monkeypatch.setattr(catalog.catalog, "build", full)
    (copied / "catalog.duckdb").unlink()
    with pytest.raises(SystemExit) as stopped:
        main([*words, "--data", str(copied)])
    reported = capsys.readouterr()
    assert stopped.value.code == 1
    assert "No space left on device" in reported.out + reported.err
    assert {"record": "static-static", "forget": "outputs removed", "run": "pipe.csv"}[words[0]] in reported.out


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_recordings_stay_as_they_are(finished, tmp_path, share):
    """Whatever is salvaged from a cut log, the log itself is not touched."""
    (log,) = (finished / "matches").glob("early*.mcap")
    data = log.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[:int(share * len(data))])
    before = cut.stat()
    receipt, new, _ = take_in(Store(tmp_path / "data"), Recording(file=cut))
    assert (new, receipt.details["complete"]) == (True, False)
    assert cut.read_bytes() == data[:int(share * len(data))]
    assert (cut.stat().st_mtime_ns, cut.stat().st_ino) == (before.st_mtime_ns, before.st_ino)
