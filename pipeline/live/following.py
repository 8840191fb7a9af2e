"""A match as it is played: its bodies, and their situations as they are recognised.

The frames of the last second become trajectories as those of a log do. A sample is settled when what its
velocities are taken from has come, 0.05 s later. Settled samples go to the incremental recogniser.

What is known only later is not known here: that a body which seems to jump was put elsewhere (0.25 s later),
that frames come late, and what kind of stop a referee's word is. And a segment of play begins anew each
minute. There the situations of the log differ.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.drawing.painting import Point, Robot
from pitchlore.pipeline.game.pitch import PITCHES, SCALES, Kind, Pitch
from pitchlore.pipeline.importers.directions import WEAK, votes_of
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import LeagueName
from pitchlore.pipeline.importers.rows import Event, few_frames, referee
from pitchlore.pipeline.live.frames import framing, pitch_of
from pitchlore.pipeline.live.referee_state import RefereeState
from pitchlore.pipeline.matches.frame import Frames, MatchInfo, MatchLog, Period
from pitchlore.pipeline.matches.quality import quality_table
from pitchlore.pipeline.numbers.arrays import I64
from pitchlore.pipeline.settings import SituationSettings, TrajectorySettings
from pitchlore.pipeline.stages.situations.incremental import Recogniser
from pitchlore.pipeline.stages.trajectories.derive import trajectories
from pitchlore.schemas import SIDES, Situations

#: Frames that are kept: a body is taken for put elsewhere after 0.25 s, and a body's hole is 0.2 s long.
_KEPT_NS = 1_000_000_000
#: What a robot did is shown for so long after its end, ns; so is the way of the ball.
_SHOWN_NS = 700_000_000
#: A segment of play that lasts longer begins anew, ns: looking at it costs more, the longer it is.
_ANEW_NS = 60_000_000_000
#: How often packets are asked for the size of the pitch, ns.
_ASK_NS = 1_000_000_000
#: Frames that a vote of the bodies on the sides needs.
_VOTERS = 60
_MATCH = "live"
_CLEANING, _RECOGNISING = TrajectorySettings(), SituationSettings()


class LiveSnapshot(NamedTuple):
    """A match as it was a moment ago; blue is home.

    Attributes:
        t_ns: time of its sample, Unix time in ns.
        pitch: the field of play.
        names: names of blue and of yellow.
        score: score of blue and of yellow, None where unknown.
        blue_attacks: direction along x.
        playing: whether play is on.
        trail: recent places of the ball, metres, the present one last; empty where it is not seen.
        robots: the robots seen, as the cameras see the pitch, and their latest situations.
    """

    t_ns: int
    pitch: Pitch
    names: tuple[str, str]
    score: tuple[int | None, int | None]
    blue_attacks: Literal[1, -1]
    playing: bool
    trail: Sequence[Point]
    robots: Sequence[Robot]


class Follower:
    """Follows a match by its packets.

    Args:
        league: league of the packets.
        cleaning: how velocities are estimated.
        recognising: how situations are recognised.
        settled: gets the situations of each segment of play that is over, rows of schema Situations; their
            times are Unix time.

    Attributes:
        referee: the state of play, as the packets tell it now.
    """

    def __init__(
        self, league: LeagueName, cleaning: TrajectorySettings = _CLEANING,
        recognising: SituationSettings = _RECOGNISING,
        settled: Callable[[pl.DataFrame], None] = lambda _: None,
    ) -> None:
        self._league, self._cleaning, self._recognising = league, cleaning, recognising
        self._settled = settled
        self._framing, self.referee = framing(league), RefereeState(league)
        self._asked_ns = 0
        self._begin(PITCHES[Kind(league)])

    def _begin(self, pitch: Pitch) -> None:
        """Begin anew, on a pitch of another size."""
        self._pitch = pitch
        self._recogniser = Recogniser(_MATCH, pitch, self._recognising)
        self._frames: Frames | None = None
        self._play = _Play(self.referee)
        self._sides = _Sides()
        self._segments = _Segments()
        self._known_ns = -1
        self._done = Situations.empty()
        self._trail: deque[tuple[int, Point]] = deque()
        self._trail_of: int | None = None

    def take(self, packets: Sequence[Packet]) -> None:
        """Take up sound packets, in order of time."""
        if not packets:
            return
        if packets[-1].t_ns - self._asked_ns >= _ASK_NS:
            pitch = pitch_of(self._league, packets)
            self._asked_ns = self._asked_ns if pitch is None else packets[-1].t_ns
            if pitch is not None and pitch != self._pitch:
                self._begin(pitch)
        self.referee.hear(packets)
        self._play.hear(self.referee, packets[-1].t_ns)
        self.see(self._framing.take(packets))

    def see(self, frames: Frames) -> None:
        """Take up frames, as :meth:`take` finds them."""
        if len(frames):
            if int(frames.t_ns[-1]) < self._known_ns - _KEPT_NS:  # the clock was set back
                self._begin(self._pitch)
            self._sides.see(frames, self.referee)
            self._frames = frames if self._frames is None else self._frames.followed_by(frames)

    def snapshot(self) -> LiveSnapshot | None:
        """The latest settled sample; None where there is no new one."""
        if self._frames is None:
            return None
        t_ns = self._frames.t_ns
        frames = self._frames = self._frames.where(t_ns >= t_ns.max() - _KEPT_NS)
        settled_ns = self._settled_until(np.sort(frames.t_ns))
        if settled_ns <= self._known_ns:
            return None
        rows = self._rows(frames, settled_ns)
        if rows.is_empty():
            return None
        known, self._known_ns = self._known_ns, settled_ns
        new = self._segments.renumbered(rows, known).filter(pl.col("t_ns") > known)
        done = self._recogniser.take(new)
        self._settled(done)
        recent = pl.col("end_ns") > settled_ns - _SHOWN_NS
        self._done = pl.concat([self._done, done]).filter(recent)
        doing = pl.concat([self._done, self._recogniser.open().filter(recent)])
        return self._snapshot(new, doing)

    def _settled_until(self, t_ns: I64) -> int:
        """Time of the last sample whose velocities do not depend on samples to come; -1 if there is none."""
        half_ns = round(self._cleaning.window_s / 2 * 1e9)
        by_time = int(np.searchsorted(t_ns, t_ns[-1] - half_ns, side="right"))
        by_count = len(t_ns) - self._cleaning.window_samples // 2
        settled = min(by_time, by_count)
        return int(t_ns[settled - 1]) if settled > 0 else -1

    def _rows(self, frames: Frames, until_ns: int) -> pl.DataFrame:
        """Trajectories of the frames that are kept, up to a time."""
        start, end = int(frames.t_ns.min()), int(frames.t_ns.max()) + 1
        info = MatchInfo(
            match_id=_MATCH, source=_MATCH, format=_MATCH, home="blue", away="yellow", pitch=self._pitch,
            periods=self._sides.periods(start, end), software=RELEASE,
        )
        events = referee(_MATCH, self._play.events(start))
        log = MatchLog(info=info, frames=frames, referee=events, quality=quality_table(_MATCH, []))
        return trajectories(log, self._cleaning)[0].filter(pl.col("t_ns") <= until_ns)

    def _snapshot(self, new: pl.DataFrame, doing: pl.DataFrame) -> LiveSnapshot:
        """The last of the new samples, with the situations that the robots are in, or were in last."""
        latest = doing.sort("end_ns", maintain_order=True).unique(("team", "robot"), keep="last")
        words = {(team, robot): str(name).removeprefix("Robot ")
                 for team, robot, name in latest.select("team", "robot", "name").iter_rows()}
        now_ns = self._known_ns
        balls = new.filter(pl.col("team") == "ball").select("segment", "t_ns", "x", "y", "turned")
        for segment, t_ns, *place in balls.iter_rows():
            here = _unturned(*place)
            if segment != self._trail_of or (self._trail and not self._reaches(*self._trail[-1], t_ns, here)):
                self._trail.clear()  # it was put there
            self._trail_of = segment
            self._trail.append((t_ns, here))
        while self._trail and self._trail[0][0] < now_ns - _SHOWN_NS:
            self._trail.popleft()
        seen = self._trail and self._trail[-1][0] == now_ns
        robots = [
            Robot(team, robot, _unturned(x, y, turned), None if theta is None else theta + np.pi * turned,
                  words.get((team, robot), ""))
            for team, robot, x, y, theta, turned in new.filter(
                pl.col("t_ns") == now_ns, pl.col("team") != "ball").select(
                "team", "robot", "x", "y", "theta", "turned").iter_rows()
        ]
        return LiveSnapshot(
            now_ns, self._pitch, self.referee.names, self.referee.score or (None, None), self._sides.now,
            self.referee.playing, [place for _, place in self._trail] if seen else [], robots,
        )

    def _reaches(self, since_ns: int, there: Point, t_ns: int, here: Point) -> bool:
        """True if the ball can have rolled from one place to another."""
        scales = SCALES[self._pitch.kind]
        return math.dist(there, here) <= scales.max_ball_speed * (t_ns - since_ns) / 1e9 + scales.robot_radius


def _unturned(x: float, y: float, turned: bool) -> Point:
    return (-x, -y) if turned else (x, y)


class _Play:
    """When play was on, by what the referee said when; of the last second."""

    def __init__(self, state: RefereeState) -> None:
        self._first = self._last = state.playing
        self._score = state.score or (0, 0)
        self._events: list[Event] = []

    def hear(self, state: RefereeState, t_ns: int) -> None:
        """Take up the state that the referee's word makes at a time."""
        score = state.score or self._score
        scored = [side for i, side in enumerate(SIDES) if score[i] > self._score[i]]
        self._score = score
        if scored:
            self._events.append(Event(t_ns, "goal", scored[0], *score))
        if scored or state.playing != self._last:
            self._events.append(Event(t_ns, "play" if state.playing else "stop", None, *score))
            self._last = state.playing
        self._forget(t_ns - 2 * _KEPT_NS)

    def _forget(self, until_ns: int) -> None:
        """Forget events before a time, and keep the state that they leave."""
        while self._events and self._events[0].t_ns < until_ns:
            self._first = self._events.pop(0).event == "play"

    def events(self, start_ns: int) -> list[Event]:
        """The events from a time on, before them the state at that time; earlier ones are forgotten."""
        self._forget(start_ns)
        return [Event(start_ns, "play" if self._first else "stop"), *self._events]


