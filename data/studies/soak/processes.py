"""All processes of the soak: found by a mark in their environment, counted, killed."""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

#: In the environment of each: the number of the soak's own process.
MARK = "PITCHLORE_SOAK"


class Running(NamedTuple):
    """A process of the soak.

    Attributes:
        pid: its number.
        role: its part, in a word.
        mib: resident memory, MiB.
        files: number of its open files.
    """

    pid: int
    role: str
    mib: float
    files: int


def running() -> list[Running]:
    """The processes that have the mark, without this one and without those that have ended."""
    found = []
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit() or int(folder.name) == os.getpid():
            continue
        with suppress(OSError):
            if f"{MARK}={os.getpid()}".encode() not in (folder / "environ").read_bytes().split(b"\0"):
                continue
            words = (folder / "cmdline").read_bytes().split(b"\0")
            kb = [line.split()[1] for line in (folder / "status").read_text().splitlines()
                  if line.startswith("VmRSS")]
            if kb:  # else it has just ended
                found.append(Running(int(folder.name), _role(words), int(kb[0]) / 1024,
                                     len(list((folder / "fd").iterdir()))))
    return found


def _role(words: list[bytes]) -> str:
    line = b" ".join(words).decode(errors="replace")
    for sign, role in (
        ("server_process", "server"), ("dask_", "Dask"),
        (" watch ", "watch"), ("resource_tracker", "tracker"), ("forkserver", "reader"),
        ("spawn_main", "worker"), ("read_only=True", "notebook"), ("program.py", "program"),
        (" serve ", "serve"), ("prefect", "flow"),
    ):
        if sign in line:
            return role
    return "command"


def listens(pid: int) -> bool:
    """Tell whether a process handles SIGTERM: from then on our commands answer to Ctrl-C, too."""
    with suppress(OSError):
        (caught,) = (line.split()[1] for line in Path(f"/proc/{pid}/status").read_text().splitlines()
                     if line.startswith("SigCgt"))
        return bool(int(caught, 16) >> (signal.SIGTERM - 1) & 1)
    return False


def left(seconds: float) -> list[Running]:
    """The processes that are left after some seconds, or none as soon as there are none."""
    end = time.monotonic() + seconds
    while (found := running()) and time.monotonic() < end:
        time.sleep(0.2)
    return found
