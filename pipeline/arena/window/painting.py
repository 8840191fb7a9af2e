"""Draws a frame of a match."""

import math
from collections import deque
from functools import lru_cache

import pygame

from pipeline.arena.physics.laws import Marks
from pipeline.arena.physics.walls import CORNERS
from pipeline.arena.window.picture import Picture
from pipeline.bodies import BALL, F64, THETA, X, Y
from pipeline.matches.frame import AWAY, HOME
from pipeline.pitch import SCALES, Pitch

Colour = tuple[int, int, int]
Point = tuple[float, float]

# Colours of the replay page in dark mode.
_PAGE, _GRASS, _STRIPE, _CHALK = (18, 22, 20), (33, 60, 47), (36, 65, 51), (126, 156, 140)
_INK, _MUTED, _WHITE, _DRIVEN = (232, 236, 233), (152, 163, 156), (255, 255, 255), (255, 214, 77)
_TEAMS: dict[int, Colour] = {HOME: (63, 158, 230), AWAY: (240, 138, 60)}

_HEAD, _FOOT, _MARGIN = 84, 40, 22  # pixels
_FINE = 2  # what does not change is painted so many times larger, and smoothed
_TRAIL = 36  # frames


class WindowPainter:
    """Paints frames of one match on surfaces of one size.

    Args:
        pitch: of the match.
        names: of home and away.
        size: width and height, pixels.
        help_line: at the bottom.
    """

    def __init__(
        self, pitch: Pitch, names: tuple[str, str], size: tuple[int, int], help_line: str = ""
    ) -> None:
        self._pitch, self._names, self._size, self._help = pitch, names, size, help_line
        width, height = size[0] - 2 * _MARGIN, size[1] - _HEAD - _FOOT
        self._scale = min(width / (pitch.length + 2 * pitch.goal_depth), height / pitch.width)
        self._centre = (size[0] / 2, _HEAD + height / 2)
        scales = SCALES[pitch.kind]
        self._robot = max(scales.robot_radius * self._scale, 7.0)
        self._ball = max(scales.ball_radius * self._scale, 4.0)
        self._floor = self._paint_floor()
        self._sprites = {team: _robot(colour, self._robot) for team, colour in _TEAMS.items()}
        self._trail: deque[Point] = deque(maxlen=_TRAIL)

    def paint(self, surface: pygame.Surface, picture: Picture) -> None:
        """Paint a frame; the ball leaves a trail from call to call.

        Args:
            surface: of this painter's size.
            picture: its contents.
        """
        surface.blit(self._floor, (0, 0))
        self._paint_goals(surface, picture.home_attacks)
        self._paint_ball(surface, self._at(picture.bodies[BALL, X], picture.bodies[BALL, Y]))
        robots = (len(picture.bodies) - 1) // 2
        for row in range(1, len(picture.bodies)):
            team, number = (HOME, row) if row <= robots else (AWAY, row - robots)
            self._paint_robot(surface, picture.bodies[row], team, number)
        if picture.driven is not None:
            self._mark(surface, picture.bodies[picture.driven])
        self._paint_head(surface, picture)
        if picture.message:
            self._paint_message(surface, picture.message)

    def _at(self, x: float, y: float) -> Point:
        """Where a place on the pitch is on the surface."""
        return self._centre[0] + x * self._scale, self._centre[1] - y * self._scale

    def _paint_floor(self) -> pygame.Surface:
        """All that stays: the pitch with its markings, and the line at the bottom."""
        pitch, marks, scale = self._pitch, Marks.of(self._pitch), self._scale * _FINE
        fine = pygame.Surface((self._size[0] * _FINE, self._size[1] * _FINE))
        fine.fill(_PAGE)
        line = max(round(0.006 / 1.5 * pitch.length * scale), 2)

        def at(x: float, y: float) -> Point:
            left, top = self._at(x, y)
            return left * _FINE, top * _FINE

        def box(x: float, y: float, half_x: float, half_y: float) -> pygame.Rect:
            left, top = at(x - half_x, y + half_y)
            return pygame.Rect(round(left), round(top), round(2 * half_x * scale), round(2 * half_y * scale))

        end, side, cut = marks.goal_x, marks.side_y, CORNERS.get(pitch.kind, 0.0)
        pygame.draw.rect(fine, _GRASS, box(0.0, 0.0, end, side))
        for stripe in range(-5, 5, 2):
            pygame.draw.rect(fine, _STRIPE, box((stripe + 0.5) * end / 5, 0.0, end / 10, side))
        pygame.draw.line(fine, _CHALK, at(0, -side), at(0, side), line)
        pygame.draw.circle(fine, _CHALK, at(0, 0), marks.circle * scale, line)
        for sign in (-1, 1):
            depth = (end - marks.area_x) / 2
            pygame.draw.rect(fine, _CHALK, box(sign * (end - depth), 0.0, depth, marks.area_y), line)
            for y in (0.0, marks.mark_y, -marks.mark_y):
                pygame.draw.circle(fine, _CHALK, at(sign * marks.mark_x, y), 1.6 * line)
        corners = [(end, side), (-end, side), (-end, -side), (end, -side)]
        walls = []
        for x, y in corners:
            along, across = at(x - math.copysign(cut, x), y), at(x, y - math.copysign(cut, y))
            pygame.draw.polygon(fine, _PAGE, [at(x, y), along, across])
            walls += [across, along] if x * y > 0 else [along, across]
        for start, stop in zip(walls, walls[1:] + walls[:1], strict=True):
            pygame.draw.line(fine, _CHALK, start, stop, 2 * line)
            pygame.draw.circle(fine, _CHALK, stop, line)
        floor = pygame.transform.smoothscale(fine, self._size)
        _write(floor, self._help, (self._size[0] / 2, self._size[1] - _FOOT / 2), 15, _MUTED)
        return floor

    def _paint_goals(self, surface: pygame.Surface, home_attacks: int) -> None:
        """The goals, in the colours of those who keep them."""
        pitch = self._pitch
        size = (round(pitch.goal_depth * self._scale), round(pitch.goal_width * self._scale))
        for sign in (-1, 1):
            colour = _TEAMS[AWAY if sign == home_attacks else HOME]
            x = pitch.goal_x if sign > 0 else -pitch.goal_x - pitch.goal_depth
            left, top = self._at(x, pitch.goal_width / 2)
            net = pygame.Surface(size, pygame.SRCALPHA)
            net.fill((*colour, 70))
            surface.blit(net, (left, top))
            inner, outer = (left, left + size[0]) if sign > 0 else (left + size[0], left)
            low = top + size[1]
            posts = [(inner, top), (outer, top), (outer, low), (inner, low)]
            pygame.draw.lines(surface, colour, closed=False, points=posts, width=4)

    def _paint_ball(self, surface: pygame.Surface, at: Point) -> None:
        if self._trail and math.dist(self._trail[-1], at) > 0.2 * self._scale:
            self._trail.clear()  # it was put there
        self._trail.append(at)
        glow = pygame.Surface(self._size, pygame.SRCALPHA)
        for age, place in enumerate(reversed(self._trail)):
            left = 1 - age / _TRAIL
            faint = (*_WHITE, round(70 * left * left))
            pygame.draw.circle(glow, faint, place, self._ball * (0.35 + 0.5 * left))
        surface.blit(glow, (0, 0))
        pygame.draw.aacircle(surface, _PAGE, at, round(self._ball) + 2)
        pygame.draw.aacircle(surface, _WHITE, at, round(self._ball))

    def _paint_robot(self, surface: pygame.Surface, body: F64, team: int, number: int) -> None:
        x, y = self._at(body[X], body[Y])
        sprite = pygame.transform.rotozoom(self._sprites[team], math.degrees(body[THETA]), 1 / _FINE)
        surface.blit(sprite, sprite.get_rect(center=(round(x), round(y))))
        back = 0.14 * self._robot  # the arrow needs its room
        place = (x - back * math.cos(body[THETA]), y + back * math.sin(body[THETA]))
        _write(surface, str(number), place, round(1.05 * self._robot), _WHITE)

    def _mark(self, surface: pygame.Surface, body: F64) -> None:
        """A ring around the robot that is driven, and a pointer above it."""
        x, y = self._at(body[X], body[Y])
        pygame.draw.aacircle(surface, _DRIVEN, (x, y), round(1.75 * self._robot), 3)
        tip, half = y - 2.1 * self._robot, 0.34 * self._robot
        top = tip - 1.5 * half
        pygame.draw.polygon(surface, _DRIVEN, [(x, tip), (x - half, top), (x + half, top)])

    def _paint_head(self, surface: pygame.Surface, picture: Picture) -> None:
        """Names on the sides from which the teams come, score and clock between them."""
        middle = self._size[0] / 2
        _write(surface, f"{picture.score[HOME]} : {picture.score[AWAY]}", (middle, 32), 42, _INK)
        clock = f"{_clock(picture.clock_s)} of {_clock(picture.duration_s)}"
        _write(surface, clock, (middle, 66), 15, _MUTED)
        for team in (HOME, AWAY):
            away = 1 if team == AWAY else -1
            right = (picture.home_attacks > 0) == (team == HOME)
            _write(surface, self._names[team], (middle + away * 190, 30), 26, _TEAMS[team])
            aim = "attacks »" if right else "« attacks"
            _write(surface, aim, (middle + away * 190, 58), 14, _MUTED)

    def _paint_message(self, surface: pygame.Surface, message: str) -> None:
        words = _words(message, 44, _INK)
        box = words.get_rect(center=(round(self._centre[0]), round(self._centre[1])))
        plate = pygame.Surface(box.inflate(64, 32).size, pygame.SRCALPHA)
        pygame.draw.rect(plate, (*_PAGE, 205), plate.get_rect(), border_radius=16)
        surface.blit(plate, plate.get_rect(center=box.center))
        surface.blit(words, box)


