"""A process that does things to data folders in children of its own, which kill themselves at a step.

A line of standard input is a step, how often an action is done, its name in ``support.at_once`` and a folder. A
step is a write, a sync, a rename, a lock or a removal of a file. At step N the child ends as by SIGKILL: no cleaning up is done, and of
a write a half is there. Step 0 is none: the child goes on to the end. The answer is the number of steps that
were reached, and the exit code.

The children are forked before this process has started any thread: they have nothing to import.
"""

import fcntl
import importlib
import os
import signal
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from support.at_once import ACTIONS

from pitchlore.pipeline.base.errors import PitchloreError
from pitchlore.pipeline.store import Store


def dying(step: int, root: Path) -> Callable[[], int]:
    """Make this process die at a step below a folder. Returns a function to the number of steps so far."""
    steps = 0

    def counted(place: object) -> bool:
        nonlocal steps
        if isinstance(place, int):
            place = Path(f"/proc/self/fd/{place}").readlink()
        if not Path(os.fspath(place)).is_relative_to(root):  # type: ignore[arg-type, call-overload]
            return False
        steps += 1
        return steps == step

    def wrapped(module: Any, name: str, place: Callable[..., object]) -> None:
        call = getattr(module, name)

        def wrapper(*arguments: Any, **named: Any) -> Any:
            if counted(place(*arguments)):
                os.kill(os.getpid(), signal.SIGKILL)
            return call(*arguments, **named)

        setattr(module, name, wrapper)

    write = Path.write_bytes

    def half_written(path: Path, data: bytes) -> int:
        if counted(path):
            write(path, data[:len(data) // 2])
            os.kill(os.getpid(), signal.SIGKILL)
        return write(path, data)

    for name in ("replace", "rename", "unlink", "fsync"):
        wrapped(os, name, lambda first, *_, **__: first)
    wrapped(fcntl, "flock", lambda held, _: held if isinstance(held, int) else held.fileno())
    Path.write_bytes = half_written  # type: ignore[method-assign, assignment]
    return lambda: steps


#: What stages load when they are first called; the children have it from here.
_LOADED = ("arena", "views.scout.content.write", "views.exports.formats", *(f"stages.{name}" for name in (
    "behaviours.rounds", "decisions", "goals", "sequences", "knowledge", "policies.train", "sides", "situations.recognise",
    "trajectories.derive", "values.fitting", "values.models", "values.moments", "values.worths")))


def main() -> None:
    """Answer lines until there are no more."""
    for name in _LOADED:
        importlib.import_module(f"pitchlore.pipeline.{name}")
    print("ready", flush=True)
    warnings.simplefilter("ignore", DeprecationWarning)  # polars' threads have not started
    for line in sys.stdin:
        step, times, action, folder = line.rstrip("\n").split(" ", 3)
        reported, tell = os.pipe()
        child = os.fork()
        if child == 0:
            steps, code = dying(int(step), Path(folder)), 0
            try:
                store = Store(Path(folder))
                store.sweep()
                for _ in range(int(times)):
                    ACTIONS[action](store)
            except PitchloreError as error:
                print(error, file=sys.stderr)
                code = 1
            os.write(tell, str(steps()).encode())
            os._exit(code)
        os.close(tell)
        _, status = os.waitpid(child, 0)
        print(os.read(reported, 16).decode() or step, os.waitstatus_to_exitcode(status), flush=True)
        os.close(reported)


if __name__ == "__main__":
    main()
