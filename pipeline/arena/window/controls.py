"""Keys, buttons and sticks as requests of a person."""

from collections.abc import Iterable
from typing import Literal, NamedTuple

import pygame

from pitchlore.pipeline.arena.match.human import DriveCommand

#: A stick that is pushed less is let go: sticks do not come back to exactly 0.
DEAD_ZONE = 0.15
#: Help line at the bottom of the window.
HELP = "   ".join((
    "Arrows or WASD drive", "Space full speed", "Tab next robot", "E nearest to the ball",
    "P pause", "Esc leave",
))  # fmt: skip

_STICK_MOST = 32767

#: Meaning of a key or a button.
Do = Literal["forward", "back", "left", "right", "boost", "next", "nearest", "pause", "leave"]

KEYS: dict[int, Do] = {
    pygame.K_UP: "forward", pygame.K_w: "forward", pygame.K_DOWN: "back", pygame.K_s: "back",
    pygame.K_LEFT: "left", pygame.K_a: "left", pygame.K_RIGHT: "right", pygame.K_d: "right",
    pygame.K_SPACE: "boost", pygame.K_TAB: "next", pygame.K_e: "nearest",
    pygame.K_p: "pause", pygame.K_ESCAPE: "leave",
}  # fmt: skip
#: By SDL's names, which are those of an Xbox pad and mean the same places on any other.
BUTTONS: dict[int, Do] = {
    pygame.CONTROLLER_BUTTON_DPAD_UP: "forward", pygame.CONTROLLER_BUTTON_DPAD_DOWN: "back",
    pygame.CONTROLLER_BUTTON_DPAD_LEFT: "left", pygame.CONTROLLER_BUTTON_DPAD_RIGHT: "right",
    pygame.CONTROLLER_BUTTON_A: "boost", pygame.CONTROLLER_BUTTON_X: "next",
    pygame.CONTROLLER_BUTTON_RIGHTSHOULDER: "next", pygame.CONTROLLER_BUTTON_B: "nearest",
    pygame.CONTROLLER_BUTTON_START: "pause", pygame.CONTROLLER_BUTTON_BACK: "leave",
}  # fmt: skip


class Asked(NamedTuple):
    """Requests of a person since the last call.

    Attributes:
        command: for the robot that they drive.
        switch: robot that they want to drive instead, if any.
        paused: whether the match stands still.
        leave: whether they leave the match.
    """

    command: DriveCommand
    switch: Literal["next", "nearest"] | None
    paused: bool
    leave: bool


class Controls:
    """Keys, buttons and sticks as their events leave them, of all devices together.

    Args:
        paused: whether the match stands still until the person goes on.
    """

    def __init__(self, *, paused: bool = False) -> None:
        self._held: dict[tuple[int, int], Do] = {}
        self._stick = {pygame.CONTROLLER_AXIS_LEFTX: 0.0, pygame.CONTROLLER_AXIS_LEFTY: 0.0}
        self._switch: Literal["next", "nearest"] | None = None
        self._paused, self._leave = paused, False

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
                self._press((pygame.KEYDOWN, event.key), KEYS[event.key])
            case pygame.KEYUP:
                self._held.pop((pygame.KEYDOWN, event.key), None)
            case pygame.CONTROLLERBUTTONDOWN if event.button in BUTTONS:
                self._press((pygame.CONTROLLERBUTTONDOWN, event.button), BUTTONS[event.button])
            case pygame.CONTROLLERBUTTONUP:
                self._held.pop((pygame.CONTROLLERBUTTONDOWN, event.button), None)
            case pygame.CONTROLLERAXISMOTION if event.axis in self._stick:
                part = max(event.value / _STICK_MOST, -1.0)
                self._stick[event.axis] = part if abs(part) >= DEAD_ZONE else 0.0
            case pygame.CONTROLLERDEVICEREMOVED:
                self._stick = dict.fromkeys(self._stick, 0.0)
                self._held = {held: do for held, do in self._held.items() if held[0] == pygame.KEYDOWN}
                self._paused = True

    def _press(self, held: tuple[int, int], do: Do) -> None:
        """A key goes down: it is held from now on; what is done once is done."""
        self._held[held] = do
        match do:
            case "next" | "nearest":
                self._switch = do
            case "pause":
                self._paused = not self._paused
            case "leave":
                self._leave = True

    def _command(self) -> DriveCommand:
        doing = self._held.values()
        forward = float("forward" in doing) - float("back" in doing)
        turn = float("left" in doing) - float("right" in doing)
        return DriveCommand(  # a stick's axes point right and down
            forward or -self._stick[pygame.CONTROLLER_AXIS_LEFTY],
            turn or -self._stick[pygame.CONTROLLER_AXIS_LEFTX],
            "boost" in doing,
        )
