"""A person at the window for tests: events that are injected when so many frames have been due, without a clock."""

import sys

import pytest

pygame = pytest.importorskip("pygame", reason="pygame-ce is not installed (the extra `play`)")

from pitchlore.pipeline import arena  # noqa: E402
from pitchlore.pipeline.arena.window.screen import Window  # noqa: E402


def without_pygame(monkeypatch):
    """As if pygame were not installed, for what loads the window from now on."""
    monkeypatch.setattr(arena, "window", sys.modules["pitchlore.pipeline.arena.window"])  # put back with the modules
    for module in [name for name in sys.modules if name.startswith("pitchlore.pipeline.arena.window")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "pygame", None)


def key(code, down=True):
    return pygame.event.Event(pygame.KEYDOWN if down else pygame.KEYUP, key=code)


def button(code, down=True):
    kind = pygame.CONTROLLERBUTTONDOWN if down else pygame.CONTROLLERBUTTONUP
    return pygame.event.Event(kind, button=code, instance_id=0)


def script(monkeypatch, *windows):
    """Let matches run as fast as they can. Of each window: the events by the number of frames that have been due.

    Returns the windows as they are opened.
    """
    opened, frames = [], {}

    def due(window):
        if window not in opened:
            opened.append(window)
        events = windows[len(opened) - 1]
        frames[id(window)] = frame = frames.get(id(window), 0) + 1
        for event in events.get(frame, ()):
            pygame.event.post(event)
        return 1

    monkeypatch.setattr(Window, "due", due)
    return opened
