"""Paints a frame of a match; needs no pygame."""

import math
from collections import deque
from typing import NamedTuple

from pitchlore.pipeline.arena.physics.laws import Marks
from pitchlore.pipeline.drawing.painting import (
    INK,
    MUTED,
    PAGE,
    Canvas,
    Painter,
    Point,
    Robot,
    Snapshot,
    clock,
    part,
)
from pitchlore.pipeline.game.bodies import BALL, THETA, X, Y
from pitchlore.pipeline.game.pitch import MARKINGS, Markings, Pitch
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.schemas import SIDES

_DRIVEN = (255, 214, 77)
_ZOOM, _FOOT = 1.7, 40  # the foot and the message in pixels
_MESSAGE, _HINT = (400, 76), 24  # the hint makes the message higher
_TRAIL = 36  # frames


class Picture(NamedTuple):
    """A frame of a match as the window shows it.

    Attributes:
        bodies: float64 [1 + 2 N, 6] in the pitch frame.
        home_attacks: +1 if home attacks +x, else -1.
        score: goals of home and away.
        clock_s: seconds played.
        duration_s: duration of the match.
        driven: row of the robot that a person drives, None if they drive none.
        message: in large letters over the pitch; none if empty.
        hint: in small letters below the message.
    """

    bodies: F64
    home_attacks: int
    score: tuple[int, int]
    clock_s: float
    duration_s: float
    driven: int | None = None
    message: str = ""
    hint: str = ""


class WindowPainter:
    """Paints frames of one match.

    Args:
        pitch: pitch of the match.
        names: names of home and away.
        size: width and height, pixels.
        help_line: at the bottom.
    """

    def __init__(
        self, pitch: Pitch, names: tuple[str, str], size: tuple[int, int], help_line: str = ""
    ) -> None:
        marks = Marks.of(pitch)
        markings = Markings(
            marks.circle, ((marks.goal_x - marks.area_x, 2 * marks.area_y),), MARKINGS[pitch.kind].corner,
            tuple((marks.mark_x, y) for y in (0.0, marks.mark_y, -marks.mark_y)),
        )
        self._painter = Painter(pitch, markings, names, size, _FOOT, square=True, zoom=_ZOOM)
        self._size = size
        self._trail: deque[Point] = deque(maxlen=_TRAIL)
        with part(self._painter.floor, (0, size[1] - _FOOT), size) as brush:
            brush.write(help_line, (size[0] / 2, size[1] - _FOOT / 2), 14, MUTED, room=size[0])

    def paint(self, picture: Picture) -> Canvas:
        """A frame; the ball leaves a trail from call to call."""
        bodies = picture.bodies
        ball = (bodies[BALL, X], bodies[BALL, Y])
        if self._trail and math.dist(self._trail[-1], ball) > 0.2:
            self._trail.clear()  # it was put there
        self._trail.append(ball)
        count = (len(bodies) - 1) // 2
        robots = [
            Robot(SIDES[row // count], row % count + 1, (body[X], body[Y]), body[THETA])
            for row, body in enumerate(bodies[1:])
        ]
        time = f"{clock(picture.clock_s)} of {clock(picture.duration_s)}"
        aims = ("attacks »", "« attacks") if picture.home_attacks > 0 else ("« attacks", "attacks »")
        canvas = self._painter.paint(Snapshot(
            time, picture.score, self._trail, robots, home_attacks=picture.home_attacks, notes=aims))
        if picture.driven is not None:
            self._mark(canvas, robots[picture.driven - 1])
        if picture.message:
            self._paint_message(canvas, picture.message, picture.hint)
        return canvas

    def _mark(self, canvas: Canvas, robot: Robot) -> None:
        """A ring around the robot that is driven, and a pointer above it."""
        (x, y), r = self._painter.at(robot.at), self._painter.robot
        tip, half = y - 2.1 * r, 0.34 * r
        top = tip - 1.5 * half
        with part(canvas, (x, y), reach=2.7 * r) as brush:
            brush.circle((x, y), 1.75 * r, _DRIVEN, 3)
            brush.polygon([(x, tip), (x - half, top), (x + half, top)], _DRIVEN)

    def _paint_message(self, canvas: Canvas, message: str, hint: str) -> None:
        (x, y), (width, height) = self._painter.at((0.0, 0.0)), _MESSAGE
        corners = ((x - width / 2, y - height / 2), (x + width / 2, y + height / 2 + bool(hint) * _HINT))
        with part(canvas, *corners) as brush:
            brush.box(*corners, PAGE, radius=16)
            brush.write(message, (x, y), 44, INK)
            if hint:
                brush.write(hint, (x, y + height / 2), 18, MUTED, room=width)
