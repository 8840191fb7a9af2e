"""The window in which a person plays; the only door to pygame, which the extra ``play`` brings.

==============  ==============================================================
screen          the window: opened, listened to, painted, in time
controls        what keys, buttons and sticks ask for
painting        how a moment of a match looks
==============  ==============================================================
"""

import os

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # standard output is the command's

from flows.window.controls import Asked, Controls  # noqa: E402 (pygame reads the variable when imported)
from flows.window.painting import Painter, Scene  # noqa: E402
from flows.window.screen import Window  # noqa: E402

__all__ = ["Asked", "Controls", "Painter", "Scene", "Window"]
