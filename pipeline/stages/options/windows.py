"""Windows of a robot's motion: where they are, and what each option would have made of them."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.game.bodies import BALL, COLUMNS, THETA, VX, VY, Records, X, Y, see
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.game.tactics.roles import assign
from pitchlore.pipeline.numbers.arrays import F32, F64, I8, I64, Bools
from pitchlore.pipeline.numbers.kernels import njit
from pitchlore.pipeline.settings import OptionSettings
from pitchlore.pipeline.stages.options.commands import commanded
from pitchlore.pipeline.stages.options.robots import RobotTraits, of_axle, traits_of
from pitchlore.pipeline.state.observation import see_from
from pitchlore.schemas import BODIES, SIDES
from pitchlore.schemas.options import OPTIONS
from pitchlore.schemas.sights import SIGHT

#: Parts of a window at whose ends motion is compared.
PARTS = 3
#: Bodies of other robots that are described, the nearest.
_NEAREST = 2
#: Numbers that describe a window whatever the option: motion at its start and at the end of each part, the
#: way, other robots, the ball, the walls ahead, behind, left and right, time between samples, noise.
_SHARED = 3 * (PARTS + 1) + 2 + 4 * _NEAREST + 4 + 4 + 2
#: Numbers that describe an option in it, the first of all: speeds and turns of its rims at the ends of parts,
#: mean commands, differences.
_OWN = 2 * PARTS + 2 + 2 * PARTS
FEATURES = _OWN + _SHARED
#: Numbers that describe the robots, after all others: top speed, acceleration and axle.
_ROBOTS = 3
#: Top speed and acceleration that are described, at most, m/s and m/s².
_TOP, _ACCELERATION = 1.2, 40.0
#: A wall that is further than this is as far, metres.
_FAR = 0.5
#: Columns of a body in the table trajectories.
_BODY = ("x", "y", "theta", "vx", "vy", "omega")


class Bodies(NamedTuple):
    """The bodies of a match at all its samples.

    Attributes:
        t_ns: int64 [T], times of samples.
        segment: int64 [T], stretch of play, -1 while play is stopped.
        places: float64 [T, 1 + 2 N, 6] in the pitch frame, home attacks +x; NaN where a body is not seen, or
            suspect.
        numbers: the robots' numbers of home and away, in order of their rows.
    """

    t_ns: I64
    segment: I64
    places: F64
    numbers: tuple[tuple[int, ...], tuple[int, ...]]

    @property
    def frame_s(self) -> float:
        """Usual time between samples, seconds."""
        return float(np.median(np.diff(self.t_ns))) / 1e9

    @property
    def noise(self) -> float:
        """Error of the ball's place from sample to sample, metres: half the median of its second differences.

        A rolling ball has hardly any; a ball that is hit has some, seldom.
        """
        second = np.abs(np.diff(self.places[:, BALL, :2], n=2, axis=0))
        return float(np.nanmedian(second)) / 2 if np.isfinite(second).any() else 0.0


class OptionWindows(NamedTuple):
    """The windows of one team's robots, in order of robot and time.

    Attributes:
        first: int64 [W], first samples.
        samples: samples of each.
        robot: int64 [W], row of the robot in its team's view, from 1.
        role: int64 [W], index in ROLES at the start.
        features: float32 [W, A, F], see :func:`describe`.
        sight: float32 [W, 30], what the robot sees at the start (``schemas.sights.SIGHT``).
        aims: int8 [W, A], row of the robot that an option is done to, -1 without one.
        robots: the robots that were described.
    """

    first: I64
    samples: int
    robot: I64
    role: I64
    features: F32
    sight: F32
    aims: I8
    robots: RobotTraits


def bodies(trajectories: pl.DataFrame, sample_s: float) -> Bodies:
    """The bodies of a match at samples that are no closer together than they need be.

    Args:
        trajectories: rows of schema Trajectories; a velocity that is not known counts as 0.
        sample_s: time between samples, seconds: of a quicker recording one of so many is kept, from the first
            of each stretch of play on.
    """
    sample = trajectories["frame"].rank("dense").to_numpy().astype(np.int64) - 1
    home, away = (tuple(trajectories.filter(pl.col("team") == side)["robot"].unique().sort().to_list())
                  for side in SIDES)
    count = max(len(home), len(away))
    row_of: dict[tuple[object, object], int] = {(side, number): 1 + team * count + place
              for team, (side, own) in enumerate(zip(SIDES, (home, away), strict=True))
              for place, number in enumerate(own)}
    samples = int(sample.max()) + 1
    t_ns, segment = np.zeros(samples, dtype=np.int64), np.full(samples, -1, dtype=np.int64)
    t_ns[sample] = trajectories["t_ns"].to_numpy()
    segment[sample] = trajectories["segment"].fill_null(-1).to_numpy()
    places = np.full((samples, 1 + 2 * count, COLUMNS), np.nan)
    rows = trajectories.with_row_index("row").filter(~pl.col("suspect"))
    for (team, number), part in rows.group_by("team", "robot"):
        row = BALL if team == BODIES[0] else row_of[team, number]
        found = part.select(*_BODY[:3], *(pl.col(name).fill_null(0.0) for name in _BODY[3:])).cast(pl.Float64)
        places[sample[part["row"].to_numpy()], row] = found.to_numpy()
    every = max(1, round(sample_s / (float(np.median(np.diff(t_ns))) / 1e9))) if samples > 1 else 1
    edges = np.flatnonzero(np.diff(segment, prepend=-2))
    since = np.arange(samples) - np.repeat(edges, np.diff(edges, append=samples))
    kept = since % every == 0
    return Bodies(t_ns[kept], segment[kept], places[kept], (home, away))


def windows_of(
    match: Bodies, team: int, pitch: Pitch, settings: OptionSettings, robots: RobotTraits | None = None
) -> OptionWindows:  # fmt: skip
    """All windows of a team's robots in which they and the ball are seen.

    Args:
        match: bodies of the match.
        team: 0 home, 1 away.
        pitch: pitch of the match.
        settings: length of windows, and what executors take robots for.
        robots: the team's robots; None: those of the settings, or as the match shows them.
    """
    packed = Measures.of(
        pitch, top=settings.wheel_speed, axle=settings.axle, acceleration=settings.wheel_acceleration,
        frame_s=match.frame_s,
    ).packed()
    samples = max(PARTS, round(settings.window_s / match.frame_s))
    at = starts(match.segment, ~np.isnan(match.places[:, BALL, X]), samples)
    begins = np.zeros(len(match.t_ns), dtype=np.bool_)
    begins[at] = True
    views = views_of(match.places, team)
    told = commanded(views, begins, packed)
    if robots is None:
        robots = (traits_of(views, match.segment, match.frame_s, told, pitch, settings)
                  if settings.robots == "measured" else RobotTraits.told(settings))
    if robots.axle != settings.axle:
        told = told._replace(rims=of_axle(told.rims, robots.axle / settings.axle))
    unseen = np.cumsum(np.isnan(told.rims[:, :, 0]), axis=0)
    lost = np.concatenate([np.zeros((1, unseen.shape[1]), dtype=unseen.dtype), unseen])
    first, robot = np.nonzero(lost[at + samples + 1] == lost[at])
    order = np.lexsort((first, robot))
    first, robot = at[first[order]], robot[order] + 1
    features = np.full((len(first), len(OPTIONS), FEATURES + _ROBOTS), np.nan, dtype=np.float32)
    sight = np.full((len(first), len(SIGHT)), np.nan, dtype=np.float32)
    role = np.zeros(len(first), dtype=np.int64)
    _describe_all(
        views, told.rims, told.wheels, robot, first, samples, match.noise, robots, packed, features, sight,
        role)
    return OptionWindows(
        first, samples, robot, role, features, sight, told.aims[first, robot - 1], robots)


@njit(cache=True, nogil=True)
def views_of(places: F64, team: int) -> F64:
    """Bodies at all samples as a team sees them, float64 [T, 1 + 2 N, 6]."""
    out = np.empty_like(places)
    for t in range(len(places)):
        see(places[t], team, 1.0 if team == 0 else -1.0, out[t])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _describe_all(
    views: F64, rims: F64, wheels: F32, robot: I64, first: I64, samples: int, noise: float,
    robots: RobotTraits, packed: Records, features: F32, sight: F32, role: I64,
) -> None:  # fmt: skip
    """Describe all windows; ``features``, ``sight`` and ``role`` are written."""
    roles = np.empty(views.shape[1] - 1, dtype=np.int64)
    for w in range(len(first)):
        describe(views, rims, wheels, robot[w], first[w], samples, noise, robots, packed, features[w])
        see_from(views[first[w]], robot[w], packed[0].goal_x, sight[w])
        assign(views[first[w]], packed[0], roles)
        role[w] = roles[robot[w] - 1]


def starts(segment: I64, seen: Bools, samples: int) -> I64:
    """First samples of all windows: one after the other from the start of each stretch of play.

    Args:
        segment: int64 [T], the stretch of play of each sample, -1 while play is stopped.
        seen: bool [T], whether the ball was seen.
        samples: samples of a window; it also needs the one after its last.

    Returns:
        int64 [W], ascending.
    """
    edges = np.flatnonzero(np.diff(segment, prepend=-2, append=-2))
    found = [np.arange(first, last - samples, samples)
             for first, last in pairwise(edges) if segment[first] >= 0]
    at = np.concatenate([np.empty(0, dtype=np.int64), *found])
    lost = np.concatenate([[0], np.cumsum(~seen)])
    found_all: I64 = at[lost[at + samples + 1] == lost[at]]
    return found_all


@njit(cache=True, nogil=True, error_model="numpy")
def describe(
    view: F64, rims: F64, wheels: F32, robot: int, first: int, samples: int, noise: float,
    robots: RobotTraits, packed: Records, out: F32,
) -> None:  # fmt: skip
    """Write the features of all options in a window.

    Lengths are metres and speeds m/s, in the frame that the robot has at the window's start.

    Args:
        view: float64 [T, 1 + 2 N, 6], bodies as the team sees them.
        rims: float64 [T, N, 2], see ``commands.Commanded``.
        wheels: float32 [T, N, A, 2], likewise.
        robot: row of the robot, 1 to N.
        first: first sample.
        samples: so many after it.
        noise: error of positions, metres.
        robots: the team's robots.
        packed: ``Measures.packed()``.
        out: float32 [A, FEATURES + 3], written.
    """
    m = packed[0]
    shared = np.full(_SHARED, np.nan, dtype=np.float32)
    here = view[first, robot]
    c, s = math.cos(here[THETA]), math.sin(here[THETA])
    place = 0
    for part in range(PARTS + 1):
        t = first + part * samples // PARTS
        body = view[t, robot]
        shared[place] = 0.5 * (rims[t, robot - 1, 0] + rims[t, robot - 1, 1])
        shared[place + 1] = 0.5 * (rims[t, robot - 1, 1] - rims[t, robot - 1, 0])
        shared[place + 2] = math.cos(body[THETA]) * body[VY] - math.sin(body[THETA]) * body[VX]
        place += 3
    dx, dy = view[first + samples, robot, X] - here[X], view[first + samples, robot, Y] - here[Y]
    shared[place], shared[place + 1] = c * dx + s * dy, c * dy - s * dx
    place += 2
    last = -1
    for _ in range(_NEAREST):
        best, least = -1, math.inf
        for other in range(1, view.shape[1]):
            away = math.hypot(view[first, other, X] - here[X], view[first, other, Y] - here[Y])
            if other != robot and other != last and away < least:
                best, least = other, away
        if best > 0:
            body = view[first, best]
            dx, dy = _nearer(body[X] - here[X], body[Y] - here[Y], robots.robot)
            shared[place], shared[place + 1] = c * dx + s * dy, c * dy - s * dx
            shared[place + 2], shared[place + 3] = c * body[VX] + s * body[VY], c * body[VY] - s * body[VX]
        last = best
        place += 4
    ball = view[first, BALL]
    dx, dy = _nearer(ball[X] - here[X], ball[Y] - here[Y], robots.ball)
    shared[place], shared[place + 1] = c * dx + s * dy, c * dy - s * dx
    shared[place + 2], shared[place + 3] = c * ball[VX] + s * ball[VY], c * ball[VY] - s * ball[VX]
    place += 4
    for quarter in range(4):
        ux = c if quarter == 0 else (-c if quarter == 1 else (-s if quarter == 2 else s))
        uy = s if quarter == 0 else (-s if quarter == 1 else (c if quarter == 2 else -c))
        off = min(_to_wall(here[X], ux, m.goal_x), _to_wall(here[Y], uy, m.half_width))
        shared[place] = min(off - robots.wall, _FAR)
        place += 1
    shared[place], shared[place + 1] = m.frame_s, noise
    change, top = robots.acceleration * m.frame_s, robots.top
    for option in range(wheels.shape[2]):
        left, right = rims[first, robot - 1, 0], rims[first, robot - 1, 1]
        mean, turn, part = 0.0, 0.0, 1
        for k in range(samples):
            told_left = wheels[first + k, robot - 1, option, 0]
            told_right = wheels[first + k, robot - 1, option, 1]
            if robots.together:
                most = max(abs(told_left), abs(told_right), top)
                told_left, told_right = told_left * top / most, told_right * top / most
            else:
                told_left, told_right = min(max(told_left, -top), top), min(max(told_right, -top), top)
            left += min(max(told_left - left, -change), change)
            right += min(max(told_right - right, -change), change)
            mean += 0.5 * (told_left + told_right) / samples
            turn += 0.5 * (told_right - told_left) / samples
            if k + 1 == part * samples // PARTS:
                at = 2 * (part - 1)
                out[option, at], out[option, at + 1] = 0.5 * (left + right), 0.5 * (right - left)
                apart = 2 * PARTS + 2 + at
                out[option, apart] = out[option, at] - shared[3 * part]
                out[option, apart + 1] = out[option, at + 1] - shared[3 * part + 1]
                part += 1
        out[option, 2 * PARTS], out[option, 2 * PARTS + 1] = mean, turn
        for place in range(_SHARED):
            out[option, _OWN + place] = shared[place]
        out[option, FEATURES] = min(top, _TOP)
        out[option, FEATURES + 1] = min(robots.acceleration, _ACCELERATION)
        out[option, FEATURES + 2] = robots.axle


@njit(cache=True, nogil=True, error_model="numpy")
def _nearer(dx: float, dy: float, by: float) -> tuple[float, float]:
    """A way that is shorter by so much, metres."""
    keeps = max(1.0 - by / max(math.hypot(dx, dy), 1e-9), 0.0)
    return dx * keeps, dy * keeps


@njit(cache=True, nogil=True, error_model="numpy")
def _to_wall(place: float, way: float, wall: float) -> float:
    """How far a wall is in a direction along one axis, metres; infinite if it runs along it."""
    if abs(way) < 1e-6:
        return math.inf
    return max(((wall if way > 0.0 else -wall) - place) / way, 0.0)
