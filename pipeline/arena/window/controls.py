"""Keys, buttons and sticks as requests of a person."""

from collections.abc import Iterable
from enum import Enum, auto
from typing import Literal, NamedTuple

import pygame

from pipeline.arena.match.human import DriveCommand

#: A stick that is pushed less is let go: sticks do not come back to exactly 0.
DEAD_ZONE = 0.15
#: Help line at the bottom of the window.
HELP = "   ".join((
    "Arrows or WASD drive", "Space full speed", "Tab next robot", "E nearest to the ball",
    "P pause", "Esc leave",
))  # fmt: skip

_STICK_MOST = 32767


class Do(Enum):
    """Meaning of a key or a button."""

    FORWARD = auto()
    BACK = auto()
    LEFT = auto()
    RIGHT = auto()
    BOOST = auto()
    NEXT = auto()
    NEAREST = auto()
    PAUSE = auto()
    LEAVE = auto()


KEYS = {
    pygame.K_UP: Do.FORWARD, pygame.K_w: Do.FORWARD, pygame.K_DOWN: Do.BACK, pygame.K_s: Do.BACK,
    pygame.K_LEFT: Do.LEFT, pygame.K_a: Do.LEFT, pygame.K_RIGHT: Do.RIGHT, pygame.K_d: Do.RIGHT,
    pygame.K_SPACE: Do.BOOST, pygame.K_TAB: Do.NEXT, pygame.K_e: Do.NEAREST,
    pygame.K_p: Do.PAUSE, pygame.K_ESCAPE: Do.LEAVE,
}  # fmt: skip
#: By SDL's names, which are those of an Xbox pad and mean the same places on any other.
BUTTONS = {
    pygame.CONTROLLER_BUTTON_DPAD_UP: Do.FORWARD, pygame.CONTROLLER_BUTTON_DPAD_DOWN: Do.BACK,
    pygame.CONTROLLER_BUTTON_DPAD_LEFT: Do.LEFT, pygame.CONTROLLER_BUTTON_DPAD_RIGHT: Do.RIGHT,
    pygame.CONTROLLER_BUTTON_A: Do.BOOST, pygame.CONTROLLER_BUTTON_X: Do.NEXT,
    pygame.CONTROLLER_BUTTON_RIGHTSHOULDER: Do.NEXT, pygame.CONTROLLER_BUTTON_B: Do.NEAREST,
    pygame.CONTROLLER_BUTTON_START: Do.PAUSE, pygame.CONTROLLER_BUTTON_BACK: Do.LEAVE,
}  # fmt: skip


class Asked(NamedTuple):
    """Requests of a person since the last call.

    Attributes:
        command: for the robot that they drive.
        switch: which robot they want to drive instead, if any.
        paused: whether the match stands still.
        leave: whether they leave the match.
    """

    command: DriveCommand
    switch: Literal["next", "nearest"] | None
    paused: bool
    leave: bool


class Controls:
    """Keys, buttons and sticks as their events leave them, of all devices together."""

    def __init__(self) -> None:
        self._held: set[tuple[int, int]] = set()
        self._stick = {pygame.CONTROLLER_AXIS_LEFTX: 0.0, pygame.CONTROLLER_AXIS_LEFTY: 0.0}
        self._switch: Literal["next", "nearest"] | None = None
        self._paused = self._leave = False

    def listen(self, events: Iterable[pygame.event.Event]) -> Asked:
        """Take the events since the last call, in order."""
        self._switch = None
        for event in events:
            self._take(event)
        return Asked(self._command(), self._switch, self._paused, self._leave)

    def _take(self, event: pygame.event.Event) -> None:
        match event.type:
            case pygame.QUIT:
                self._leave = True
            case pygame.WINDOWFOCUSLOST:  # keys that are let go elsewhere are never heard of
                self._held.clear()
                self._paused = True
            case pygame.KEYDOWN if event.key in KEYS:
                self._held.add((pygame.KEYDOWN, event.key))
                self._once(KEYS[event.key])
            case pygame.KEYUP:
                self._held.discard((pygame.KEYDOWN, event.key))
            case pygame.CONTROLLERBUTTONDOWN if event.button in BUTTONS:
                self._held.add((pygame.CONTROLLERBUTTONDOWN, event.button))
                self._once(BUTTONS[event.button])
            case pygame.CONTROLLERBUTTONUP:
                self._held.discard((pygame.CONTROLLERBUTTONDOWN, event.button))
            case pygame.CONTROLLERAXISMOTION if event.axis in self._stick:
                part = max(event.value / _STICK_MOST, -1.0)
                self._stick[event.axis] = part if abs(part) >= DEAD_ZONE else 0.0
            case pygame.CONTROLLERDEVICEREMOVED:
                self._stick = dict.fromkeys(self._stick, 0.0)
                self._held = {held for held in self._held if held[0] == pygame.KEYDOWN}
                self._paused = True

    def _once(self, what: Do) -> None:
        """Act on a key that goes down; nothing more happens while it is held."""
        match what:
            case Do.NEXT:
                self._switch = "next"
            case Do.NEAREST:
                self._switch = "nearest"
            case Do.PAUSE:
                self._paused = not self._paused
            case Do.LEAVE:
                self._leave = True

    def _command(self) -> DriveCommand:
        doing = {(KEYS if device == pygame.KEYDOWN else BUTTONS)[code] for device, code in self._held}
        forward = float(Do.FORWARD in doing) - float(Do.BACK in doing)
        turn = float(Do.LEFT in doing) - float(Do.RIGHT in doing)
        return DriveCommand(  # a stick's axes point right and down
            forward or -self._stick[pygame.CONTROLLER_AXIS_LEFTY],
            turn or -self._stick[pygame.CONTROLLER_AXIS_LEFTX],
            Do.BOOST in doing,
        )