def _robot(colour: Colour, radius: float) -> pygame.Surface:
    """A robot that heads to +x, ``_FINE`` times as large: two wheels, a body, an arrow at the front."""
    r = radius * _FINE
    room = math.ceil(2.2 * r)
    sprite = pygame.Surface((room, room), pygame.SRCALPHA)
    box = pygame.Rect(0, 0, round(2 * r), round(2 * r))
    box.center = (room // 2, room // 2)
    pygame.draw.rect(sprite, _PAGE, box.inflate(4, 4), border_radius=round(0.3 * r))
    pygame.draw.rect(sprite, colour, box, border_radius=round(0.26 * r))
    for top in (box.top + round(0.05 * r), box.bottom - round(0.29 * r)):
        wheel = pygame.Rect(box.centerx - round(0.5 * r), top, round(r), round(0.24 * r))
        pygame.draw.rect(sprite, _PAGE, wheel, border_radius=round(0.1 * r))
    front = [(box.right - part * r, box.centery + side * 0.42 * r)
             for part, side in ((0.06, 0), (0.46, -1), (0.46, 1))]
    pygame.draw.polygon(sprite, _WHITE, front)
    return sprite


def _clock(seconds: float) -> str:
    """Whole minutes and seconds."""
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes}:{rest:02d}"


@lru_cache(maxsize=512)
def _words(text: str, size: int, colour: Colour) -> pygame.Surface:
    """Text in pygame's own font, which is the same everywhere; smoothed, for its hints make it uneven."""
    large = pygame.font.Font(None, round(1.3 * size * _FINE)).render(text, True, colour)
    return pygame.transform.smoothscale(large, (large.get_width() // _FINE, large.get_height() // _FINE))


def _write(surface: pygame.Surface, text: str, at: Point, size: int, colour: Colour) -> None:
    """Write with the centre of the text at a point."""
    words = _words(text, size, colour)
    surface.blit(words, words.get_rect(center=(round(at[0]), round(at[1]))))
