"""A match in memory, and its frames of reference.

Importers and the simulator make a :class:`MatchLog`, and the log stores one.
Time is integer nanoseconds since the first sample; lengths are metres; angles radians.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime
from typing import Annotated, Literal, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
import polars as pl
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from pitchlore.pipeline.base.text import NAME_CHARACTERS, printable
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.numbers.arrays import F32, I8, I64, Bools
from pitchlore.schemas import Commands, Decisions, Quality, Referee

A = TypeVar("A", np.float32, np.float64)

#: Most samples of a part of a match (:meth:`Frames.parts`): they stay in the cache.
PART = 1024

#: One robot in one frame, as in `schemas/Robot.msg`: NaN where the source does not know.
ROBOT_DTYPE = np.dtype(
    {
        "names": ["team", "id", "x", "y", "theta", "vx", "vy", "omega"],
        "formats": ["u1", "<u2", *["<f4"] * 6],
        "offsets": [0, 2, 4, 8, 12, 16, 20, 24],
        "itemsize": 28,
    }
)

#: The ball in one frame: NaN where it was not seen.
BALL_DTYPE = np.dtype([("x", "<f4"), ("y", "<f4"), ("vx", "<f4"), ("vy", "<f4")])


class Period(BaseModel):
    """A stretch of the match in which the home team attacks one way.

    Attributes:
        start_ns: first sample, inclusive.
        end_ns: end, exclusive.
        home_attacks: +1 if the home team attacks +x, -1 if -x.
        inferred: whether that was inferred from the bodies' positions.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    start_ns: int
    end_ns: int
    home_attacks: Literal[1, -1]
    inferred: bool


#: A name that a recording gives: what cannot be printed is escaped.
Name = Annotated[str, AfterValidator(lambda text: printable(text, NAME_CHARACTERS))]


class MatchInfo(BaseModel):
    """Facts of a match besides its samples; the log's metadata record.

    Attributes:
        match_id: ``<slug>-<hash>``.
        source: name of the file that was imported.
        format: format of the source, as its importer names it; world if the match was played here.
        recording: SHA-256 of the recording that was imported, inflated; None if the match was played here, or
            imported by an earlier version. It is the identity of the recording, of which the id has a part.
        home, away: the teams' names.
        started_at: time of the first sample, None where unknown.
        pitch: the field of play and its kind.
        periods: consecutive; they cover all samples.
        seed: seed of the simulator, None for recordings.
        settings: settings of the recording or the import.
        software: name and version of the writer.
        complete: whether the log has everything that the recorder wrote.
        incomplete_reason: reason if not.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    match_id: str = Field(pattern=r"^[a-z0-9][a-z0-9-]{0,63}$")
    source: Name
    format: str = Field(pattern=r"^[a-z0-9][a-z0-9-]*$")
    recording: str | None = Field(default=None, pattern=r"^[0-9a-f]{64}$")
    home: Name
    away: Name
    started_at: datetime | None = None
    pitch: Pitch
    periods: tuple[Period, ...] = ()
    seed: int | None = None
    settings: dict[str, object] = Field(default_factory=dict)
    software: str
    complete: bool = True
    incomplete_reason: str | None = None


@dataclass(frozen=True, slots=True)
class Frames:
    """Samples of a match, in the order in which they were recorded.

    Attributes:
        number: uint32 [F], the source's own frame number.
        t_ns: int64 [F], time since the first sample; not necessarily increasing, as recorded.
        ball: BALL_DTYPE [F], NaN where the ball was not seen.
        offsets: int64 [F + 1]; the robots of frame i are ``robots[offsets[i]:offsets[i + 1]]``.
        robots: ROBOT_DTYPE [offsets[-1]]; a robot that was not seen is not there.
    """

    number: npt.NDArray[np.uint32]
    t_ns: I64
    ball: npt.NDArray[np.void]
    offsets: I64
    robots: npt.NDArray[np.void]

    def __post_init__(self) -> None:
        frames = len(self.t_ns)
        assert self.number.shape == (frames,), "number is [F]"
        assert self.ball.shape == (frames,), "ball is [F]"
        assert self.ball.dtype == BALL_DTYPE, "ball is BALL_DTYPE"
        assert self.offsets.shape == (frames + 1,), "offsets is [F + 1]"
        assert self.robots.dtype == ROBOT_DTYPE, "robots is ROBOT_DTYPE"
        assert int(self.offsets[-1]) == len(self.robots), "offsets end at the last robot"

    def __len__(self) -> int:
        return len(self.t_ns)

    def counts(self) -> I64:
        """Number of robots in each frame, int64 [F]."""
        return np.diff(self.offsets)

    def most_robots(self) -> int:
        """The most robots that a team has in the whole match, those that were exchanged counted each."""
        seen: set[int] = set()
        for part in self.parts():
            seen.update(np.unique(part.robots["team"].astype(np.int64) << 16 | part.robots["id"]).tolist())
        return max(Counter(robot >> 16 for robot in seen).values(), default=0)

    def robot_frames(self) -> I64:
        """Index of the frame of each row of ``robots``, int64 [offsets[-1]]."""
        return np.repeat(np.arange(len(self), dtype=np.int64), self.counts())

    def parts(self) -> Iterator[Frames]:
        """The samples in parts of at most ``PART``, one after the other; no array is copied but offsets."""
        for first in range(0, len(self), PART):
            offsets = self.offsets[first:first + PART + 1]
            yield Frames(
                self.number[first:first + PART], self.t_ns[first:first + PART], self.ball[first:first + PART],
                offsets - offsets[0], self.robots[offsets[0]:offsets[-1]],
            )

    def where(self, chosen: Bools) -> Frames:
        """The frames that are chosen, by bool [F]."""
        counts = self.counts()
        return Frames(
            number=self.number[chosen], t_ns=self.t_ns[chosen], ball=self.ball[chosen],
            offsets=np.concatenate(([0], np.cumsum(counts[chosen]))).astype(np.int64),
            robots=self.robots[np.repeat(chosen, counts)],
        )

    def by_time(self) -> Frames:
        """The frames in order of time; those of one time keep their order."""
        if bool(np.all(np.diff(self.t_ns) >= 0)):
            return self
        order = np.argsort(self.t_ns, kind="stable")
        counts = self.counts()[order]
        offsets = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
        robots = np.arange(offsets[-1]) + np.repeat(self.offsets[order] - offsets[:-1], counts)
        return Frames(self.number[order], self.t_ns[order], self.ball[order], offsets, self.robots[robots])

    def followed_by(self, other: Frames) -> Frames:
        """These frames, and then the others."""
        return Frames(
            number=np.concatenate((self.number, other.number)), t_ns=np.concatenate((self.t_ns, other.t_ns)),
            ball=np.concatenate((self.ball, other.ball)),
            offsets=np.concatenate((self.offsets, other.offsets[1:] + self.offsets[-1])),
            # as bytes, because numpy drops the padding of records that it joins
            robots=np.frombuffer(self.robots.tobytes() + other.robots.tobytes(), ROBOT_DTYPE),
        )


class Heights(NamedTuple):
    """The ball's height where the source gives it: int64 [H] times of samples, ns, and float32 [H] metres."""

    t_ns: I64
    z: F32


