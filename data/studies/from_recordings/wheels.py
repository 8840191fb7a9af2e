"""The wheel clone: what a team's robots told their wheels, as a function of what is seen, without any option.

The wheels are told from poses by the motor: a rim follows its command by at most ``wheel_acceleration``. A
rim that changes by less than that has the command's speed. Of one that changes as fast as it can no more is
known than that its command lies beyond, and the loss counts on one side only. A robot that touches another,
or is pushed aside, shows only the latter, at half the weight. Labels by the place at which a rim's change
ends were tried, too (data/studies/options).

A small network (numpy, single precision) gives both wheels of a robot from bodies in its own frame and in
that of the pitch, with noise on all numbers: it has to come back to where its team would be, whatever it has
done wrong. Its loss is that of Huber, with a narrow middle: nearer to the median than to the mean. No
regressor of scikit-learn has such a loss.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit

from pitchlore.pipeline import matches
from pitchlore.pipeline.arena.match.controllers import Controller, measures_of
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, Records, X, Y
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.game.tactics.measures import Measures
from pitchlore.pipeline.numbers.arrays import F32, F64, I64, Bools
from pitchlore.pipeline.settings import OptionSettings, TrajectorySettings
from pitchlore.pipeline.stages.options.windows import Bodies, bodies, views_of
from pitchlore.pipeline.stages.trajectories.derive import trajectories

#: Numbers that a robot's wheels are told from.
SEEN = 80
#: Every which sample is learned from; hidden units; passes, batch, step; noise in standard deviations.
EVERY, HIDDEN, PASSES, BATCH, STEP, NOISE = 3, (256, 256, 128), 4, 1024, 1e-3, 0.05
#: Error at which the loss becomes straight, and how far beyond a changing rim its command is, m/s.
_STRAIGHT, _BEYOND = 0.05, 0.08
#: A robot that moves aside faster than this slips, m/s; one nearer to another than this touches, radii.
_SLIPS, _TOUCHES = 0.05, 2.4
_FAR_M, _LONG_S, _SMALL = 0.25, 2.0, 1e-6


class Samples(NamedTuple):
    """Sights of robots, and all that is known of the commands to their wheels.

    Attributes:
        seen: float32 [K, SEEN].
        rims: float32 [K, 2], speeds of left and right rim one frame later, m/s.
        beyond: float32 [K, 2], 1 or -1 where the command is at least, at most, that; 0 where it is that.
        weights: float32 [K, 2].
    """

    seen: F32
    rims: F32
    beyond: F32
    weights: F32


class Clone(NamedTuple):
    """A network: weights [in, out] and biases of its layers; mean and scale of what it sees, float32."""

    weights: list[F32]
    biases: list[F32]
    mean: F32
    scale: F32

    def __call__(self, seen: F32) -> F32:
        """The wheels, float32 [K, 2], m/s, at what is seen, float32 [K, SEEN]."""
        return _forward((seen - self.mean) / self.scale, self.weights, self.biases)[-1]

    def write(self, path: Path) -> None:
        """Keep the network."""
        layers = {f"{kind}{i}": each for kind, own in (("w", self.weights), ("b", self.biases))
                  for i, each in enumerate(own)}
        np.savez(path, allow_pickle=False, mean=self.mean, scale=self.scale, **layers)

    @classmethod
    def read(cls, path: Path) -> Clone:
        """The network that was kept."""
        with np.load(path, allow_pickle=False) as arrays:
            layers = len(arrays.files) // 2 - 1
            return cls([arrays[f"w{i}"] for i in range(layers)], [arrays[f"b{i}"] for i in range(layers)],
                       arrays["mean"], arrays["scale"])


def by_steps(match: Bodies) -> Bodies:
    """The bodies with velocities from the step to each sample: of places alone, no more is known then."""
    places = match.places.copy()
    step = np.diff(match.places[:, :, :3], axis=0)
    step[:, :, THETA] = (step[:, :, THETA] + math.pi) % (2 * math.pi) - math.pi
    known = (match.segment[1:] == match.segment[:-1]) & (match.segment[1:] >= 0)
    seconds = np.diff(match.t_ns)[known, None, None] / 1e9
    places[1:][known, :, VX:] = step[known] / seconds
    places[:, BALL, OMEGA] = match.places[:, BALL, OMEGA]
    return match._replace(places=places)


def measured(pitch: Pitch, frame_s: float, settings: OptionSettings) -> Records:
    """The measures of a recorded match."""
    return Measures.of(pitch, top=settings.wheel_speed, axle=settings.axle,
                       acceleration=settings.wheel_acceleration, frame_s=frame_s).packed()


def playing(match: Bodies) -> Bools:
    """Samples of play at which all are seen, and that go on to the next; bool [T]."""
    on = (match.segment >= 0) & np.isfinite(match.places[:, :, :3]).all(axis=(1, 2), where=_needed(match))
    on[:-1] &= match.segment[1:] == match.segment[:-1]
    on[-1:] = False
    return on


def _needed(match: Bodies) -> Bools:
    """The numbers of places that have to be known: of bodies that are there; the ball has no heading."""
    return np.asarray(np.isfinite(match.places[:, :, :3]).any(axis=0, keepdims=True))


def samples(match: Bodies, team: int, pitch: Pitch, settings: OptionSettings, first: int = 0) -> Samples:
    """The samples of a team's robots in a match, and the same mirrored at the line between the goals.

    Args:
        match: bodies of the match, of a team that is seen as often as it decides.
        team: 0 home, 1 away.
        pitch: pitch of the match.
        settings: limits of robots.
        first: the sample from which one of ``EVERY`` is taken.
    """
    moved = by_steps(match)
    on, packed = playing(moved), measured(pitch, match.frame_s, settings)
    found = []
    for mirrored in (False, True):
        seen_by = views_of(moved.places, team)
        if mirrored:
            seen_by[:, :, [Y, THETA, VY, OMEGA]] *= -1.0
        robots = len(match.numbers[team])
        most = (len(on) // EVERY + 1) * robots
        out = Samples(*(np.zeros((most, width), dtype=np.float32) for width in (SEEN, 2, 2, 2)))
        count = _sample(seen_by, on, first, robots, settings.wheel_acceleration, packed, out)
        found.append(Samples(*(each[:count] for each in out)))
    return joined(found)


def joined(parts: Iterable[Samples]) -> Samples:
    """All samples."""
    return Samples(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def of_recordings(files: Sequence[Path], team: str, settings: OptionSettings) -> Samples:
    """The samples of a team's recordings, by its name in them."""
    found = []
    for place, path in enumerate(files):
        log = matches.read(path.read_bytes(), where=path.name)
        table, _ = trajectories(log, TrajectorySettings())
        side = 0 if log.info.home == team else 1
        found.append(samples(bodies(table, 1 / 60), side, log.info.pitch, settings, place % EVERY))
    return joined(found)


