"""The Prefect server that a data folder keeps, and which server a command's flows talk to."""

from __future__ import annotations

import json
import os
import signal
import socket
import sqlite3
import subprocess
import threading
import time
from contextlib import closing
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest
from support.closed import as_user
from support.processes import alive, eventually, pitchlore
from support.sessions import migrated
from support.sockets import listened
from support.terminal import terminal

from pitchlore.flows import server
from pitchlore.flows.server import Keeper, Kept, Process, ServerFailed, database, named
from pitchlore.pipeline.store.sealed import pretty

pytestmark = pytest.mark.slow

#: Stands in for uvicorn, so that a server starts at once: it answers everything with its headers.
UVICORN = """
import asyncio
class Config:
    def __init__(self, *_, headers, **__): self.headers = headers
class Server:
    started = False
    def __init__(self, config): self.headers = config.headers
    async def startup(self, sockets=None): self.started = True
    def run(self, sockets=None): asyncio.run(self.serve(sockets))
    async def serve(self, sockets):
        said = "".join(f"{name}: {value}\\r\\n" for name, value in self.headers)
        async def answer(reader, writer):
            await reader.readuntil(b"\\r\\n\\r\\n")
            writer.write(f"HTTP/1.0 200 OK\\r\\n{said}\\r\\n".encode())
            writer.close()
        serving = await asyncio.start_server(answer, sock=sockets[0])
        await self.startup(sockets)
        await serving.serve_forever()
"""


@pytest.fixture
def uvicorn(tmp_path, monkeypatch):
    """Replace uvicorn in every process that is started from now on."""

    def replace(text: str) -> None:
        (tmp_path / "modules").mkdir(exist_ok=True)
        (tmp_path / "modules" / "uvicorn.py").write_text(text)
        monkeypatch.setenv("PYTHONPATH", str(tmp_path / "modules"))

    return replace


@pytest.fixture
def data(tmp_path):
    """A data folder; the server that it keeps in the end is stopped."""
    folder = tmp_path / "data"
    (folder / "inbox").mkdir(parents=True)
    yield folder
    Keeper(folder).stop()


