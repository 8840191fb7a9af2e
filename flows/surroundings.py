"""Surroundings of a command: its words, encodings and limits, checked before anything is loaded or made."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from threading import Event, Thread

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.base.system import limit_of

#: Address space that a command needs, GB: libraries reserve more than they use.
SPACE_GB = 4
#: Threads that a command starts at most, about; and the limit from which on they are not tried.
_THREADS, _MANY = 32, 4096


def speak_utf8() -> None:
    """Start this process again in UTF-8 if paths and words are in another encoding, as by ``LC_ALL=C``."""
    if sys.getfilesystemencoding() != "utf-8" and not sys.flags.utf8_mode:
        os.environ["PYTHONUTF8"] = "1"  # for the processes that it starts
        os.execv(sys.executable, [sys.executable, "-X", "utf8", *sys.orig_argv[1:]])  # noqa: S606 (the same once more)


def check_surroundings(words: Sequence[str]) -> None:
    """Check the words and limits of a command.

    Raises:
        BadSettings: if a word is neither UTF-8 nor the path of something, or if the limits of ``ulimit -v``
            or ``ulimit -u`` are so low that a library would end the process.
    """
    for word in words:
        path = word.partition("=")[2] if word.startswith("-") else word
        if not _is_text(word) and not os.path.lexists(path):
            raise BadSettings("is not UTF-8", where=word,
                              next_step="Write it in UTF-8, or name what is there")
    if (space := limit_of("AS")) < SPACE_GB * 1_000_000_000:
        raise BadSettings(
            f"allows {space / 1e9:.1f} GB of address space", where="ulimit -v", next_step=(
                f"Allow {SPACE_GB} GB, which are reserved and not used, or limit memory otherwise"))
    if (threads := limit_of("NPROC")) < _MANY and not _can_start(_THREADS):
        raise BadSettings(f"allows {threads} processes and threads, and {_THREADS} more cannot be started",
                          where="ulimit -u", next_step="Allow more, or end some")


def _is_text(word: str) -> bool:
    try:
        word.encode()
    except UnicodeEncodeError:
        return False
    return True


def _can_start(count: int) -> bool:
    """True if so many threads can be there at once."""
    end, started = Event(), list[Thread]()
    try:
        for _ in range(count):
            started.append(Thread(target=end.wait, daemon=True))
            started[-1].start()
    except RuntimeError:
        started.pop()
        return False
    finally:
        end.set()
        for thread in started:
            thread.join()
    return True