@njit(cache=True, nogil=True, error_model="numpy")
def _sample(
    views: F64, on: Bools, first: int, robots: int, acceleration: float, packed: Records, out: Samples
) -> int:
    m, count = packed[0], 0
    change = acceleration * m.frame_s
    seen = np.empty(SEEN)
    for t in range(first, len(views) - 2, EVERY):
        if not (on[t] and on[t + 1]):
            continue
        for robot in range(1, robots + 1):
            body, slips, known = views[t, robot], False, False
            cos, sin = math.cos(body[THETA]), math.sin(body[THETA])
            nearest = np.inf
            for other in range(1, views.shape[1]):
                if other != robot:
                    away = math.hypot(views[t, other, X] - body[X], views[t, other, Y] - body[Y])
                    nearest = min(nearest, away)
            slips = abs(cos * body[VY] - sin * body[VX]) >= _SLIPS or not nearest > _TOUCHES * m.radius
            for wheel in range(2):
                # a command shows half in the next step, and wholly in the one after it
                before, after = (_rim(views[t + 1, robot], wheel, m.axle),
                                 _rim(views[t + 2, robot], wheel, m.axle))
                out.rims[count, wheel] = after
                slips |= abs(after - before) > 1.15 * change
                far = abs(after - before) > 0.9 * change
                out.beyond[count, wheel] = (1.0 if after > before else -1.0) if far else 0.0
            for wheel in range(2):
                far = out.beyond[count, wheel]
                out.weights[count, wheel] = (0.5 if far != 0.0 else 0.0) if slips else 1.0
                if not slips:
                    out.rims[count, wheel] += _BEYOND * far
                known |= out.weights[count, wheel] > 0.0
            if known and not math.isnan(out.rims[count, 0] + out.rims[count, 1]):
                see_all(views[t], robot, packed, seen)
                out.seen[count] = seen
                count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _rim(body: F64, wheel: int, axle: float) -> float:
    """Speed at which the place of a wheel moves over the floor, m/s."""
    ahead = math.cos(body[THETA]) * body[VX] + math.sin(body[THETA]) * body[VY]
    return float(ahead + (wheel - 0.5) * axle * body[OMEGA])