class _Sides:
    """The direction in which blue attacks: as the referee says, else by where the robots stood in this half.

    Attributes:
        now: the direction.
    """

    def __init__(self) -> None:
        self.now: Literal[1, -1] = 1
        self._changes: list[tuple[int, Literal[1, -1]]] = []
        self._half = 1
        self._votes: tuple[float, int] = (0.0, 0)

    def see(self, frames: Frames, state: RefereeState) -> None:
        """Take up frames."""
        if state.half != self._half:
            self._half, self._votes = state.half, (0.0, 0)
        votes = votes_of(frames)
        self._votes = (self._votes[0] + float(votes.sum()), self._votes[1] + len(votes))
        total, count = self._votes
        now = state.blue_attacks
        if now is None and count >= _VOTERS and abs(total) >= WEAK * count:
            now = 1 if total > 0 else -1
        if now is not None and now != self.now:
            self.now = now
            self._changes.append((int(frames.t_ns[0]), now))

    def periods(self, start_ns: int, end_ns: int) -> tuple[Period, ...]:
        """Periods that cover [start, end)."""
        while len(self._changes) > 1 and self._changes[1][0] <= start_ns:
            self._changes.pop(0)
        changes = [(max(at, start_ns), sign) for at, sign in self._changes if at < end_ns]
        first: Literal[1, -1] = self.now if not self._changes else -self._changes[0][1]
        if not changes or changes[0][0] > start_ns:
            changes = [(start_ns, first), *changes]
        ends = [at for at, _ in changes[1:]] + [end_ns]
        return tuple(Period(start_ns=at, end_ns=end, home_attacks=sign, inferred=False)
                     for (at, sign), end in zip(changes, ends, strict=True))


