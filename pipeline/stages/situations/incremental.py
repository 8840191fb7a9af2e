"""Situations of a match that comes part by part, while it is played.

At any moment they are those that :func:`pipeline.stages.situations.recognise.recognise` finds in the
rows so far.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt
import polars as pl

from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.settings import SituationSettings
from pitchlore.pipeline.stages.situations import signals
from pitchlore.pipeline.stages.situations.dense import DenseMatch, Densifier
from pitchlore.pipeline.stages.situations.matching import Fill, Worker, groups
from pitchlore.pipeline.stages.situations.naming import Robots, situation_rows, situations
from pitchlore.pipeline.stages.situations.occurrences import OCCURRENCE, RobotSamples, Rows, comes_back
from pitchlore.pipeline.stages.situations.rulebook import compiled
from pitchlore.schemas import Situations

#: A robot: 0 home or 1 away, and its number.
_Body = tuple[int, int]

_T = TypeVar("_T", bound=np.generic)


class Recogniser:
    """Recognises the situations of a match that comes part by part.

    What the rules keep of earlier samples is carried from part to part. The priorities decide anew at each
    call about the segment of play that is open, because a later situation may take samples from an earlier
    one. When a segment is over, its situations are settled, and nothing is kept of it.

    Args:
        match_id: id of the match.
        pitch: the field of play; its kind scales distances and speeds.
        settings: thresholds and times.
    """

    def __init__(self, match_id: str, pitch: Pitch, settings: SituationSettings) -> None:
        self._match_id, self._pitch, self._settings = match_id, pitch, settings
        self._dense = Densifier(SCALES[pitch.kind])
        self._workers = {name: Worker(rules, settings) for name, rules in compiled(pitch.kind).items()}
        self._bodies: dict[_Body, int] = {}
        self._roles: dict[_Body, int] = {}
        self._segment: _Segment | None = None

    def take(self, trajectories: pl.DataFrame) -> pl.DataFrame:
        """Take up the next samples.

        Args:
            trajectories: rows of schema Trajectories of the match, sorted as it says, all of them later than
                those before.

        Returns:
            Rows of schema Situations, sorted as it says: those of the segments that these samples end. They
            do not change any more.

        Raises:
            SchemaMismatch: if the table is not sorted.
        """
        if trajectories.is_empty():
            return Situations.empty()
        part = self._dense.take(trajectories)
        distances = signals.ball_distances(part.poses, part.ball)
        settled = []
        edges = [0, *(np.flatnonzero(np.diff(part.segment)) + 1).tolist(), len(part.t_ns)]
        for start, end in pairwise(edges):
            number = int(part.segment[start])
            if self._segment is not None and self._segment.number != number:
                settled.append(self._of(self._segment, int(part.t_ns[start])))
                self._segment = None
            if number >= 0:
                self._segment = self._segment or _Segment(number)
                self._go_on(self._segment, part, distances, start, end)
            self._see(part, end)
        found = pl.concat([Situations.empty(), *settled])
        return found.sort("team", "robot", "start_ns", maintain_order=True)

    def open(self) -> pl.DataFrame:
        """Rows of schema Situations of the open segment, as they are if the match ends here; sorted."""
        return Situations.empty() if self._segment is None else self._of(self._segment, None)

    def _see(self, part: DenseMatch, end: int) -> None:
        """Keep the roles as they are before sample ``end`` of a part."""
        for row, body in enumerate(_bodies(part)):
            self._roles[body] = int(part.role[row, end - 1])

    def _go_on(self, segment: _Segment, part: DenseMatch, distances: F64, start: int, end: int) -> None:
        """Take up samples [start, end) of a part, which are of one segment."""
        bodies = _bodies(part)
        places = len(segment.t_ns)
        segment.t_ns.extend(part.t_ns[start:end])
        for body in bodies:
            self._bodies.setdefault(body, len(self._bodies))
        known = {body: row for row, body in enumerate(bodies)}
        for body, number in self._bodies.items():
            if number not in segment.roles:
                segment.roles[number] = Grown(np.int8)
                segment.roles[number].extend(np.full(places, self._roles.get(body, -1), np.int8))
            row = known.get(body)
            if row is None:
                segment.roles[number].extend(np.full(end - start, self._roles[body], np.int8))
            else:
                segment.roles[number].extend(part.role[row, start:end])
        for row, body in enumerate(bodies):
            index = np.flatnonzero(part.present[row, start:end]) + start
            if not len(index):
                continue
            robot = segment.robots.setdefault(self._bodies[body], _Robot())
            first = robot.extend(index - start + places, part.t_ns[index], self._settings.flicker_s)
            met = set()
            for group, other, fill in groups(row, part, index, distances, self._pitch):
                number = -1 if other < 0 else self._bodies[bodies[other]]
                met.add((group, number))
                self._match(robot, group, number, first, fill)
            back = np.flatnonzero(robot.fresh.all[first:])
            if len(back):
                for (group, number), run in robot.runs.items():
                    if (group, number) not in met:
                        run.found += self._workers[group].interrupted(
                            robot.t_ns.all[: first + back[0]], number, run.marks)

    def _match(self, robot: _Robot, group: str, other: int, first: int, fill: Fill) -> None:
        """Run a group of rules over a robot's samples from ``first`` on."""
        worker = self._workers[group]
        run = robot.runs.get((group, other))
        if run is None:
            run = robot.runs[group, other] = _Run(worker.marks())
        for ended in worker.advance(robot.t_ns.all, robot.fresh.all, first, other, fill, run.marks):
            run.found += ended

    def _of(self, segment: _Segment, follows: int | None) -> pl.DataFrame:
        """Situations of a segment; ``follows`` is the time of the first sample after it, if there is one."""
        times = segment.t_ns.all
        median = int(np.median(np.diff(times))) if len(times) > 1 else 0
        until = times if follows is None else np.append(times, follows)
        order = sorted(self._bodies)
        rank = np.empty(len(order), np.int64)
        rank[[self._bodies[body] for body in order]] = np.arange(len(order))
        robots = Robots(
            team=np.array([team for team, _ in order], np.int8),
            robot=np.array([number for _, number in order], np.int64),
            role=np.array([segment.roles[self._bodies[body]].all for body in order]),
            segment=np.full(len(times), segment.number, np.int32),
        )
        parts = []
        for row, body in enumerate(order):
            robot = segment.robots.get(self._bodies[body])
            if robot is None:
                continue
            samples = RobotSamples.of(
                robot.place.all, robot.t_ns.all, robot.fresh.all, until, np.full(len(times), median))
            found = self._occurrences(robot, samples, rank)
            parts.append(situations(row, robots, samples, found, self._settings))
        return situation_rows(robots, self._match_id, parts)

    def _occurrences(self, robot: _Robot, samples: RobotSamples, rank: I64) -> Rows:
        """Occurrences so far, OCCURRENCE [M]; ``rank`` has the row of each body, numbered as they came."""
        parts, ended = [], dict[str, bytearray]()
        for (group, other), run in robot.runs.items():
            worker = self._workers[group]
            if worker.lasts:
                parts.append(worker.finish(bytes(run.found), samples, other, run.marks).tobytes())
            else:  # those of all other robots at once
                ended.setdefault(group, bytearray()).extend(run.found)
        parts += [self._workers[group].named(bytes(found)).tobytes() for group, found in ended.items()]
        found = np.frombuffer(b"".join(parts), OCCURRENCE).copy()
        seen = found["other"] >= 0
        found["other"][seen] = rank[found["other"][seen]]
        return found