@njit(cache=True, nogil=True, error_model="numpy")
def see_all(view: F64, robot: int, packed: Records, out: F64) -> None:
    """Write what a robot's wheels are told from, float64 [SEEN]; a robot that is not there is 0.

    Args:
        view: float64 [1 + 2 N, 6], the team's; all that are there are seen.
        robot: row of the robot, 1 to N.
        packed: ``Measures.packed()``.
        out: written: the robot, the ball; ball and robot beside either goal; where the ball crosses the own
            line; team-mates, the deeper first; adversaries, the nearest first.
    """
    m, count = packed[0], (len(view) - 1) // 2
    out[:] = 0.0
    body, ball = view[robot], view[BALL]
    x, y = body[X], body[Y]
    c, s = math.cos(body[THETA]), math.sin(body[THETA])
    out[0], out[1], out[2], out[3] = x, y, c, s
    out[4], out[6] = c * body[VX] + s * body[VY], c * body[VY] - s * body[VX]
    out[5] = 0.5 * m.axle * body[OMEGA]
    bx, by, vx, vy = ball[X], ball[Y], ball[VX], ball[VY]
    dx, dy = bx - x, by - y
    away = math.hypot(dx, dy) + _SMALL
    out[7], out[8], out[9], out[10], out[11], out[12], out[13] = bx, by, vx, vy, dx, dy, away
    out[14], out[15] = (c * dx + s * dy) / away, (c * dy - s * dx) / away
    out[16], out[17], out[18] = c * vx + s * vy, c * vy - s * vx, min(away, 0.2)
    out[19], out[20] = c * dx + s * dy, c * dy - s * dx
    k = 21
    for goal_x in (m.goal_x, -m.goal_x):
        gx, gy = goal_x - bx, -by
        length = math.hypot(gx, gy) + _SMALL
        ux, uy = gx / length, gy / length
        out[k], out[k + 1] = dx * ux + dy * uy, dy * ux - dx * uy
        out[k + 2], out[k + 3], out[k + 4] = c * ux + s * uy, s * ux - c * uy, length
        out[k + 5], out[k + 6] = out[k] / away, out[k + 1] / away
        hx, hy = goal_x - x, -y
        length = math.hypot(hx, hy) + _SMALL
        out[k + 7], out[k + 8], out[k + 9] = length, (c * hx + s * hy) / length, (c * hy - s * hx) / length
        k += 10
    comes = vx < -0.05
    seconds = min((bx + m.goal_x) / -vx, _LONG_S) if comes else _LONG_S
    crosses = min(max(by + (vy * seconds if comes else 0.0), -0.3), 0.3)
    out[k], out[k + 1], out[k + 2] = crosses, crosses - y, seconds
    k += 3
    deep, gx, gy = math.hypot(x + m.goal_x, y), m.goal_x - bx, -by
    length = math.hypot(gx, gy) + _SMALL
    last = 0
    for _ in range(2):
        mate, least = 0, np.inf
        for other in range(1, count + 1):
            depth = math.hypot(view[other, X] + m.goal_x, view[other, Y])
            if other != robot and other != last and depth < least:
                mate, least = other, depth
        if mate > 0:
            ox, oy = view[mate, X] - x, view[mate, Y] - y
            jx, jy = bx - view[mate, X], by - view[mate, Y]
            off = math.hypot(ox, oy)
            out[k], out[k + 1], out[k + 2], out[k + 3] = ox, oy, min(off, _FAR_M), math.hypot(jx, jy) - away
            out[k + 4], out[k + 5] = max(-(jx * gx + jy * gy) / length, 0.0), deep - least
            out[k + 6] = (c * ox + s * oy) / (off + _SMALL)
        last = mate
        k += 7
    nearest, second = 0, 0
    for _ in range(3):
        found, least = 0, np.inf
        for other in range(count + 1, 2 * count + 1):
            off = math.hypot(view[other, X] - x, view[other, Y] - y)
            if other != nearest and other != second and off < least:
                found, least = other, off
        if found > 0:
            ox, oy, off = view[found, X] - x, view[found, Y] - y, least + _SMALL
            out[k], out[k + 1], out[k + 2] = ox, oy, min(least, _FAR_M)
            out[k + 3], out[k + 4] = (c * ox + s * oy) / off, (c * oy - s * ox) / off
        nearest, second = (found, second) if nearest == 0 else (nearest, found)
        k += 5


