"""Damaged files that the answer of a command leaves out: each is said in a line, and the exit code tells."""

from __future__ import annotations

import sys

#: The exit code of a command that has answered, but not from all that is there.
NOT_WHOLE = 3
#: Most files that are named.
_NAMED = 10
_said: dict[str, None] = {}


def begin() -> None:
    """Forget what the command before has left out, where a process calls several."""
    _said.clear()


def leave_out(error: Exception) -> None:
    """Say once that an answer goes on without a file."""
    line = str(error)
    if line in _said:
        return
    _said[line] = None
    if len(_said) <= _NAMED:
        print(f"pitchlore: left out: {line}", file=sys.stderr)  # noqa: T201 (this is the command line)
    elif len(_said) == _NAMED + 1:
        print("pitchlore: left out: more files; `pitchlore verify` names all.",  # noqa: T201 (as above)
              file=sys.stderr)


def exit_code() -> int:
    """The exit code of a command that has not failed."""
    return NOT_WHOLE if _said else 0