#: No height is known.
NO_HEIGHTS = Heights(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.float32))

#: What a robot does from ``t_ns`` on, as its team logged it: a code of Table 1, 0 for none; team 0 is home.
OPTION_DTYPE = np.dtype([("t_ns", "<i8"), ("option", "<i2"), ("robot", "<i2"), ("team", "u1")])


def no_options() -> npt.NDArray[np.void]:
    """No option is logged, OPTION_DTYPE [0]."""
    return np.empty(0, dtype=OPTION_DTYPE)


@dataclass(frozen=True, slots=True)
class MatchLog:
    """A whole match, as an importer or the simulator makes it and the log holds it.

    Attributes:
        info: facts besides the samples.
        frames: the samples.
        referee: rows of schema Referee, in order of time.
        decisions: rows of schema Decisions; empty for foreign recordings.
        quality: rows of schema Quality, the flaws found while reading.
        commands: rows of schema Commands; empty where the source counts none.
        heights: the ball's heights, in order of time; empty where the source gives none.
        options: OPTION_DTYPE [O], changes of the options that teams logged, in order of time.
    """

    info: MatchInfo
    frames: Frames
    referee: pl.DataFrame = field(default_factory=Referee.empty)
    decisions: pl.DataFrame = field(default_factory=Decisions.empty)
    quality: pl.DataFrame = field(default_factory=Quality.empty)
    commands: pl.DataFrame = field(default_factory=Commands.empty)
    heights: Heights = NO_HEIGHTS
    options: npt.NDArray[np.void] = field(default_factory=no_options)


def wrap(angle: npt.NDArray[A]) -> npt.NDArray[A]:
    """Angle in (-pi, pi] radians, same shape and dtype; NaN stays NaN."""
    turn = angle.dtype.type(2 * np.pi)
    half = angle.dtype.type(np.pi)
    wrapped: npt.NDArray[A] = half - np.mod(half - angle, turn)
    return wrapped


def home_attacks(periods: tuple[Period, ...], t_ns: I64) -> I8:
    """Direction along x in which the home team attacks at each time, +1 or -1, int8 [F].

    A time outside all periods has the direction of the last period before it, one before all periods that
    of the first. Without periods the direction is +1.
    """
    if not periods:
        return np.ones(len(t_ns), dtype=np.int8)
    starts = np.array([p.start_ns for p in periods], dtype=np.int64)
    signs = np.array([p.home_attacks for p in periods], dtype=np.int8)
    return signs[np.clip(np.searchsorted(starts, t_ns, side="right") - 1, 0, None)]


def runs(mask: Bools) -> Iterator[tuple[int, int]]:
    """Half-open index ranges of the stretches where ``mask`` [F] is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    for start, end in edges.reshape(-1, 2):
        yield int(start), int(end)
