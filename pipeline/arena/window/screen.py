"""The window: opened, listened to, painted, in time."""

import os
import time
from contextlib import suppress
from typing import Self

import pygame
from pygame._sdl2 import controller

from pipeline.arena.window.controls import HELP, Asked, Controls
from pipeline.arena.window.painting import Picture, WindowPainter
from pipeline.errors import BadSettings
from pipeline.pitch import Pitch

SIZE = (980, 860)
LEAST = (480, 460)
#: What SDL falls back to where there is no display: nobody would see the match.
_UNSEEN = ("offscreen", "dummy")
#: Frames that may be made up for at once; one that was late for longer lets the match wait.
MOST_DUE = 4


class Window:
    """A window as a context manager; all gamepads that are or get connected are listened to.

    Args:
        pitch: what is played on.
        names: of home and away.
        hz: frames of the match a second.
        paused: whether the match stands still until the person goes on.

    Raises:
        BadSettings: if there is no screen to open it on.
    """

    def __init__(self, pitch: Pitch, names: tuple[str, str], hz: float, *, paused: bool = False) -> None:
        self._pitch, self._names, self._hz = pitch, names, hz
        self._controls = Controls(paused=paused)
        self._pads: list[controller.Controller] = []

    def __enter__(self) -> Self:
        try:
            _find_display()
            controller.init()
            pygame.display.set_caption(f"Pitchlore: {self._names[0]} - {self._names[1]}")
            self._screen = pygame.display.set_mode(_fitting(SIZE), pygame.RESIZABLE)
        except pygame.error as error:
            pygame.quit()
            raise BadSettings(
                f"no window can be opened ({error})", where="screen",
                next_step="Play where there is a screen; `pitchlore record` needs none",
            ) from error
        self._painter = self._new_painter()
        self._next_s = time.perf_counter()
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
                self._painter = self._new_painter()
        return self._controls.listen(events)

    def show(self, picture: Picture) -> None:
        """Paint a frame."""
        image = self._painter.paint(picture)
        self._screen.blit(pygame.image.frombuffer(image.tobytes(), image.size, "RGB"), (0, 0))
        pygame.display.flip()

    def due(self) -> int:
        """Wait until the next frame is due. Returns the number of due frames, 1 to :data:`MOST_DUE`."""
        time.sleep(max(self._next_s - time.perf_counter(), 0.0))
        late_s = time.perf_counter() - self._next_s
        frames = 1 + int(late_s * self._hz)
        if frames > MOST_DUE:  # the match waits for who was away for so long
            frames, self._next_s = MOST_DUE, time.perf_counter()
        self._next_s += frames / self._hz
        return frames

    def _new_painter(self) -> WindowPainter:
        screen = pygame.display.get_surface()
        assert screen is not None, "it is open"
        self._screen = screen
        width, height = screen.get_size()
        return WindowPainter(self._pitch, self._names, (max(width, LEAST[0]), max(height, LEAST[1])), HELP)


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