def fit(known: Samples, hidden: Sequence[int] = HIDDEN, passes: int = PASSES, seed: int = 0) -> Clone:
    """Learn a team's wheels, by Adam (Kingma and Ba 2015) with a step that falls to 0 by half a cosine."""
    rng = np.random.default_rng(seed)
    mean, scale = known.seen.mean(axis=0), known.seen.std(axis=0)
    scale[scale < 1e-4] = 1.0
    seen = (known.seen - mean) / scale
    sizes = (SEEN, *hidden, 2)
    weights = [(rng.standard_normal((one, other)) * math.sqrt(2 / one)).astype(np.float32)
               for one, other in pairwise(sizes)]
    weights[-1] *= 0.1
    biases = [np.zeros(size, dtype=np.float32) for size in sizes[1:]]
    own = weights + biases
    first, second = ([np.zeros_like(each) for each in own] for _ in range(2))
    batch = min(BATCH, len(seen))
    steps, done = passes * (len(seen) // batch), 0
    for _ in range(passes):
        order = rng.permutation(len(seen))
        for k in range(len(seen) // batch):
            rows = order[k * batch:(k + 1) * batch]
            noisy = seen[rows] + NOISE * rng.standard_normal((batch, SEEN), dtype=np.float32)
            layers = _forward(noisy, weights, biases)
            slopes = _backward(layers, weights, _slope(layers[-1], known, rows))
            done += 1
            step = STEP * min(1.0, done / 500) * 0.5 * (1 + math.cos(math.pi * done / steps))
            for place, slope in enumerate(slopes):
                first[place] += 0.1 * (slope - first[place])
                second[place] += 0.001 * (slope * slope - second[place])
                spread = np.sqrt(second[place] / (1 - 0.999**done)) + 1e-8
                own[place] -= (step / (1 - 0.9**done)) * first[place] / spread
    return Clone(weights, biases, mean, scale)


def _slope(told: F32, known: Samples, rows: I64) -> F32:
    """The slope of the loss at what wheels are told, float32 [B, 2]."""
    error, beyond = told - known.rims[rows], known.beyond[rows]
    counts = known.weights[rows] * ~((error * beyond) > 0.0)
    slope: F32 = (counts * np.clip(error / _STRAIGHT, -1.0, 1.0) / len(rows)).astype(np.float32)
    return slope


def _forward(seen: F32, weights: list[F32], biases: list[F32]) -> list[F32]:
    """The input of each layer, and the output of the last."""
    layers = [seen]
    for place, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        out = layers[-1] @ weight + bias
        layers.append(np.maximum(out, 0.0) if place + 1 < len(weights) else out)
    return layers


def _backward(layers: list[F32], weights: list[F32], slope: F32) -> list[F32]:
    """The slopes of all weights, then of all biases."""
    of_weights, of_biases = list[F32](), list[F32]()
    for place in range(len(weights) - 1, -1, -1):
        of_weights.insert(0, layers[place].T @ slope)
        of_biases.insert(0, slope.sum(axis=0))
        if place:
            slope = slope @ weights[place].T * (layers[place] > 0.0)
    return of_weights + of_biases


class WheelController(Controller):
    """Plays a wheel clone. Velocities are those from the frame before, as in recordings.

    Args:
        clone: the network.
        recipe: recipe of the match.
    """

    def __init__(self, clone: Clone, recipe: Recipe) -> None:
        self._clone, self._measures = clone, measures_of(recipe).packed()
        self._seen = np.zeros((recipe.robots, SEEN))
        self._before: F64 | None = None

    def restarted(self, frame: int, lead: int) -> None:  # noqa: D102
        self._before = None

    def think(self, frame: int, view: F64, wheels: F64) -> None:  # noqa: D102
        moved = view.copy()
        if self._before is not None:
            step = view[:, :3] - self._before[:, :3]
            step[:, THETA] = (step[:, THETA] + math.pi) % (2 * math.pi) - math.pi
            moved[:, VX:] = step / self._measures[0]["frame_s"]
        self._before = view.copy()
        for robot, seen in enumerate(self._seen, start=1):
            see_all(moved, robot, self._measures, seen)
        top = float(self._measures[0]["top"])
        wheels[:] = np.clip(self._clone(self._seen.astype(np.float32)), -top, top)
