"""Pictures of a film: pitch, robots, ball, score, and each robot's situation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

from PIL import Image, ImageDraw, ImageFont

from pipeline.pitch import SCALES, Kind, Pitch

Colour = tuple[int, int, int]
Point = tuple[float, float]

# The colours of the replay page in its dark mode.
_PAGE, _GRASS, _STRIPE, _CHALK = (18, 22, 20), (33, 60, 47), (36, 65, 51), (112, 140, 125)
_INK, _MUTED, _WHITE = (232, 236, 233), (140, 151, 144), (255, 255, 255)
_TEAMS: dict[str, Colour] = {"home": (63, 158, 230), "away": (240, 138, 60)}

#: Factor by which everything is painted larger before it is reduced, which smooths edges.
_FINE = 3
#: Pixels.
_MARGIN, _HEAD, _LINE, _FOOT = 8, 50, 16, 6


class Markings(NamedTuple):
    """The lines of a league's pitch, metres; the left half is the mirror image of the right one.

    Attributes:
        circle: radius of the centre circle.
        areas: depth and width of the areas before the goal.
        corner: legs of the triangles that cut the corners.
        marks: points in the right half.
    """

    circle: float
    areas: tuple[Point, ...]
    corner: float
    marks: tuple[Point, ...]


#: As on the replay's page (``draw.js``).
MARKINGS = {
    Kind.VSSS: Markings(0.2, ((0.15, 0.7),), 0.07, ((0.375, 0.0), (0.375, 0.4), (0.375, -0.4))),
    Kind.SSL: Markings(0.5, ((1.8, 3.6),), 0.0, ()),
    Kind.SIM2D: Markings(9.15, ((16.5, 40.32), (5.5, 18.32)), 0.0, ((41.5, 0.0),)),
}


class Robot(NamedTuple):
    """A robot at a moment.

    Attributes:
        team: home or away.
        number: number of the robot.
        at: its place, metres.
        heading: radians counter-clockwise from +x; None where unknown.
        doing: its situation in words; empty where unknown.
    """

    team: str
    number: int
    at: Point
    heading: float | None
    doing: str


class Snapshot(NamedTuple):
    """Content of one picture; home attacks +x.

    Attributes:
        clock_s: seconds since the match began.
        score: goals of home and away, None where unknown.
        trail: recent places of the ball, metres, the present one last; empty where it is not seen.
        robots: the robots seen.
        scorer: team that has just made a goal, None without one.
    """

    clock_s: float
    score: tuple[int | None, int | None]
    trail: Sequence[Point]
    robots: Sequence[Robot]
    scorer: str | None = None


class FilmPainter:
    """Paints pictures of one match.

    Args:
        pitch: pitch of the match.
        names: names of home and away.
        lines: robots a side whose situations are listed under the pitch.
        width: width of the picture, pixels.
    """

    def __init__(self, pitch: Pitch, names: tuple[str, str], lines: int, width: int) -> None:
        self._pitch, self._names, self._width = pitch, names, width
        self._scale = (width - 2 * _MARGIN) / (pitch.length + 2 * pitch.goal_depth)
        grass = pitch.width * self._scale
        self._centre = (width / 2, _HEAD + grass / 2)
        self._list = _HEAD + grass + _FOOT
        self._size = (width, math.ceil(self._list + lines * _LINE + _FOOT))
        scales = SCALES[pitch.kind]
        self._robot = max(scales.robot_radius * self._scale, 6.0)
        self._ball = max(scales.ball_radius * self._scale, 3.5)
        self._floor = self._paint_floor()

    def paint(self, moment: Snapshot) -> Image.Image:
        """The moment as an RGB picture; the same bytes for the same moment."""
        image = self._floor.copy()
        brush = ImageDraw.Draw(image)
        if moment.scorer in _TEAMS:
            self._lit(brush, _TEAMS[moment.scorer])
        for age, (one, other) in enumerate(zip(moment.trail[:-1], moment.trail[1:], strict=True), start=1):
            part = age / len(moment.trail)
            width = round(1.7 * self._ball * _FINE * part)
            brush.line([self._at(one), self._at(other)], _mixed(_GRASS, _WHITE, 0.45 * part * part), width)
        for robot in moment.robots:
            self._paint_robot(brush, robot)
        if moment.trail:
            brush.circle(self._at(moment.trail[-1]), (self._ball + 1) * _FINE, _PAGE)
            brush.circle(self._at(moment.trail[-1]), self._ball * _FINE, _WHITE)
        self._paint_head(brush, moment)
        self._paint_list(brush, moment.robots)
        return image.reduce(_FINE)

    def _at(self, place: Point) -> Point:
        """Pixel of a place on the pitch, in the large picture."""
        return (_FINE * (self._centre[0] + place[0] * self._scale),
                _FINE * (self._centre[1] - place[1] * self._scale))

    def _box(self, one: Point, other: Point) -> tuple[float, float, float, float]:
        (x0, y0), (x1, y1) = self._at(one), self._at(other)
        return min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)

    def _paint_floor(self) -> Image.Image:
        """The background: everything that does not change."""
        image = Image.new("RGB", (self._size[0] * _FINE, self._size[1] * _FINE), _PAGE)
        brush = ImageDraw.Draw(image)
        pitch, marks = self._pitch, MARKINGS[self._pitch.kind]
        x, y, post, line = pitch.goal_x, pitch.width / 2, pitch.goal_width / 2, round(1.3 * _FINE)
        brush.rectangle(self._box((-x, -y), (x, y)), _GRASS)
        for stripe in range(-5, 5, 2):
            brush.rectangle(self._box((stripe * x / 5, -y), ((stripe + 1) * x / 5, y)), _STRIPE)
        brush.line([self._at((0, -y)), self._at((0, y))], _CHALK, line)
        brush.circle(self._at((0, 0)), marks.circle * self._scale * _FINE, outline=_CHALK, width=line)
        for side, team in ((-1, "home"), (1, "away")):
            net = self._box((side * x, -post), (side * (x + pitch.goal_depth), post))
            brush.rectangle(net, _mixed(_PAGE, _TEAMS[team], 0.3))
            for deep, wide in marks.areas:
                area = self._box((side * (x - deep), -wide / 2), (side * x, wide / 2))
                brush.rectangle(area, outline=_CHALK, width=line)
            for place_x, place_y in marks.marks:
                brush.circle(self._at((side * place_x, place_y)), 1.6 * line, _CHALK)
        for corner in ((x, y), (-x, y), (-x, -y), (x, -y)):
            brush.polygon([self._at(corner), *map(self._at, _cut(corner, marks.corner))], _PAGE)
        brush.line(self._edge(), _CHALK, 2 * line, joint="curve")
        for side, team in ((-1, "home"), (1, "away")):
            back = side * (x + pitch.goal_depth)
            frame = [self._at(p) for p in ((side * x, -post), (back, -post), (back, post), (side * x, post))]
            brush.line(frame, _TEAMS[team], 2 * line, joint="curve")
        return image

    def _edge(self) -> list[Point]:
        """The line around the grass, closed."""
        x, y, cut = self._pitch.goal_x, self._pitch.width / 2, MARKINGS[self._pitch.kind].corner
        around = []
        for place, corner in enumerate(((x, y), (-x, y), (-x, -y), (x, -y))):
            along, across = _cut(corner, cut)
            around += [along, across] if place % 2 else [across, along]
        return [self._at(point) for point in (*around, *around[:2])]

    def _lit(self, brush: ImageDraw.ImageDraw, colour: Colour) -> None:
        """The edge of the pitch in the colour of who has just scored."""
        brush.line(self._edge(), colour, 3 * _FINE, joint="curve")

    def _paint_robot(self, brush: ImageDraw.ImageDraw, robot: Robot) -> None:
        x, y = self._at(robot.at)
        r, turn = self._robot * _FINE, robot.heading or 0.0

        def turned(*points: Point) -> list[Point]:
            cos, sin = math.cos(turn), math.sin(turn)
            return [(x + r * (a * cos - b * sin), y - r * (a * sin + b * cos)) for a, b in points]

        colour = _TEAMS[robot.team]
        if self._pitch.kind is Kind.VSSS:
            brush.polygon(turned(*_rounded(1.0 + 1.2 * _FINE / r)), _PAGE)
            brush.polygon(turned(*_rounded(1.0)), colour)
            for side in (-1.0, 1.0):
                wheel = ((-0.5, side), (0.5, side), (0.5, 0.76 * side), (-0.5, 0.76 * side))
                brush.polygon(turned(*wheel), _PAGE)
        else:
            brush.circle((x, y), r + 1.2 * _FINE, _PAGE)
            brush.circle((x, y), r, colour)
        back = 0.0
        if robot.heading is not None:
            brush.polygon(turned((0.95, 0.0), (0.5, 0.4), (0.5, -0.4)), _WHITE)
            back = 0.22 * r
        place = (x - back * math.cos(turn), y + back * math.sin(turn))
        brush.text(place, str(robot.number), _WHITE, _font(1.15 * self._robot), anchor="mm")

    def _paint_head(self, brush: ImageDraw.ImageDraw, moment: Snapshot) -> None:
        """Names at the teams' sides, score and clock between them."""
        middle = self._width / 2 * _FINE
        score = " : ".join("?" if goals is None else str(goals) for goals in moment.score)
        colour = _TEAMS.get(moment.scorer or "", _INK)
        brush.text((middle, 18 * _FINE), score, colour, _font(25), anchor="mm")
        minutes, seconds = divmod(int(moment.clock_s), 60)
        said = "goal!" if moment.scorer is not None else f"{minutes}:{seconds:02d}"
        brush.text((middle, 39 * _FINE), said, _MUTED if moment.scorer is None else colour, _font(11),
                   anchor="mm")
        room = middle - 50 * _FINE
        left, right = _MARGIN * _FINE, (self._width - _MARGIN) * _FINE
        brush.text((left, 20 * _FINE), _fitted(brush, self._names[0], room, 17), _TEAMS["home"], _font(17),
                   anchor="lm")
        brush.text((right, 20 * _FINE), _fitted(brush, self._names[1], room, 17), _TEAMS["away"], _font(17),
                   anchor="rm")

    def _paint_list(self, brush: ImageDraw.ImageDraw, robots: Sequence[Robot]) -> None:
        """Number and situation of each robot, home's on the left."""
        for team, left in (("home", _MARGIN), ("away", self._width / 2 + _MARGIN / 2)):
            mine = sorted((robot for robot in robots if robot.team == team), key=lambda robot: robot.number)
            for line, robot in enumerate(mine):
                middle = _FINE * (self._list + (line + 0.5) * _LINE)
                if middle + _FINE * _LINE / 2 > _FINE * self._size[1]:
                    break
                start = _FINE * left
                chip = (start, middle - 6 * _FINE, start + 14 * _FINE, middle + 6 * _FINE)
                brush.rounded_rectangle(chip, 3 * _FINE, _TEAMS[team])
                brush.text((start + 7 * _FINE, middle), str(robot.number), _WHITE, _font(9), anchor="mm")
                room = _FINE * (self._width / 2 - _MARGIN - 22)
                brush.text((start + 19 * _FINE, middle), _fitted(brush, robot.doing, room, 10.5), _INK,
                           _font(10.5), anchor="lm")


