"""Processes of other programs."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import pytest

T = TypeVar("T")

#: The command line as it is installed: it leaves without unwinding the threads of Prefect, which could abort it.
COMMAND_LINE = "\nfrom pitchlore.flows.cli import script; script()"


def pitchlore(*words: object, before: str = "") -> list[str]:
    """The words that call the command line in a process of its own, after some Python of a test's."""
    return [sys.executable, "-c", before + COMMAND_LINE, *map(str, words)]

#: Several command lines in one process, as JSON in its first argument; each must succeed, and ends with a NUL.
COMMAND_LINES = """
import json, sys
from pitchlore.flows.cli import main
for words in json.loads(sys.argv[1]):
    try: main(words)
    except SystemExit as ended:
        if ended.code: raise
    print(end="\\0", flush=True)
"""


@contextmanager
def closed(folder: Path) -> Iterator[list[str]]:
    """A folder in which nothing can be written meanwhile, and words before a command that make it a common user's."""
    if os.geteuid():
        modes = {path: path.stat().st_mode for path in (folder, *folder.rglob("*"))}
        for path, mode in modes.items():
            path.chmod(mode & ~0o222)
        try:
            yield []
        finally:
            for path, mode in modes.items():
                path.chmod(mode)
        return
    if not shutil.which("setpriv"):
        pytest.skip("root needs setpriv (util-linux) to be a common user")
    for path in (folder, *folder.rglob("*")):
        os.chown(path, 65534, 65534)
        path.chmod(0o755 if path.is_dir() else 0o644)
    yield ["setpriv", "--bounding-set=-dac_override,-dac_read_search"]


@contextmanager
def answering(module: str, **environment: str) -> Iterator[subprocess.Popen[str]]:
    """A process of a module of the tests that answers lines: it says `ready` first, and is killed in the end."""
    path = os.pathsep.join([str(Path(__file__).parents[2]), str(Path(__file__).parents[1]), *sys.path])
    with subprocess.Popen([sys.executable, "-m", module], env={**os.environ, "PYTHONPATH": path, **environment},
                          text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        try:
            yield process
        finally:
            process.kill()


def tell(process: subprocess.Popen[str], *words: object) -> None:
    """Write a line to such a process."""
    assert process.stdin is not None
    print(*words, file=process.stdin, flush=True)


def line(process: subprocess.Popen[str]) -> str:
    """Its next line."""
    assert process.stdout is not None
    return process.stdout.readline().strip()


def eventually(what: Callable[[], T], seconds: float = 60.0, every: float = 0.02) -> T:
    """The awaited thing, as soon as it is there; looked for so often, seconds."""
    deadline = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < deadline
        time.sleep(every)
    return found


def alive(pid: int) -> bool:
    """True if a process is there and no zombie that nobody here can wait for."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
