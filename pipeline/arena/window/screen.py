"""The window: opened, listened to, painted, in time."""

import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from typing import ClassVar, Generic, Self, TypeVar

import pygame
from pygame._sdl2 import controller

from pitchlore.pipeline.arena.window.controls import HELP, Asked, Controls
from pitchlore.pipeline.arena.window.painting import Picture, WindowPainter
from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.drawing.painting import FOOT, LINE, Canvas, ListPainter, Snapshot
from pitchlore.pipeline.game.pitch import Pitch

SIZE = (980, 860)
LEAST = (480, 460)
#: What SDL falls back to where there is no display: nobody would see the match.
_UNSEEN = ("offscreen", "dummy")
#: Of a board's names, score and list; and the share of its height that the list may take.
_ZOOM, _MOST_LISTED = 1.5, 0.4
#: Frames that may be made up for at once; one that was late for longer lets the match wait.
MOST_DUE = 4

_P = TypeVar("_P")


class BaseWindow(ABC, Generic[_P]):
    """A window as a context manager; all gamepads that are or get connected are listened to.

    Args:
        names: names of home and away.
        paused: whether what is shown stands still until the person goes on.

    Raises:
        BadSettings: if there is no screen to open it on.
    """

    #: What to do where there is no screen.
    elsewhere: ClassVar[str]

    def __init__(self, names: tuple[str, str], *, paused: bool = False) -> None:
        self._names = names
        self._controls = Controls(paused=paused)
        self._pads: list[controller.Controller] = []

    @abstractmethod
    def _painting(self, size: tuple[int, int]) -> Callable[[_P], Canvas]:
        """Function that paints pictures of a size, pixels."""

    def __enter__(self) -> Self:
        try:
            _find_display()
            controller.init()
            self._screen = pygame.display.set_mode(_fitting(SIZE), pygame.RESIZABLE)
            self._entitle()
        except pygame.error as error:
            pygame.quit()
            raise BadSettings(
                f"no window can be opened ({error})", where="screen",
                next_step=self.elsewhere,
            ) from error
        self._paint = self._new_painting()
        return self

    def __exit__(self, *raised: object) -> None:
        self._pads.clear()
        pygame.quit()

    def listen(self) -> Asked:
        """Requests of the person since the last call."""
        events = pygame.event.get()
        for event in events:
            if event.type == pygame.CONTROLLERDEVICEADDED:
                with suppress(pygame.error):  # it was pulled out again: there is nobody to listen to
                    self._pads.append(controller.Controller(event.device_index))
            elif event.type == pygame.VIDEORESIZE:
                self._paint = self._new_painting()
        return self._controls.listen(events)

    def show(self, picture: _P) -> None:
        """Paint a picture."""
        image = self._paint(picture)
        self._screen.blit(pygame.image.frombuffer(image.tobytes(), image.size, "RGB"), (0, 0))
        pygame.display.flip()

    def _entitle(self) -> None:
        pygame.display.set_caption(f"Pitchlore: {' - '.join(self._names)}")

    def _new_painting(self) -> Callable[[_P], Canvas]:
        screen = pygame.display.get_surface()
        assert screen is not None, "it is open"
        self._screen = screen
        width, height = screen.get_size()
        return self._painting((max(width, LEAST[0]), max(height, LEAST[1])))


class Window(BaseWindow[Picture]):
    """The window in which a person plays.

    Args:
        pitch: pitch of the match.
        names: names of home and away.
        hz: frames of the match a second.
        paused: whether the match stands still until the person goes on.
    """

    elsewhere = "Play where there is a screen; `pitchlore record` needs none"

    def __init__(self, pitch: Pitch, names: tuple[str, str], hz: float, *, paused: bool = False) -> None:
        super().__init__(names, paused=paused)
        self._pitch, self._hz = pitch, hz

    def __enter__(self) -> Self:
        super().__enter__()
        self._next_s = time.perf_counter()
        return self

    def due(self) -> int:
        """Wait until the next frame is due. Returns the number of due frames, 1 to :data:`MOST_DUE`."""
        time.sleep(max(self._next_s - time.perf_counter(), 0.0))
        late_s = time.perf_counter() - self._next_s
        frames = 1 + int(late_s * self._hz)
        if frames > MOST_DUE:  # the match waits for who was away for so long
            frames, self._next_s = MOST_DUE, time.perf_counter()
        self._next_s += frames / self._hz
        return frames

    def _painting(self, size: tuple[int, int]) -> Callable[[Picture], Canvas]:
        return WindowPainter(self._pitch, self._names, size, HELP).paint


class Board(BaseWindow[Snapshot]):
    """The window that shows a match which others play, with the situation of each robot.

    Args:
        pitch: pitch of the match.
        names: names of home and away.
        robots: robots a side for whose situations there is room.
    """

    elsewhere = "Watch where there is a screen, or without --replay"

    def __init__(self, pitch: Pitch, names: tuple[str, str], robots: int) -> None:
        super().__init__(names)
        self._pitch, self._robots = pitch, robots

    def _painting(self, size: tuple[int, int]) -> Callable[[Snapshot], Canvas]:
        foot = min((self._robots * LINE + 2 * FOOT) * _ZOOM, _MOST_LISTED * size[1])
        return ListPainter(self._pitch, self._names, size, foot, zoom=_ZOOM).paint

    def match(self, pitch: Pitch, names: tuple[str, str], robots: int) -> None:
        """Show another pitch, other names, or more robots, from now on."""
        if (pitch, names, robots) != (self._pitch, self._names, self._robots):
            self._pitch, self._names, self._robots = pitch, names, robots
            self._paint = self._new_painting()
            self._entitle()


def _find_display() -> None:
    """Raise pygame.error if there is no screen, unless the environment asks for a hidden window."""
    pygame.display.init()
    if pygame.display.get_driver() in _UNSEEN and "SDL_VIDEODRIVER" not in os.environ:
        raise pygame.error("there is no display")


def _fitting(size: tuple[int, int]) -> tuple[int, int]:
    """The size, or the part of it that fits on the screen with its frame."""
    screen = pygame.display.get_desktop_sizes()[0]
    part = min(0.9 * screen[0] / size[0], 0.88 * screen[1] / size[1], 1.0)
    return round(size[0] * part), round(size[1] * part)