class Grown(Generic[_T]):
    """An array that grows at its end."""

    def __init__(self, dtype: type[_T]) -> None:
        self._space = np.empty(64, dtype)
        self._length = 0

    def __len__(self) -> int:
        return self._length

    def extend(self, values: npt.NDArray[_T]) -> None:
        """Append values [n]."""
        end = self._length + len(values)
        if end > len(self._space):
            space = np.empty(2 * end, self._space.dtype)
            space[: self._length] = self.all
            self._space = space
        self._space[self._length:end] = values
        self._length = end

    @property
    def all(self) -> npt.NDArray[_T]:
        """The values, a view."""
        return self._space[: self._length]


@dataclass
class _Run:
    """A group of rules over the samples of a robot so far: its marks, and the occurrences that ended."""

    marks: Rows
    found: bytearray = field(default_factory=bytearray)


@dataclass
class _Robot:
    """Samples of a robot in a segment: place in the segment, time, whether a piece begins; and its rules."""

    place: Grown[np.int64] = field(default_factory=lambda: Grown(np.int64))
    t_ns: Grown[np.int64] = field(default_factory=lambda: Grown(np.int64))
    fresh: Grown[np.bool_] = field(default_factory=lambda: Grown(np.bool_))
    runs: dict[tuple[str, int], _Run] = field(default_factory=dict)

    def extend(self, place: I64, t_ns: I64, flicker_s: float) -> int:
        """Append samples. Returns the number of the first of them."""
        first = len(self.t_ns)
        self.place.extend(place)
        self.t_ns.extend(t_ns)
        last = max(first - 1, 0)
        back = comes_back(self.place.all[last:], self.t_ns.all[last:], flicker_s)
        self.fresh.extend(back if first else np.concatenate(([True], back)))
        return first


@dataclass
class _Segment:
    """The open segment: its number, its samples' times; roles and samples of the bodies, as they came."""

    number: int
    t_ns: Grown[np.int64] = field(default_factory=lambda: Grown(np.int64))
    roles: dict[int, Grown[np.int8]] = field(default_factory=dict)
    robots: dict[int, _Robot] = field(default_factory=dict)


def _bodies(part: DenseMatch) -> list[_Body]:
    return list(zip(part.team.tolist(), part.robot.tolist(), strict=True))