class _Segments:
    """Numbers of the segments of play over all windows of frames."""

    def __init__(self) -> None:
        self._last = -1
        self._began_ns = -1

    def renumbered(self, rows: pl.DataFrame, known_ns: int) -> pl.DataFrame:
        """Trajectories of a window with the numbers of the whole match, for samples after ``known_ns``.

        A segment that goes on keeps its number, for a minute. If the window shows that it ended meanwhile
        (the ball was put elsewhere), the next sample begins another.
        """
        spans = rows.drop_nulls("segment").group_by("segment", maintain_order=True).agg(
            first=pl.col("t_ns").min(), last=pl.col("t_ns").max()).sort("segment")
        begin = rows["t_ns"].min()
        numbers = {}
        for segment, first, last in spans.iter_rows():
            same = first == begin or first <= self._began_ns
            goes_on = same and self._last >= 0 and first <= known_ns < last
            goes_on &= last - self._began_ns < _ANEW_NS
            if last > known_ns and not goes_on:
                self._last, self._began_ns = self._last + 1, max(first, known_ns + 1)
            numbers[segment] = self._last
        mapped = pl.col("segment").replace_strict(numbers, default=None, return_dtype=pl.Int32)
        return rows.with_columns(mapped) if numbers else rows


def prepare(league: LeagueName) -> None:
    """Load and compile what a follower needs, so that the first seconds of a match are not missed."""
    follower = Follower(league)
    follower.see(few_frames(late=True))
    follower.snapshot()
