"""Functions that tests hand to other processes. These load this module, and none of the tests' own."""

import os
import signal

from pitchlore.pipeline.base.errors import StorageFailed


def die() -> None:
    """Bring the process down."""
    os.kill(os.getpid(), signal.SIGKILL)


def die_of_two(number: int) -> int:
    """Do all pieces but one, which brings the process down."""
    if number == 2:
        die()
    return number


def die_of_a_pair(data: object, pair: object, policies: object) -> None:
    """Play no pair: whoever should is killed."""
    die()


def refuse() -> None:
    """Fail with an error of ours."""
    raise StorageFailed("cannot be written", where="m.parquet", next_step="Free space")
