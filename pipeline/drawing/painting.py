"""Pictures of a match from above, for films and the window; the only module that imports Pillow."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache, lru_cache
from itertools import pairwise
from typing import NamedTuple

from PIL import Image, ImageDraw, ImageFont

from pitchlore.pipeline.game.pitch import MARKINGS, SCALES, Kind, Markings, Pitch

#: A picture to paint on, RGB.
Canvas = Image.Image
Colour = tuple[int, int, int]
Point = tuple[float, float]

# The colours of the replay page in its dark mode.
PAGE, INK, MUTED, WHITE = (18, 22, 20), (232, 236, 233), (140, 151, 144), (255, 255, 255)
_GRASS, _STRIPE, _CHALK = (33, 60, 47), (36, 65, 51), (112, 140, 125)
TEAMS: dict[str, Colour] = {"home": (63, 158, 230), "away": (240, 138, 60)}

#: Pixels at a zoom of 1: the margin at both sides, and the height of names and score.
MARGIN, HEAD = 8, 50
#: Pixels at a zoom of 1: a line of a list of robots, and the space above and below the list.
LINE, FOOT = 16, 6
#: Lines of lists that are not painted again.
_REMEMBERED = 512
#: Factor by which a part of a picture is painted larger before it is reduced, which smooths edges.
_FINE = 3
#: Colours of a film's palette, and number of pictures that it is made from.
_COLOURS, _LOOKED_AT = 96, 16


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
    doing: str = ""


class Snapshot(NamedTuple):
    """Content of one picture.

    Attributes:
        clock: time in words.
        score: goals of home and away, None where unknown.
        trail: recent places of the ball, metres, the present one last; empty where it is not seen.
        robots: the robots seen.
        scorer: team that has just made a goal, None without one.
        home_attacks: +1 if home attacks +x, else -1.
        notes: words under the names of home and away.
    """

    clock: str
    score: tuple[int | None, int | None]
    trail: Sequence[Point]
    robots: Sequence[Robot]
    scorer: str | None = None
    home_attacks: int = 1
    notes: tuple[str, str] = ("", "")


class Painter:
    """Paints pictures of one match.

    Args:
        pitch: pitch of the match.
        markings: its lines.
        square: whether robots are boxes with two wheels, else discs.
        names: names of home and away.
        size: width and height of the picture, pixels.
        foot: height that stays free under the pitch, pixels.
        zoom: factor of margin, names, score and clock.
    """

    def __init__(
        self, pitch: Pitch, markings: Markings, names: tuple[str, str], size: tuple[int, int], foot: float,
        *, square: bool, zoom: float = 1.0,
    ) -> None:
        self._pitch, self._markings, self._names, self._square = pitch, markings, names, square
        self._width, self._zoom = size[0], zoom
        width, height = size[0] - 2 * MARGIN * zoom, size[1] - HEAD * zoom - foot
        self._scale = min(width / (pitch.length + 2 * pitch.goal_depth), height / pitch.width)
        self._centre = (size[0] / 2, HEAD * zoom + height / 2)
        scales = SCALES[pitch.kind]
        self.robot = max(scales.robot_radius * self._scale, 6.0)
        self._ball = max(scales.ball_radius * self._scale, 3.5)
        self._line = 0.004 * pitch.length * self._scale
        edge = _octagon(pitch.goal_x, pitch.width / 2, markings.corner)
        self._edge = [self.at(point) for point in edge]
        self.floor = Image.new("RGB", size, PAGE)
        self._paint_floor()
        self._still: Snapshot | None = None
        self._background = self.floor

    def paint(self, moment: Snapshot) -> Canvas:
        """The moment; the same bytes for the same moment."""
        still = moment._replace(trail=(), robots=())
        if still != self._still:
            self._still, self._background = still, self.floor.copy()
            self._paint_goals(moment.home_attacks)
            self._paint_head(moment)
        canvas = self._background.copy()
        if moment.scorer in TEAMS:
            with part(canvas, *self._edge, reach=3) as brush:
                brush.line([*self._edge, *self._edge[:2]], TEAMS[moment.scorer], 3)
        self._paint_trail(canvas, moment.trail)
        for robot in moment.robots:
            self._paint_robot(canvas, robot)
        if moment.trail:
            ball = self.at(moment.trail[-1])
            with part(canvas, ball, reach=self._ball + 2) as brush:
                brush.circle(ball, self._ball + 1, PAGE)
                brush.circle(ball, self._ball, WHITE)
        return canvas

    def at(self, place: Point) -> Point:
        """Pixel of a place on the pitch, given in metres."""
        return self._centre[0] + place[0] * self._scale, self._centre[1] - place[1] * self._scale

    def _paint_floor(self) -> None:
        """Paint what does not change: grass, lines, cut corners."""
        marks, line = self._markings, self._line
        x, y = self._pitch.goal_x, self._pitch.width / 2
        with part(self.floor, (0, 0), self.floor.size) as brush:
            brush.box(self.at((-x, y)), self.at((x, -y)), _GRASS)
            for stripe in range(-5, 5, 2):
                brush.box(self.at((stripe * x / 5, y)), self.at(((stripe + 1) * x / 5, -y)), _STRIPE)
            brush.line([self.at((0, -y)), self.at((0, y))], _CHALK, line)
            brush.circle(self.at((0, 0)), marks.circle * self._scale, _CHALK, line)
            for side in (-1, 1):
                for deep, wide in marks.areas:
                    area = ((x, wide / 2), (x - deep, wide / 2), (x - deep, -wide / 2), (x, -wide / 2))
                    brush.line([self.at((side * a, b)) for a, b in area], _CHALK, line)
                for a, b in marks.marks:
                    brush.circle(self.at((side * a, b)), 1.6 * line, _CHALK)
            corners = ((x, y), (-x, y), (-x, -y), (x, -y))
            for corner, one, other in zip(corners, self._edge[::2], self._edge[1::2], strict=True):
                brush.polygon([self.at(corner), one, other], PAGE)
            brush.line([*self._edge, *self._edge[:2]], _CHALK, 2 * line)

    def _paint_goals(self, home_attacks: int) -> None:
        """The goals, in the colours of those who keep them."""
        x, post = self._pitch.goal_x, self._pitch.goal_width / 2
        back = x + self._pitch.goal_depth
        for team, side in (("home", -home_attacks), ("away", home_attacks)):
            frame = [self.at((side * a, b)) for a, b in ((x, -post), (back, -post), (back, post), (x, post))]
            with part(self._background, *frame, reach=2 * self._line) as brush:
                brush.polygon(frame, _mixed(PAGE, TEAMS[team], 0.3))
                brush.line([frame[0], frame[-1]], _CHALK, 2 * self._line)
                brush.line(frame, TEAMS[team], 2 * self._line)

    def _paint_trail(self, canvas: Canvas, trail: Sequence[Point]) -> None:
        for age, (one, other) in enumerate(pairwise(map(self.at, trail)), start=1):
            share = age / len(trail)
            colour = _mixed(_GRASS, WHITE, 0.45 * share * share)
            with part(canvas, one, other, reach=self._ball) as brush:
                brush.line([one, other], colour, 1.7 * self._ball * share)

    def _paint_robot(self, canvas: Canvas, robot: Robot) -> None:
        (x, y), r, turn = self.at(robot.at), self.robot, robot.heading or 0.0
        cos, sin = math.cos(turn), math.sin(turn)

        def turned(points: Sequence[Point]) -> list[Point]:
            return [(x + r * (a * cos - b * sin), y - r * (a * sin + b * cos)) for a, b in points]

        with part(canvas, (x, y), reach=1.5 * r + 2) as brush:
            if self._square:
                half = 1.0 + 1.2 / r
                brush.polygon(turned(_octagon(half, half, 0.2)), PAGE)
                brush.polygon(turned(_octagon(1.0, 1.0, 0.2)), TEAMS[robot.team])
                for side in (-1.0, 1.0):
                    wheel = ((-0.5, side), (0.5, side), (0.5, 0.76 * side), (-0.5, 0.76 * side))
                    brush.polygon(turned(wheel), PAGE)
            else:
                brush.circle((x, y), r + 1.2, PAGE)
                brush.circle((x, y), r, TEAMS[robot.team])
            back = 0.0
            if robot.heading is not None:
                brush.polygon(turned(((0.95, 0.0), (0.5, 0.4), (0.5, -0.4))), WHITE)
                back = 0.22
            brush.write(str(robot.number), turned([(-back, 0.0)])[0], 1.15 * r, WHITE)

    def _paint_head(self, moment: Snapshot) -> None:
        """Names at the teams' sides, score and clock between them."""
        zoom, middle = self._zoom, self._width / 2
        score = " : ".join("?" if goals is None else str(goals) for goals in moment.score)
        colour = TEAMS.get(moment.scorer or "", INK)
        quiet = MUTED if moment.scorer is None else colour
        with part(self._background, (0, 0), (self._width, 46 * zoom)) as brush:
            brush.write(score, (middle, 18 * zoom), 25 * zoom, colour)
            brush.write(moment.clock, (middle, 39 * zoom), 11 * zoom, quiet)
            sides = (("home", MARGIN * zoom, "lm"), ("away", self._width - MARGIN * zoom, "rm"))
            for (team, x, anchor), name, note in zip(sides, self._names, moment.notes, strict=True):
                brush.write(name, (x, 20 * zoom), 17 * zoom, TEAMS[team], anchor, middle - 50 * zoom)
                brush.write(note, (x, 38 * zoom), 8 * zoom, MUTED, anchor)


