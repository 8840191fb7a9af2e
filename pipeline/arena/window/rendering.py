"""Rendering of an environment's matches: pictures, or a window in real time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.arena.match.environment import RenderMode
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import MatchSettings
from pitchlore.pipeline.arena.window import window_class
from pitchlore.pipeline.arena.window.painting import Picture, WindowPainter

if TYPE_CHECKING:
    from pitchlore.pipeline.arena.window.screen import Window

#: Width and height of pictures, pixels.
_SIZE = (640, 560)


class Rendering:
    """Pictures, or a window, of one match after another.

    Args:
        mode: ``rgb_array``, ``human`` or None.
        matches: settings of the matches.
        names: names of home and away.

    Attributes:
        each: to be called after each frame; None if nobody looks at it.
    """

    def __init__(self, mode: RenderMode | None, matches: MatchSettings, names: tuple[str, str]) -> None:
        self._pictures, self._matches, self._names = mode == "rgb_array", matches, names
        self._window: Window | None = None
        self.each = self._show if mode == "human" else None

    def begin(self, match: MatchInPlay) -> None:
        """Show this match from now on."""
        self._match = match
        if self._pictures:
            self._painter = WindowPainter(self._matches.pitch, self._names, _SIZE)
        if self.each is not None:
            self.each()

    def picture(self) -> npt.NDArray[np.uint8] | None:
        """The moment, uint8 [560, 640, 3], in the mode ``rgb_array``; None in others."""
        if not self._pictures:
            return None
        return np.array(self._painter.paint(self._scene()), dtype=np.uint8)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.__exit__()
        self._window = None

    def _show(self) -> None:
        """The frame in the window, in real time; a window that is left interrupts."""
        matches = self._matches
        if self._window is None:
            self._window = window_class("render_mode human")(
                matches.pitch, self._names, matches.physics.hz).__enter__()
        if self._window.listen().leave:
            raise KeyboardInterrupt
        self._window.due()
        self._window.show(self._scene())

    def _scene(self) -> Picture:
        match, matches = self._match, self._matches
        return Picture(
            match.bodies, int(match.attacks), match.score, match.frame / matches.physics.hz,
            matches.referee.duration_s,
        )  # fmt: skip
