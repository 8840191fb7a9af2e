"""Listeners: each socket that a command listens to is on loopback, or a group that SECURITY.md names.

Those of `serve`, of `server start` and of `--on dask:local:N` are looked at where tests start them (test_scheduled.py,
test_server.py, test_cluster.py).
"""

import json
import os
import re
import shutil
import signal
import stat
import subprocess
import tempfile
import time
from ipaddress import ip_address
from pathlib import Path

import pytest
from conftest import ROOT
from support.processes import eventually, pitchlore

from pitchlore.flows.cli import COMMANDS

pytest.importorskip("psutil", reason="psutil, which sees sockets, comes with the extra dask")
from support.sockets import listened

pytestmark = [pytest.mark.slow]

#: Commands that listen: their words, how many sockets at least, and whether one more sends to any address and is not read.
LISTENING = {
    "watch": (("watch", "ssl"), 4, False),
    "drive": (("drive", "--team", "static", "--as", "blue"), 1, True),
    "record --serve": (("record", "--serve", "vsss", "--minutes", "1"), 1, True),
}
#: Those that start servers, or workers.
STARTING = ("serve", "server start", "notebooks", "--on dask:local:N")


@pytest.mark.parametrize("name", LISTENING)
def test_loopback(name, tmp_path):
    """By default nobody on another machine reaches a command, but by a league's groups."""
    words, least, sends = LISTENING[name]
    process = subprocess.Popen(pitchlore(*words, "--data", "data"), cwd=tmp_path, stderr=subprocess.PIPE, text=True,
                               stdout=subprocess.DEVNULL, env={**os.environ, "PREFECT_API_URL": ""})
    found = set()
    try:
        def enough():
            found.update(listened(process.pid))
            assert process.poll() is None, process.stderr.read()
            return len(found) >= least

        eventually(enough, 120, 0.1)
        for _ in range(10):  # others may open later
            time.sleep(0.1)
            found |= listened(process.pid) if process.poll() is None else set()
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
        process.stderr.close()
    far = {(kind, address) for kind, address, _ in found
           if not ip_address(address).is_loopback and not (kind == "udp" and ip_address(address).is_multicast)}
    assert far <= ({("udp", "0.0.0.0")} if sends else set()), found
    if name == "watch":
        assert {address for _, address, _ in found} == {"224.5.23.1", "224.5.23.2"}


@pytest.mark.parametrize("on", ["threads:1", "processes:2"])
def test_socket_of_what_is_read_apart(tmp_path, derby, on):
    """Its folder is the user's alone, and goes with the command, also by Ctrl-C; a long path of TMPDIR is no hindrance."""
    short, long = Path(tempfile.mkdtemp(prefix="p")), tmp_path / ("x" * 100)
    long.mkdir()
    shutil.copy(derby, other := tmp_path / "other.csv")
    words = pitchlore("import", "--isolate", "--on", on, derby, other, "--data", "data")
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, env={**os.environ, "TMPDIR": str(long)})
    assert (done.returncode, list(long.iterdir())) == (0, []), done.stderr + done.stdout
    try:
        process = subprocess.Popen(pitchlore("import", "--isolate", "--on", on, derby, other, "--data", "new"), cwd=tmp_path,
                                   env={**os.environ, "TMPDIR": str(short)}, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        (socket_,) = eventually(lambda: [*short.glob("pymp-*/listener-*")][:1], 60, 0.001)
        assert stat.S_IMODE(socket_.parent.stat().st_mode) == 0o700
        process.send_signal(signal.SIGINT)
        process.wait(20)
        assert list(short.iterdir()) == []
    finally:
        shutil.rmtree(short)


def test_pages():
    """SECURITY.md has a row for each listener; the page on clusters says who may run code, and how TLS is set up."""
    text = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([^`]+)` \|", text.partition("## Listeners")[2].partition("\n## ")[0], re.MULTILINE)
    assert {*LISTENING, *STARTING} == set(rows) - {"dask scheduler", "dask worker"}
    assert {*LISTENING, *STARTING} - {"--on dask:local:N", "record --serve"} <= {command.name for command in COMMANDS}
    page = (ROOT / "docs" / "how-to" / "cluster.md").read_text(encoding="utf-8")
    assert "Whoever reaches the scheduler or a worker runs code" in page


@pytest.mark.skipif(not shutil.which("openssl"), reason="the page makes its certificate with openssl")
def test_tls(tmp_path, derby):
    """The lines of the page, as they stand: a run on workers with TLS goes, and without the certificate none answers."""
    pytest.importorskip("distributed", reason="the extra dask is not installed")
    page = (ROOT / "docs" / "how-to" / "cluster.md").read_text(encoding="utf-8")
    make, tell = re.findall(r"```console\n(.*?)```", page.partition("## 5. ")[2], re.DOTALL)[:2]
    subprocess.run(["bash", "-ec", make], cwd=tmp_path, check=True, capture_output=True)
    told = subprocess.run(["bash", "-ec", f"{tell}\nexport -p"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    secret = {**os.environ, **dict(re.findall(r'declare -x (DASK_\w+)="(.*)"', told))}
    assert len(secret) >= len(os.environ) + 9
    begun = []

    def begin(module, *words):
        begun.append(subprocess.Popen(pitchlore(*words, before=f"import sys; sys.argv[0] = 'dask'; from distributed.cli.{module} import main; main()"),
                                      env=secret, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    try:
        begin("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", "scheduler.json")
        file = tmp_path / "scheduler.json"
        address = json.loads(eventually(lambda: file.exists() and file.read_text()))["address"]
        assert address.startswith("tls://")
        begin("dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
        on = address.replace("tls", "dask")
        for environment, code in ((secret, 0), (os.environ, 1)):
            done = subprocess.run(pitchlore("import", derby, "--on", on, "--data", f"data-{code}"), cwd=tmp_path,
                                  env=environment, capture_output=True, text=True)
            assert done.returncode == code, done.stderr
        assert "no Dask scheduler answers" in done.stderr
    finally:
        for process in begun:
            process.kill()
            process.wait()