def begin(*words: object) -> subprocess.Popen[str]:
    return subprocess.Popen(pitchlore(*words), text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def test_two_starts(uvicorn, data, call):
    """Two starts at once start one server, which status, a third start and stop find."""
    uvicorn(UVICORN)
    with begin("server", "start", "--json", "--data", data) as one, begin("server", "start", "--json", "--data", data) as two:
        reported = [json.loads(process.communicate(timeout=300)[0]) for process in (one, two)]
    assert sorted(said["new"] for said in reported) == [False, True]
    assert reported[0]["pid"] == reported[1]["pid"]
    code, out, _ = call("server", "status", "--json", "--data", data)
    assert code == 0
    assert json.loads(out) == {"running": True} | {name: reported[0][name] for name in ("ui", "api", "pid")}
    code, out, _ = call("server", "start", "--data", data)
    assert (code, out.splitlines()[0]) == (0, f"runs already: {reported[0]['ui']}")
    assert call("server", "stop", "--data", data)[:2] == (0, f"stopped: {reported[0]['ui']}\n")
    assert call("server", "stop", "--data", data)[:2] == (0, "no server runs\n")
    code, out, _ = call("server", "status", "--data", data)
    assert (code, out) == (1, "no server runs: `pitchlore server start` starts one\n")
    assert not alive(reported[0]["pid"])


@pytest.mark.parametrize("spoil", [
    lambda folder: folder.write_text(""), lambda folder: folder.symlink_to("nothing"), lambda folder: (folder / ".lock").mkdir(parents=True),
    lambda folder: (folder / "server.json").mkdir(parents=True), lambda folder: (folder.mkdir(), (folder / "server.json").write_text("{")),
])
@pytest.mark.parametrize("words", [("server", "start"), ("server", "status"), ("server", "stop")])
def test_unfit_folder(data, spoil, words, call):
    """A `server` in the data folder that is no folder of a server is one line of error, or no server; a record that cannot be read is an error."""
    spoil(data / "server")
    code, out, err = call(*words, "--data", data)
    assert "Unexpected" not in err
    if (data / "server" / "server.json").exists():
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert "so a server may run" in err
        assert "so a server may run" in call("run", "--data", data)[2]
        (data / "server" / "server.json").rename(data / "spoilt")  # else the fixture could not stop it
    elif words[1] == "start":
        assert (code, out) == (1, "")
        assert "cannot be used (" in err
    else:
        assert "no server runs" in out


def test_shared_database(data, monkeypatch):
    """Another user of the data folder's group can write the database: SQLite alone makes it for its owner only."""
    def begun(*_: object, **__: object) -> Process:
        raise ServerFailed("begun")

    monkeypatch.setattr(server, "Process", begun)
    before = os.umask(0o002)
    try:
        with pytest.raises(ServerFailed, match="begun"):
            Keeper(data).start()
    finally:
        os.umask(before)
    file = data / "server" / database()
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("create table t (x)")
    assert file.stat().st_mode & 0o777 == 0o664


def test_dead_server(uvicorn, data, call):
    """A server that died is said to have died, and the next start brings another."""
    uvicorn(UVICORN)
    pid = json.loads(call("server", "start", "--json", "--data", data)[1])["pid"]
    os.kill(pid, signal.SIGKILL)
    code, out, _ = call("server", "status", "--data", data)
    assert (code, out) == (1, f"the server has died (process {pid}); its log is {Keeper(data).log}\n")
    code, out, _ = call("server", "start", "--json", "--data", data)
    assert (code, json.loads(out)["new"]) == (0, True)
    assert json.loads(out)["pid"] != pid


def test_stale_record(data):
    """A stale record harms no process that has its number by now, this one, nor trusts one that has its port."""
    keeper = Keeper(data)
    keeper.folder.mkdir()
    with socket.create_server(("127.0.0.1", 0)) as taken:
        record = Kept(pid=os.getpid(), port=taken.getsockname()[1], token="0")
        (keeper.folder / "server.json").write_bytes(pretty(record))

        def answer() -> None:
            with taken.accept()[0] as asked:
                asked.sendall(b"HTTP/1.0 200 OK\r\n\r\n")

        answering = threading.Thread(target=answer)
        answering.start()
        assert keeper.look() == record
        assert keeper.alive is None
        answering.join()
    assert keeper.stop() is None
    assert keeper.look() is None


def test_taken_port(data, call):
    """A port that is taken is reported in one line."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, out, err = call("server", "start", "--port", port, "--data", data)
    assert (code, out) == (1, "")
    assert err == f"pitchlore: --port: port {port} of 127.0.0.1 is taken. Name another port, or none: then a free one is taken.\n"


def test_failing_start(uvicorn, data, call):
    """A server that does not start says why."""
    uvicorn("raise RuntimeError('out of cheese')")
    code, out, err = call("server", "start", "--data", data)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert err.startswith("pitchlore: the Prefect server does not start (RuntimeError: out of cheese). ")
    assert "out of cheese" in Keeper(data).log.read_text()
    with pytest.raises(ServerFailed, match="out of cheese"):
        Process(os.environ).wait()


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_stopped_start(uvicorn, data, end):
    """A start that is stopped leaves no server."""
    uvicorn("import time; time.sleep(600)")
    with terminal("server", "start", "--data", data, before="print('begun', flush=True)") as command:
        command.until("begun")
        while not Keeper(data).log.exists():
            assert command.process.poll() is None
        time.sleep(0.5)
        os.kill(command.process.pid, end)
        assert command.end(20.0) in (130, -signal.SIGKILL)
        assert command.left(20.0) == []
    assert Keeper(data).look() is None


def test_server_of_the_folder(data, tmp_path, monkeypatch, call):
    """Work is a flow where the data folder keeps a server, and none where that has died; its database and results are there.

    A home of Prefect's that another version has migrated stops neither. The server is on loopback.
    """
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    monkeypatch.setenv("PREFECT_HOME", str(tmp_path))
    with sqlite3.connect(tmp_path / "prefect.db") as connection:
        connection.execute("create table alembic_version (version_num text)")
        connection.execute("insert into alembic_version values ('of-the-future')")
    migrated(Keeper(data).folder, database())
    code, out, _ = call("server", "start", "--json", "--data", data)
    kept = json.loads(out)
    assert code == 0
    assert named(data) == kept["api"]
    assert {(kind, address) for kind, address, _ in listened(kept["pid"])} == {("tcp", "127.0.0.1")}
    with begin("run", "--data", data) as command:
        _, err = command.communicate(timeout=300)
    assert (command.returncode, [line for line in err.splitlines() if "━" not in line and line.strip()]) == (0, [])
    with sqlite3.connect(data / "server" / database()) as connection:
        assert connection.execute("select name from flow").fetchall() == [("run",)]
    assert [json.loads(path.read_text())["knowledge"] for path in (data / "server" / "results").iterdir()] == [None]
    with socket.create_connection(("127.0.0.1", int(kept["ui"].rsplit(":", 1)[1]))) as asked:
        asked.sendall(b"GET /runs HTTP/1.0\r\nAccept: text/html\r\n\r\n")
        assert b"200 OK" in asked.recv(64)  # its pages are there
    os.kill(kept["pid"], signal.SIGKILL)
    eventually(lambda: named(data) is None)
    assert call("run", "--data", data)[0] == 0


def test_closed_folder(tmp_path, monkeypatch):
    """The server of a folder that is closed to the user is kept in the user's own folder, by the folder's name."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    (tmp_path / "league").mkdir()
    assert Keeper(tmp_path / "league").folder == tmp_path / "league" / "server"
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    folders = [Keeper(tmp_path / name / "league").folder for name in ("one", "two")]
    assert [folder.parent for folder in folders] == [tmp_path / "state" / "pitchlore"] * 2
    assert len(set(folders)) == 2
    assert all(folder.name.startswith("league-") for folder in folders)


def test_serve_in_a_closed_folder(data, tmp_path, monkeypatch, call):
    """A folder in which nothing can be written is not served: each run would fail."""
    def begun(*_: object, **__: object) -> Process:
        raise ServerFailed("begun")

    monkeypatch.setattr(server, "Process", begun)
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # as the system says to a user who is not root
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    data.chmod(0o555)
    with as_user():
        code, out, err = call("serve", "--data", data)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert err.startswith(f"pitchlore: {data}/.commits: cannot be written (Permission denied)")


class Pages(BaseHTTPRequestHandler):
    """A server of pages, as Prefect's own is where its API is not."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("content-type", "text/html")
        self.end_headers()
        self.wfile.write(b"<html>")

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def pages():
    with HTTPServer(("127.0.0.1", 0), Pages) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.mark.parametrize("words", [("import", "x.csv"), ("serve",)])
def test_nobody_at_address(data, words, monkeypatch, call):
    """An address where no server answers is reported in one line, without a traceback."""
    monkeypatch.setenv("PREFECT_API_URL", "http://127.0.0.1:1/api")
    code, out, err = call(*words, "--data", data)
    assert (code, out) == (1, "")
    assert err.splitlines()[-1].startswith("pitchlore: http://127.0.0.1:1/api: no Prefect server answers (")
    assert err.endswith("). Start it, or correct PREFECT_API_URL in the environment.\n")
    assert "Traceback" not in err


def test_a_password_is_not_shown(data, pages, tmp_path, monkeypatch, call):
    """A password in an address is neither printed nor kept, whatever is wrong with the address."""
    for words in (("run", "--on", "dask://me:secret@host"), ("demo", "s3://me:secret@league/derby.csv")):
        code, out, err = call(*words, "--data", data)
        assert (code, "secret" in out + err) == (1, False)
    for url, said in ((pages, "is not the address of a Prefect API. Set PREFECT_API_URL to http://…@"),
                      ("http://127.0.0.1:1/api", "no Prefect server answers")):
        monkeypatch.setenv("PREFECT_API_URL", url.replace("//", "//me:secret@"))
        code, out, err = call("run", "--data", data)
        assert (code, "secret" in out + err, said in err) == (1, False, True)
    assert not [path for path in data.rglob("*") if path.is_file() and b"secret" in path.read_bytes()]


class Closed(BaseHTTPRequestHandler):
    """Greets, and answers nothing else without a password."""

    def do_GET(self) -> None:
        self.send_response(200 if self.path.endswith("hello") else 401)
        self.send_header("content-type", "application/json")
        self.send_header("content-length", "2")
        self.end_headers()
        self.wfile.write(b"{}")

    do_POST = do_GET  # noqa: N815 (as the standard library names it)

    def log_message(self, *_: object) -> None:
        pass


def test_a_server_that_wants_a_password(data, monkeypatch, call):
    """One line says which variables hold it."""
    with HTTPServer(("127.0.0.1", 0), Closed) as server:
        (thread := threading.Thread(target=server.serve_forever)).start()
        monkeypatch.setenv("PREFECT_API_URL", f"http://127.0.0.1:{server.server_port}/api")
        code, _, err = call("run", "--data", data)
        server.shutdown()
        thread.join()
    assert code == 1
    assert "the Prefect server failed (401 Unauthorized). Set PREFECT_API_KEY or PREFECT_API_AUTH_STRING to what it asks for." in err


def test_address_without_api(data, pages, monkeypatch, call):
    """An address without Prefect's API is reported in one line that names the address to set."""
    monkeypatch.setenv("PREFECT_API_URL", pages)
    code, out, err = call("run", "--data", data)
    assert (code, out) == (1, "")
    assert err.splitlines()[-1] == f"pitchlore: {pages}: is not the address of a Prefect API. Set PREFECT_API_URL to {pages}/api."
