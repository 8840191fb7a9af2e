"""A command in a terminal of its own, as a person runs it: Ctrl-C reaches all in its foreground."""

import os
import pty
import select
import subprocess
import sys
import time
import uuid
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from support.processes import pitchlore

CTRL_C = b"\x03"
#: The command line as it is installed.
SCRIPT = Path(sys.executable).with_name("pitchlore")
#: What a command line begins with that ends when its terminal is closed, even if the tests are run with nohup.
HUNG_UP = ("env", "--default-signal=HUP")


class Terminal:
    """A terminal in which one command runs.

    Args:
        words: words of the command line.
        before: Python that the process runs before the command.
        environment: added to this process's.
        folder: in which the installed script is called; without one the command line is called here.
    """

    def __init__(self, *words: object, before: str = "", environment: Mapping[str, str] = {}, folder: Path | None = None) -> None:
        self.mark = f"PITCHLORE_TEST={uuid.uuid4().hex}"
        name, _, value = self.mark.partition("=")
        self.said = b""
        self._hand, screen = pty.openpty()
        self.process = subprocess.Popen(
            pitchlore(*words, before=before) if folder is None else [SCRIPT, *map(str, words)], cwd=folder,
            stdin=screen, stdout=screen, stderr=screen, start_new_session=True,
            env={**os.environ, name: value, **environment},
            preexec_fn=_take_terminal,
        )
        os.close(screen)

    @property
    def text(self) -> str:
        """Text written so far; a terminal throws away what nobody has read yet when Ctrl-C is pressed."""
        return self.said.decode(errors="replace")

    def press(self, keys: bytes = CTRL_C) -> None:
        """Press keys."""
        os.write(self._hand, keys)

    def until(self, text: str, seconds: float = 120.0) -> None:
        """Read on until a text has been written."""
        end = time.monotonic() + seconds
        while text.encode() not in self.said:
            assert time.monotonic() < end, f"{text!r} was not written in {seconds} s: {self.said!r}"
            assert self.read(0.1), f"ended before it wrote {text!r}: {self.said!r}"

    def end(self, seconds: float) -> int:
        """The exit code; whatever is written until then is read."""
        end = time.monotonic() + seconds
        while self.process.poll() is None:
            assert time.monotonic() < end, f"does not end in {seconds} s: {self.said!r}"
            self.read(0.05)
        while self.read(0.0):
            pass
        return self.process.returncode

    def left(self, seconds: float) -> list[str]:
        """The processes that are left of the command after some seconds, those that it started too."""
        end = time.monotonic() + seconds
        while (left := self._alive()) and time.monotonic() < end:
            time.sleep(0.1)
        return left

    def close(self) -> None:
        """End the command and whatever it left."""
        self.process.kill()
        self.process.wait()
        for line in self._alive():
            os.kill(int(line.split()[0]), 9)
        os.close(self._hand)

    def _alive(self) -> list[str]:
        """The number and the words of each process that has this terminal's mark in its environment."""
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                if self.mark.encode() in (folder / "environ").read_bytes().split(b"\0"):  # a zombie has none
                    words = (folder / "cmdline").read_bytes().replace(b"\0", b" ")
                    found.append(f"{folder.name} {words.decode(errors='replace')}")
            except OSError:  # it has ended, or is another user's
                continue
        return found

    def read(self, seconds: float) -> bool:
        """Read what comes within some seconds; False if there is nothing and the terminal has closed or time is up."""
        if not select.select([self._hand], [], [], seconds)[0]:
            return seconds > 0 and self.process.poll() is None
        try:
            part = os.read(self._hand, 65_536)
        except OSError:  # Linux says so when nobody has the terminal open any more
            return False
        self.said += part
        return bool(part)


def terminal(*words: object, **options: Any) -> closing[Terminal]:
    """A command in a terminal, as :class:`Terminal` takes it; nothing of it is left in the end."""
    return closing(Terminal(*words, **options))


def _take_terminal() -> None:
    """Make the terminal this session's, so that its keys signal this process group."""
    import fcntl
    import termios

    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