class ListPainter:
    """Paints pictures of one match, and under the pitch the situation of each robot.

    Args:
        pitch: pitch of the match.
        names: names of home and away.
        size: width and height of the picture, pixels.
        foot: height under the pitch, pixels, which the list is in.
        zoom: factor of all but the pitch.
    """

    def __init__(
        self, pitch: Pitch, names: tuple[str, str], size: tuple[int, int], foot: float, *, zoom: float = 1.0
    ) -> None:
        self._size, self._top, self._zoom = size, size[1] - foot, zoom
        self._lines = int((foot / zoom - 2 * FOOT) / LINE + 1e-6)
        square = pitch.kind is Kind.VSSS
        self._painter = Painter(pitch, MARKINGS[pitch.kind], names, size, foot, square=square, zoom=zoom)
        self._line = lru_cache(_REMEMBERED)(self._new_line)  # most lines are those of the picture before

    def paint(self, moment: Snapshot) -> Canvas:
        """The moment; robots for whom there is no line are not listed."""
        picture, zoom = self._painter.paint(moment), self._zoom
        for team, left in (("home", 0), ("away", self._size[0] // 2)):
            mine = [robot for robot in moment.robots if robot.team == team]
            for line, robot in enumerate(mine[:self._lines]):
                top = round(self._top + (FOOT + line * LINE) * zoom)
                picture.paste(self._line(team, robot.number, robot.doing), (left, top))
        return picture

    def _new_line(self, team: str, number: int, doing: str) -> Canvas:
        """A line of the list: number and situation of a robot."""
        zoom, width = self._zoom, self._size[0] // 2
        canvas = Image.new("RGB", (width, round(LINE * zoom)), PAGE)
        left, middle = (1.0 if team == "home" else 0.5) * MARGIN * zoom, LINE * zoom / 2
        with part(canvas, (0, 0), canvas.size) as brush:
            corners = (left, middle - 6 * zoom), (left + 14 * zoom, middle + 6 * zoom)
            brush.box(*corners, TEAMS[team], radius=3 * zoom)
            brush.write(str(number), (left + 7 * zoom, middle), 9 * zoom, WHITE)
            room = width - (MARGIN + 22) * zoom
            brush.write(doing, (left + 19 * zoom, middle), 10.5 * zoom, INK, "lm", room)
        return canvas


class Brush(NamedTuple):
    """Paints on an enlarged part of a canvas; places and lengths are the canvas's, pixels."""

    draw: ImageDraw.ImageDraw
    corner: tuple[int, int]

    def _at(self, *points: Point) -> list[Point]:
        left, top = self.corner
        return [(_FINE * (x - left), _FINE * (y - top)) for x, y in points]

    def polygon(self, points: Sequence[Point], colour: Colour) -> None:
        """A filled polygon."""
        self.draw.polygon(self._at(*points), colour)

    def line(self, points: Sequence[Point], colour: Colour, width: float) -> None:
        """A line from point to point."""
        self.draw.line(self._at(*points), colour, round(_FINE * width), joint="curve")

    def box(self, one: Point, other: Point, colour: Colour, radius: float = 0.0) -> None:
        """A filled rectangle from its left upper to its right lower corner; the radius rounds its corners."""
        self.draw.rounded_rectangle(self._at(one, other), _FINE * radius, colour)

    def circle(self, centre: Point, radius: float, colour: Colour, width: float = 0.0) -> None:
        """A filled circle, or a ring of some width."""
        fill, around = (None, round(_FINE * width)) if width else (colour, 0)
        self.draw.circle(self._at(centre)[0], _FINE * radius, fill, colour, around)

    def write(
        self, text: str, at: Point, size: float, colour: Colour, anchor: str = "mm", room: float = math.inf
    ) -> None:
        """Text with its anchor (as Pillow names it) at a point, shortened to its room."""
        font, whole = _font(size), text
        while text and self.draw.textlength(text, font) > _FINE * room:
            whole = whole[:-1].rstrip()
            text = f"{whole}…" if whole else ""
        self.draw.text(self._at(at)[0], text, colour, font, anchor=anchor)


@contextmanager
def part(canvas: Canvas, *points: Point, reach: float = 0.0) -> Iterator[Brush]:
    """A brush for the rectangle around some points of a canvas, and for so much more on each side."""
    left, right = _span([x for x, _ in points], reach, canvas.width)
    top, low = _span([y for _, y in points], reach, canvas.height)
    size = (_FINE * (right - left), _FINE * (low - top))
    large = canvas.resize(size, Image.Resampling.NEAREST, (left, top, right, low))
    yield Brush(ImageDraw.Draw(large), (left, top))
    canvas.paste(large.reduce(_FINE), (left, top))


def gif(pictures: Sequence[Canvas], step_ms: int) -> bytes:
    """The pictures as one GIF that repeats for ever, all with one palette."""
    looked_at = pictures[::max(1, len(pictures) // _LOOKED_AT)]
    width, height = pictures[0].size
    together = Image.new("RGB", (width, height * len(looked_at)))
    for place, picture in enumerate(looked_at):
        together.paste(picture, (0, place * height))
    palette = together.quantize(_COLOURS, Image.Quantize.MEDIANCUT)
    first, *others = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures)
    buffer = io.BytesIO()
    first.save(buffer, "GIF", save_all=True, append_images=others, duration=step_ms, loop=0, optimize=True)
    return buffer.getvalue()


def png(picture: Canvas) -> bytes:
    """The picture as PNG."""
    buffer = io.BytesIO()
    picture.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def clock(seconds: float) -> str:
    """Whole minutes and seconds."""
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes}:{rest:02d}"


def _octagon(x: float, y: float, cut: float) -> list[Point]:
    """A rectangle with cut corners around the origin; x and y are half its sides."""
    return [
        (x, y - cut), (x - cut, y), (cut - x, y), (-x, y - cut),
        (-x, cut - y), (cut - x, -y), (x - cut, -y), (x, cut - y),
    ]


def _mixed(one: Colour, other: Colour, share: float) -> Colour:
    """The colour ``one`` mixed with a ``share`` of the other, in [0, 1]."""
    a, b, c = (round(x + share * (y - x)) for x, y in zip(one, other, strict=True))
    return a, b, c


def _span(values: Sequence[float], reach: float, size: int) -> tuple[int, int]:
    """First pixel and the one after the last, at least one of them in [0, size)."""
    first = min(max(math.floor(min(values) - reach), 0), size - 1)
    return first, max(min(math.ceil(max(values) + reach), size), first + 1)


@cache
def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Pillow's own font, which is the same everywhere."""
    return ImageFont.load_default(size * _FINE)
