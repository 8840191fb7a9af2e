"""Several cameras' detections as one sample of the pitch: each body once, at one time.

A round is one frame of each camera: it begins with a frame and ends before the next one of a camera that it
has, or before one that was captured more than ``_ROUND_S`` later. A sample is a round, at the time at which
its first frame was captured. What a camera captured later in the round is moved back to that time, along the
line from the camera's detection before: between two measurements, never beyond.

If several cameras see a body, its place is the mean of theirs, weighted by confidence. Vision filters of SSL
teams (TIGERs Mannheim, RoboJackets) merge the same way what a Kalman filter of each camera says, weighted
by its uncertainty. Here no filter comes before: stages of ours clean trajectories and take velocities.
"""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.game.pitch import SCALES, Kind
from pitchlore.pipeline.importers.ssl_logs.balls import BallChooser
from pitchlore.pipeline.importers.ssl_logs.groups import Groups, expanded, previous
from pitchlore.pipeline.importers.ssl_logs.samples import CapturedSamples
from pitchlore.pipeline.importers.ssl_logs.vision import (
    BALL,
    CAMERA,
    CAPTURE,
    CONFIDENCE,
    ID,
    NUMBER,
    ROBOTS,
    TEAM,
    THETA,
    Detections,
    X,
    Y,
)
from pitchlore.pipeline.numbers.arrays import F64, I64, Bools

#: Longest time between captures of one round, seconds: cameras of 25 Hz are the slowest in use.
_ROUND_S = 0.04
#: A detection before this is too old to draw a line from, seconds.
_LINE_S = 0.1
#: Cameras of one log; a division A pitch has four, the largest of tests had eight.
CAMERAS = 32
#: Balls of one camera's frame; of more, the first ones count.
_BALLS = 32
#: Detections of a robot nearer than its diameter are one, metres.
_ROBOT_M = 2 * SCALES[Kind.SSL].robot_radius
#: Two cameras' detections of one ball are nearer than this, metres: cameras disagree by centimetres.
_BALL_M = 0.1
#: Bodies that moved faster are others, m/s.
_FASTEST_BALL, _FASTEST_ROBOT = SCALES[Kind.SSL].max_ball_speed, SCALES[Kind.SSL].max_robot_speed
#: Where a robot was counts for so long, seconds.
_REMEMBERED_S = 1.0
#: Weight of a detection without confidence.
_LEAST_WEIGHT = 0.01
#: Robots of both teams.
_ALL = 2 * ROBOTS


class Limits(NamedTuple):
    """Limits of the detections that count.

    Attributes:
        robot, ball: least confidence of a detection.
        x, y: balls farther from the centre are not on the pitch, metres.
    """

    robot: float
    ball: float
    x: float
    y: float


