"""Windows: to play in, and to watch others in. The only package that imports pygame (extra ``play``).

==============  ==============================================================
screen          the window: opened, listened to, painted, in time
controls        what keys, buttons and sticks ask for
painting        what it shows at one frame, and a picture of it; needs no pygame
==============  ==============================================================
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from pitchlore.pipeline.base.errors import NotFound

if TYPE_CHECKING:
    from pitchlore.pipeline.arena.window.screen import Board, Window

# read when pygame is imported; standard output is the command's
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")


def window_class(where: str) -> type[Window]:
    """The window in which a person plays. It is loaded only here, because not everybody has pygame-ce.

    Args:
        where: asker, for the error.

    Raises:
        NotFound: if pygame is not installed.
    """
    with _needed(where):
        from pitchlore.pipeline.arena.window.screen import Window  # noqa: PLC0415
    return Window


def board_class(where: str) -> type[Board]:
    """The window that shows a match which others play; as :func:`window_class`."""
    with _needed(where):
        from pitchlore.pipeline.arena.window.screen import Board  # noqa: PLC0415
    return Board


@contextmanager
def _needed(where: str) -> Iterator[None]:
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name != "pygame":
            raise
        raise NotFound("its window needs pygame-ce, which is not installed", where=where,
                       next_step="Install the extra pitchlore[play]") from error
