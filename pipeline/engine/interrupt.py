"""Ctrl-C stops any command within seconds; the command says what is kept, and exits with 130. SIGTERM: 143.

A command that goes on until it is stopped ends as it should at either, and when its terminal is closed
(:func:`until_stopped`).

Python runs a signal's handler in the main thread only, and only between two steps of Python. Prefect,
compiled code and threads that are waited for can each delay that for minutes. Every file is written
whole or not at all, so the process may end at any moment.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock, Thread, current_thread, main_thread
from types import FrameType
from typing import NoReturn

from pitchlore.pipeline.base.system import remove_folder

#: How long what was interrupted may clear up, seconds.
GRACE_S = 2.0
#: Exit codes of what Ctrl-C and SIGTERM stopped, as shells count them.
STOPPED, TERMINATED = 128 + signal.SIGINT, 128 + signal.SIGTERM

KEPT = "What was finished is kept; run the command again to go on."
_SHOW_CURSOR = "\x1b[?25h"  # progress bars hide it

#: Where polars' compiled code calls Python, and takes no exception.
_POLARS_TYPES = f"{os.sep}polars{os.sep}datatypes{os.sep}"

_ending = Lock()
#: Signals that end the body of :func:`until_stopped`, and whether there is one now.
_STOPS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_goes_on = Event()


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """End the process with one line and exit code 130 when Ctrl-C is pressed while the body runs.

    The body gets KeyboardInterrupt and has :data:`GRACE_S` to clear up; a second Ctrl-C ends it at once.
    SIGTERM ends it at once, too, with exit code 143.
    Nothing changes in a thread other than the main one, or if Ctrl-C is ignored, as in a command that a
    shell starts with `&`.

    Yields:
        Whether Ctrl-C has been pressed, as a function: what fails from then on was interrupted, and need not
        be reported. Compiled code makes errors of its own of KeyboardInterrupt.
    """
    if current_thread() is not main_thread() or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        yield lambda: False
        return
    pressed = False
    _goes_on.clear()

    def interrupt(_number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        if not pressed:
            pressed = True
            if _aborts(frame):
                end()
            raise KeyboardInterrupt

    heard, reported = socket.socketpair()
    reported.setblocking(False)
    before = signal.signal(signal.SIGINT, interrupt), signal.set_wakeup_fd(
        reported.fileno(), warn_on_full_buffer=False)
    ending = signal.signal(signal.SIGTERM, lambda *_: None)  # so that the watch hears of it
    Thread(target=_watch, args=(heard,), name="ctrl-c", daemon=True).start()
    try:
        yield lambda: pressed
    except KeyboardInterrupt:
        end()
    finally:
        if pressed:  # whatever became of the interrupt on its way here
            end()
        signal.set_wakeup_fd(before[1])
        signal.signal(signal.SIGINT, before[0])
        signal.signal(signal.SIGTERM, ending)
        reported.close()


@contextmanager
def until_stopped() -> Iterator[Callable[[], bool]]:
    """Function that says if the body has to end: Ctrl-C, SIGTERM and a closed terminal do not interrupt it.

    Within :func:`interruptible` it has :data:`GRACE_S` to end, and a second signal ends the process at once.
    A command that `nohup` starts outlives its terminal.
    """
    stopped = False

    def stop(*_: object) -> None:
        nonlocal stopped
        stopped = True

    if current_thread() is not main_thread():
        yield lambda: False
        return
    nohup = signal.getsignal(_STOPS[-1]) is signal.SIG_IGN
    wanted = _STOPS[:-1] if nohup else _STOPS
    before = {number: signal.signal(number, stop) for number in wanted}
    _goes_on.set()
    try:
        yield lambda: stopped
    finally:
        if not stopped:  # else the command ends now, and the watch may not have heard yet of what stops it
            _goes_on.clear()
        for number, handler in before.items():
            signal.signal(number, handler)


def _aborts(frame: FrameType | None) -> bool:
    """True if compiled code would abort or panic: while a module is loaded, or polars makes a type."""
    while frame is not None:
        file = frame.f_code.co_filename
        if file.startswith("<frozen importlib") or _POLARS_TYPES in file:
            return True
        frame = frame.f_back
    return False


def _watch(heard: socket.socket) -> None:
    """End the process :data:`GRACE_S` after the first SIGINT, at the second, or at SIGTERM.

    A body of :func:`until_stopped` is ended by SIGTERM and SIGHUP as by SIGINT. It does nothing if the other
    end of ``heard`` is closed.
    """
    pressed = 0
    while True:
        heard.settimeout(GRACE_S if pressed else None)
        try:
            signals = heard.recv(64)
        except TimeoutError:
            break
        if not signals:
            heard.close()
            return
        if signal.SIGTERM in signals and not _goes_on.is_set():
            end("Terminated", TERMINATED)
        pressed += sum(map(signals.count, _STOPS if _goes_on.is_set() else (signal.SIGINT,)))
        if pressed > 1:
            break
    end()


def end(why: str = "Stopped", code: int = STOPPED) -> NoReturn:
    """Say what is kept and end the process and its children, without waiting for any thread; only once.

    Args:
        why: first words of the message.
        code: exit code.
    """
    _ending.acquire()
    line = f"pitchlore: {why}. {KEPT}\n"
    if sys.stderr.isatty():
        line = f"{_SHOW_CURSOR}\r{line}"
    try:
        heard = os.dup(2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # a progress bar's thread might draw once more
        os.write(heard, line.encode())
        for child in multiprocessing.active_children():  # Prefect's runner has one for each run of a flow
            child.kill()
        remove_folder()
    finally:
        os._exit(code)