class Merger:
    """Makes samples of detections as they come; it remembers what the cameras saw before.

    Args:
        limits: limits of the detections that count.

    Attributes:
        doubles: robots that were seen at two places at once; one of the two was left out.
        false_balls: balls that were seen and are not the ball.
        outside: balls that were seen beyond the pitch.
        unknown_cameras: frames of more cameras than ``CAMERAS``.
    """

    def __init__(self, limits: Limits) -> None:
        self.doubles = self.false_balls = self.outside = self.unknown_cameras = 0
        self._limits = limits
        self._cameras: dict[float, int] = {}
        self._open = Detections.none()  # frames of the round that may go on
        self._before = np.full((CAMERAS * _ALL, 4), np.nan)  # by camera and robot: time, x, y, theta
        self._last = np.full((_ALL, 3), np.nan)  # of each robot: time, x, y
        self._balls_before: dict[int, F64] = {}  # by camera: time, x, y of the balls of its last frame
        self._chooser = BallChooser()

    def add(self, found: Detections) -> CapturedSamples:
        """Samples of the rounds that end with these frames."""
        slots = self._slots(found)
        if (slots < 0).any():
            self.unknown_cameras += int((slots < 0).sum())
            found = found.where(slots >= 0)
        return self._merge(self._open.followed_by(found), last=False)

    def waiting(self) -> frozenset[float]:
        """Cameras that have a frame in the round that is not ended yet."""
        return frozenset(self._open.frames[:, CAMERA].tolist())

    def rest(self) -> CapturedSamples:
        """Sample of the round that was not ended yet."""
        return self._merge(self._open, last=True)

    def _slots(self, found: Detections) -> I64:
        """Our number of each frame's camera, in the order in which they appear; -1 from ``CAMERAS`` on."""
        cameras, first, which = np.unique(found.frames[:, CAMERA], return_index=True, return_inverse=True)
        for camera in cameras[np.argsort(first)].tolist():
            if len(self._cameras) < CAMERAS:
                self._cameras.setdefault(camera, len(self._cameras))
        return np.array([self._cameras.get(camera, -1) for camera in cameras.tolist()], dtype=np.int64)[which]

    def _merge(self, found: Detections, *, last: bool) -> CapturedSamples:
        slots = self._slots(found)
        edges = _rounds(found.frames[:, CAPTURE].tolist(), slots.tolist(), last=last)
        ended = found.until(int(edges[-1]))
        self._open = found.since(int(edges[-1]))
        round_of = np.repeat(np.arange(len(edges) - 1), np.diff(edges))
        t = np.minimum.reduceat(ended.frames[:, CAPTURE], edges[:-1]) if len(edges) > 1 else np.empty(0)
        number = np.nan_to_num(ended.frames[edges[:-1], NUMBER]).astype(np.int64)
        frame_of = np.repeat(np.arange(len(round_of)), np.diff(ended.offsets))
        bodies = ended.bodies.copy()
        bodies[np.isnan(bodies[:, CONFIDENCE]), CONFIDENCE] = 1.0
        is_ball = bodies[:, TEAM] == BALL
        seen = _Seen(round_of[frame_of], slots[: len(round_of)][frame_of], ended.frames[frame_of, CAPTURE],
                     t[round_of[frame_of]], bodies)
        robots, robots_of = self._robots(seen.where(~is_ball), t)
        x, y = self._balls(seen.where(is_ball), frame_of[is_ball], slots[: len(round_of)], t)
        ball = np.column_stack((x, y, np.full((len(t), 2), np.nan)))
        return CapturedSamples(ended.packets[edges[:-1]], t, number, ball, robots_of, robots)

    # --- robots

    def _robots(self, seen: _Seen, t: F64) -> tuple[F64, I64]:
        """Robots of the rounds, float64 [R, 8], and the round of each, int64 [R]."""
        robot = seen.bodies[:, TEAM].astype(np.int64) * ROBOTS + seen.bodies[:, ID].astype(np.int64)
        self._robots_onto_lines(seen, robot)
        seen, robot = seen.where(fits := seen.bodies[:, CONFIDENCE] >= self._limits.robot), robot[fits]
        groups = Groups.of(seen.round_of * _ALL + robot)
        seen = seen.where(groups.order)
        used = self._agreed(seen, groups, t)
        out = np.full((len(groups.key), 8), np.nan)
        out[:, TEAM], out[:, ID] = np.divmod(groups.key % _ALL, ROBOTS)
        out[:, X], out[:, Y] = _means(seen.bodies, groups, used)
        out[:, THETA] = _mean_angles(seen.bodies, groups, used)
        # where a robot was last, for the rounds that come
        self._last[groups.key % _ALL] = np.column_stack((t[groups.key // _ALL], out[:, X], out[:, Y]))
        return out, groups.key // _ALL

    def _robots_onto_lines(self, seen: _Seen, robot: I64) -> None:
        """Move the detections of robots to the time of their round, and remember them."""
        key = seen.slot * _ALL + robot
        now = np.column_stack((seen.captured, seen.bodies[:, [X, Y, THETA]]))
        before = previous(key, now, self._before)
        near = _away(now, before) <= _ROBOT_M + _FASTEST_ROBOT * (seen.captured - before[:, 0])
        share = _onto_lines(seen, before, near)
        turn = now[:, 3] - before[:, 3]
        turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
        back = (1 - share) * turn
        seen.bodies[:, THETA] -= np.where(near & np.isfinite(back), back, 0)

    def _agreed(self, seen: _Seen, groups: Groups, t: F64) -> Bools:
        """Mask of the detections that make a robot's place, bool [D].

        A robot that seems to be at two places is where it was last, else where the more confident one is.
        """
        used = np.ones(len(seen.bodies), np.bool_)
        spread = groups.spread(seen.bodies[:, X], seen.bodies[:, Y])
        disputed = np.flatnonzero(spread > _ROBOT_M)
        if not len(disputed):
            return used
        robot = groups.key % _ALL
        x, y = _means(seen.bodies, groups, used)  # of disputed ones put right below, in the order of rounds
        where = np.column_stack((t[groups.key // _ALL], x, y))
        for group, before in zip(disputed.tolist(), groups.before(robot)[disputed].tolist(), strict=True):
            was = where[before] if before >= 0 else self._last[robot[group]]
            low, high = groups.first[group], groups.first[group + 1]
            bodies = seen.bodies[low:high]
            known = abs(where[group, 0] - was[0]) <= _REMEMBERED_S
            cost = np.hypot(bodies[:, X] - was[1], bodies[:, Y] - was[2]) if known else -bodies[:, CONFIDENCE]
            best = bodies[int(np.argmin(cost))]
            near = np.hypot(bodies[:, X] - best[X], bodies[:, Y] - best[Y]) <= _ROBOT_M
            used[low:high] = near
            weight = np.maximum(bodies[near, CONFIDENCE], _LEAST_WEIGHT)
            where[group, 1:] = weight @ bodies[near][:, [X, Y]] / weight.sum()
            self.doubles += int((~near).sum())
        return used

    # --- balls

    def _balls(self, seen: _Seen, frame_of: I64, slots: I64, t: F64) -> tuple[F64, F64]:
        """The ball of each round: x and y, float64 [rounds], NaN where it is not seen."""
        limits = self._limits
        fits = seen.bodies[:, CONFIDENCE] >= limits.ball
        beyond = fits & ~((np.abs(seen.bodies[:, X]) <= limits.x) & (np.abs(seen.bodies[:, Y]) <= limits.y))
        self.outside += int(beyond.sum())
        offsets = np.searchsorted(frame_of, np.arange(len(slots) + 1))
        counted = np.arange(len(frame_of)) - offsets[frame_of] < _BALLS
        fits &= ~beyond
        self.false_balls += int((fits & ~counted).sum())
        seen, frame_of, fits = seen.where(counted), frame_of[counted], fits[counted]
        self._balls_onto_lines(seen, frame_of, slots)
        seen = seen.where(fits)
        x, y = np.full(len(t), np.nan), np.full(len(t), np.nan)
        edges = np.searchsorted(seen.round_of, np.arange(len(t) + 1)).tolist()
        places, confidence = seen.bodies[:, [X, Y]].tolist(), seen.bodies[:, CONFIDENCE].tolist()
        for r, at in enumerate(t.tolist()):
            low, high = edges[r], edges[r + 1]
            found = _one_each(places[low:high], confidence[low:high])
            chosen = self._chooser.choose(found[:_BALLS], at)
            self.false_balls += len(found) - (chosen is not None)
            if chosen is not None:
                x[r], y[r] = chosen
        return x, y

    def _balls_onto_lines(self, seen: _Seen, frame_of: I64, slots: I64) -> None:
        """Move the balls to the time of their round, from the nearest ball of the camera's frame before."""
        now = np.column_stack((seen.captured, seen.bodies[:, [X, Y]]))
        # balls of the frames before these, as frames 0, 1, …; then those of the frames
        old = [(slot, balls) for slot, balls in sorted(self._balls_before.items())]
        table = np.concatenate([*(balls for _, balls in old), now])
        counts = np.concatenate(([len(balls) for _, balls in old],
                                 np.bincount(frame_of, minlength=len(slots)))).astype(np.int64)
        first = np.concatenate(([0], np.cumsum(counts)))
        cameras = np.concatenate(([slot for slot, _ in old], slots)).astype(np.int64)
        order = np.argsort(cameras, kind="stable")
        same = cameras[order][1:] == cameras[order][:-1]
        before_of = np.full(len(cameras), -1)
        before_of[order[1:][same]] = order[:-1][same]
        before_of = before_of[len(old) + frame_of]
        pairs = np.where(before_of >= 0, counts[before_of], 0)
        ball, nth = expanded(pairs)
        other = first[before_of[ball]] + nth
        away = _away(now[ball], table[other])
        fits = away <= _BALL_M + _FASTEST_BALL * (now[ball, 0] - table[other, 0])
        ball, other, away = ball[fits], other[fits], away[fits]
        nearest = np.lexsort((away, ball))
        ball, other = ball[nearest], other[nearest]
        ball, at = np.unique(ball, return_index=True)
        before = np.full((len(now), 3), np.nan)
        before[ball] = table[other[at]]
        last = {int(camera): i for i, camera in enumerate(cameras.tolist())}
        self._balls_before = {camera: table[first[i] : first[i + 1]].copy() for camera, i in last.items()}
        _onto_lines(seen, before, np.isfinite(before[:, 0]))


class _Seen(NamedTuple):
    """Detections of the rounds, in their order.

    Attributes:
        round_of, slot: int64 [D], round and camera of each.
        captured, t: float64 [D], when it was captured, and the time of its round, seconds.
        bodies: float64 [D, 6], as in ``vision.Detections``.
    """

    round_of: I64
    slot: I64
    captured: F64
    t: F64
    bodies: F64

    def where(self, chosen: Bools | I64) -> _Seen:
        """The chosen ones."""
        return _Seen(self.round_of[chosen], self.slot[chosen], self.captured[chosen], self.t[chosen],
                     self.bodies[chosen])


def _rounds(captured: list[float], slots: list[int], *, last: bool) -> I64:
    """First frame of each round, and where the open one begins, int64 [rounds + 1]; ``last`` ends it, too."""
    edges = [0]
    there: set[int] = set()
    begin = captured[0] if captured else 0.0
    for i, (t, slot) in enumerate(zip(captured, slots, strict=True)):
        if there and (slot in there or not abs(t - begin) <= _ROUND_S):
            edges.append(i)
            there.clear()
            begin = t
        there.add(slot)
    if last and slots:
        edges.append(len(slots))
    return np.array(edges, dtype=np.int64)


def _away(now: F64, before: F64) -> F64:
    """Distance of places, each float64 [D, 3 or more] with time, x and y."""
    away: F64 = np.hypot(now[:, 1] - before[:, 1], now[:, 2] - before[:, 2])
    return away


def _onto_lines(seen: _Seen, before: F64, near: Bools) -> F64:
    """Move detections to where they were at their round's time, on lines from those before (time, x, y, …).

    Returns:
        How far each is along its line, 1 for the detection itself: where it stays if the time is not on it.
    """
    step = seen.captured - before[:, 0]
    on = near & (before[:, 0] <= seen.t) & (seen.t < seen.captured) & (step <= _LINE_S)
    share = np.ones(len(step))
    share[on] = (seen.t[on] - before[on, 0]) / step[on]
    for i, column in enumerate((X, Y), 1):
        seen.bodies[on, column] = before[on, i] + share[on] * (seen.bodies[on, column] - before[on, i])
    return share


def _means(bodies: F64, groups: Groups, used: Bools) -> tuple[F64, F64]:
    """Place of each group: the mean of its used detections, weighted by confidence; of one, itself."""
    weight = np.where(used, np.maximum(bodies[:, CONFIDENCE], _LEAST_WEIGHT), 0)
    total, alone = groups.sums(weight), groups.sums(used) == 1
    only = np.flatnonzero(used & alone[groups.of_row])
    found = []
    for column in (X, Y):
        mean = groups.sums(weight * bodies[:, column]) / total
        mean[groups.of_row[only]] = bodies[only, column]
        found.append(mean)
    return found[0], found[1]


def _mean_angles(bodies: F64, groups: Groups, used: Bools) -> F64:
    """Heading of each group, as its place; NaN where no detection has one."""
    theta = bodies[:, THETA]
    used = used & np.isfinite(theta)
    weight = np.where(used, np.maximum(bodies[:, CONFIDENCE], _LEAST_WEIGHT), 0)
    theta = np.where(used, theta, 0)
    sine, cosine = groups.sums(weight * np.sin(theta)), groups.sums(weight * np.cos(theta))
    mean = np.where(groups.sums(used) > 0, np.arctan2(sine, cosine), np.nan)
    alone = groups.sums(used) == 1
    only = np.flatnonzero(used & alone[groups.of_row])
    mean[groups.of_row[only]] = theta[only]
    return mean


def _one_each(places: list[list[float]], confidence: list[float]) -> list[tuple[float, float, float]]:
    """Balls of a round: x, y and confidence of each; several cameras' of one place are one."""
    if len(places) == 1:
        return [(*places[0], confidence[0])]  # type: ignore[list-item]
    found = []
    left = list(range(len(places)))
    while left:
        x, y = places[left[0]]
        near: list[int] = []
        far: list[int] = []
        for i in left:
            (near if hypot(places[i][0] - x, places[i][1] - y) <= _BALL_M else far).append(i)
        left = far
        weights = [max(confidence[i], _LEAST_WEIGHT) for i in near]
        if len(near) > 1:
            total = sum(weights)
            x = sum(weight * places[i][0] for weight, i in zip(weights, near, strict=True)) / total
            y = sum(weight * places[i][1] for weight, i in zip(weights, near, strict=True)) / total
        found.append((x, y, max(confidence[i] for i in near)))
    return found