def _cut(corner: Point, leg: float) -> tuple[Point, Point]:
    """Ends of a corner's triangle: on the side line, and on the goal line."""
    x, y = corner
    return (x - math.copysign(leg, x), y), (x, y - math.copysign(leg, y))


def _rounded(half: float) -> list[Point]:
    """Corners of a square with cut corners; ``half`` is half its side."""
    cut = 0.2
    return [(a * half, b * half) for a, b in (
        (1, 1 - cut), (1 - cut, 1), (cut - 1, 1), (-1, 1 - cut), (-1, cut - 1), (cut - 1, -1), (1 - cut, -1),
        (1, cut - 1))]


def _mixed(one: Colour, other: Colour, part: float) -> Colour:
    """The colour ``one`` mixed with a ``part`` of the other, in [0, 1]."""
    a, b, c = (round(x + part * (y - x)) for x, y in zip(one, other, strict=True))
    return a, b, c


@cache
def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Pillow's own font, which is the same everywhere."""
    return ImageFont.load_default(size * _FINE)


def _fitted(brush: ImageDraw.ImageDraw, text: str, room: float, size: float) -> str:
    """The text, shortened to its room."""
    if brush.textlength(text, _font(size)) <= room:
        return text
    while text and brush.textlength(f"{text}…", _font(size)) > room:
        text = text[:-1].rstrip()
    return f"{text}…"
