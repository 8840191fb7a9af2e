"""One of our teams drives robots that we do not simulate: it sees a league's packets and sends commands."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO, Literal, NamedTuple

import numpy as np

from flows.interrupt import until_stopped
from flows.matches import INBOX, PLAYING
from pipeline import matches as log
from pipeline.arena.match.controllers import Controller, PolicyTables, controller_of
from pipeline.arena.match.match import decisions_of, frames_of
from pipeline.arena.match.recipe import Recipe, TeamSettings
from pipeline.arrays import F64
from pipeline.bodies import see
from pipeline.importers.packets import vsss
from pipeline.importers.rows import Event, referee
from pipeline.importers.source import slug
from pipeline.importers.ssl_logs import geometry
from pipeline.importers.ssl_logs.wire import fields
from pipeline.live.encoding import Wheels, robot_control, wheel_commands
from pipeline.live.screening import Screen, laid_out
from pipeline.live.sight import Sight, batch_of
from pipeline.live.sockets import Receiver, Sender
from pipeline.live.whistle import Whistle
from pipeline.matches.frame import AWAY, HOME, MatchInfo, Period
from pipeline.packets.recorder import Packet
from pipeline.packets.streams import LEAGUES, LeagueName, Stream
from pipeline.pitch import PITCHES, Kind, Pitch
from pipeline.store import Store
from pipeline.store.receipts import RELEASE
from schemas import SIDES, Side

Protocol = Literal["vsss", "ssl-sim"]
Colour = Literal["blue", "yellow"]

#: The league of each protocol.
LEAGUE: dict[Protocol, LeagueName] = {"vsss": "vsss", "ssl-sim": "ssl"}
#: Commands a second.
HZ = 60.0
#: Robots stop when no vision came for so long, seconds.
BLIND_S = 0.3
_LOG_S = _SAY_S = 1.0
#: How long an SSL match may be without geometry before its pitch is the league's.
_GEOMETRY_S = 3.0
#: Name of the team that we do not drive.
_OTHER = "adversary"
#: How often robots are told to stop at the end: packets get lost.
_STOPS = 10


def streams_of(protocol: Protocol, colour: Colour) -> tuple[Stream, ...]:
    """What is listened to, and the stream ``commands`` to which commands are sent.

    Sources: FIRASim, as for ``pipeline.packets.streams``; the ports of RoboCup-SSL/ssl-simulation-protocol.
    """
    port = 20011 if protocol == "vsss" else 10301 if colour == "blue" else 10302
    return (*LEAGUES[LEAGUE[protocol]], Stream("commands", 9, "127.0.0.1", port))


class Driven(NamedTuple):
    """What became of driving.

    Attributes:
        file: log of what was seen and decided, in the inbox; None if nothing was seen.
        frames: decisions' frames: how often commands were sent while play was on.
        blind: how often robots were stopped because vision was lost.
        score: goals of blue and of yellow; None if nobody said.
        seconds: how long.
    """

    file: Path | None
    frames: int
    blind: int
    score: tuple[int, int] | None
    seconds: float


@dataclass
class Job:
    """What is to be driven.

    Attributes:
        protocol: of the robots.
        colour: of the team.
        team: settings of our team.
        word: its name.
        policies: by label.
        robots: N, robots a side.
        attacks: direction in which the team attacks in the first half; None: blue attacks +x, yellow -x.
        streams: from :func:`streams_of`, with addresses.
        interface: address of the network card; None for the system's choice.
        seconds: how long; None until Ctrl-C.
        seed: of what the team leaves to chance.
    """

    protocol: Protocol
    colour: Colour
    team: TeamSettings
    word: str
    policies: Mapping[str, PolicyTables] = field(default_factory=dict)
    robots: int = 3
    attacks: Literal["right", "left"] | None = None
    streams: tuple[Stream, ...] = ()
    interface: str | None = None
    seconds: float | None = None
    seed: int = 0

    @property
    def league(self) -> LeagueName:
        """Whose packets are seen."""
        return LEAGUE[self.protocol]

    @property
    def side(self) -> int:
        """HOME for blue, AWAY for yellow."""
        return HOME if self.colour == "blue" else AWAY

    def home_attacks(self, half: int) -> Literal[1, -1]:
        """Direction in which blue attacks."""
        usual = self.attacks is None or (self.attacks == "right") == (self.side == HOME)
        return 1 if usual == (half == 1) else -1


def drive(
    store: Store, job: Job, *, say: Callable[[str], None] = lambda _: None,
    listening: Callable[[Mapping[str, str]], None] = lambda _: None,
) -> Driven:
    """Drive a team until Ctrl-C, or for some seconds.

    Commands go out 60 times a second. Robots stand while the referee does not let play go on, when no vision
    came for 0.3 s, and when this ends, for whatever reason. What was seen and decided is logged; the next run
    takes the log, also after a kill.

    Raises:
        BadSettings: if an address cannot be listened to, or the team cannot be played.
        StorageFailed: if another program listens to one, or the disk refuses.
    """
    began = time.monotonic()
    sources = tuple(stream for stream in job.streams if stream.name != "commands")
    with Receiver(sources, job.interface) as receiver, until_stopped() as stopped:
        listening(receiver.addresses)
        screen = Screen(job.league)

        def ended() -> bool:
            return stopped() or (job.seconds is not None and time.monotonic() - began >= job.seconds)

        def arrived(timeout: float) -> list[Packet]:
            return screen.sound(receiver.receive(timeout))

        pitch, first = _pitch(job.league, arrived, ended)
        if pitch is None:
            return Driven(None, 0, 0, None, time.monotonic() - began)
        name = slug(f"{job.word}-{job.protocol}-{datetime.now(UTC):%Y%m%d-%H%M%S}") + ".mcap"
        with store.growing(PLAYING, name) as (path, stream):
            driver = _Driver(job, pitch, stream, path.stem)
            with _stopping(job) as send:
                driver.take(first)
                driver.run(arrived, send, ended, say)
            driver.close()
            file = store.moved(path, INBOX)
    return Driven(file, driver.frames, driver.blind, driver.whistle.score, time.monotonic() - began)


@contextmanager
def _stopping(job: Job) -> Iterator[Callable[[F64 | None], None]]:
    """A function that sends wheels, float64 [N, 2]; whatever ends the body, robots are told to stop."""
    (target,) = (stream for stream in job.streams if stream.name == "commands")
    still = np.zeros((job.robots, 2))
    with Sender(job.interface) as sender:
        def send(wheels: F64 | None) -> None:
            sender.send(target, _commands(job, still if wheels is None else wheels))

        try:
            yield send
        finally:
            for _ in range(_STOPS):
                send(None)
                time.sleep(0.005)


def _commands(job: Job, wheels: F64) -> bytes:
    if job.protocol == "vsss":
        return wheel_commands(Wheels(job.colour == "yellow", number, left, right)
                              for number, (left, right) in enumerate(wheels.tolist()))
    axle = Recipe(home=job.team, away=job.team, seed=0).physics.axle
    return robot_control((number, (left + right) / 2, (right - left) / axle)
                         for number, (left, right) in enumerate(wheels.tolist()))


def _pitch(
    league: LeagueName, arrived: Callable[[float], list[Packet]], ended: Callable[[], bool],
) -> tuple[Pitch | None, list[Packet]]:
    """The pitch as the packets tell it, and the packets so far; None if it ended before any vision came."""
    channel = {stream.name: stream.channel for stream in LEAGUES[league]}
    kind, since, packets = (Kind.VSSS if league == "vsss" else Kind.SSL), None, list[Packet]()
    while not ended():
        packets = [*packets, *arrived(0.05)][-64:]
        seen = [packet for packet in packets if packet.channel == channel["vision"]]
        if not seen:
            continue
        since = since or time.monotonic()
        told = _size(league, seen)
        if told is not None:
            return PITCHES[kind].model_copy(update=told), packets
        if league == "vsss" or time.monotonic() - since > _GEOMETRY_S:
            return PITCHES[kind], packets
    return None, packets


def _size(league: LeagueName, seen: list[Packet]) -> dict[str, float] | None:
    if league == "vsss":
        size = vsss.environments(*laid_out(seen)).frames[:, vsss.LENGTH:]
        size = size[(size > 0).all(axis=1)]
        names = ("length", "width", "goal_width", "goal_depth")
        return dict(zip(names, size[-1].tolist(), strict=True)) if len(size) else None
    batch = batch_of(seen)
    sizes = geometry.sizes(batch, fields(batch.data, batch.start, batch.end)[0])
    if not sizes:
        return None
    told = max(sizes, key=lambda size: sizes[size])
    return {"length": told.length / 1000, "width": told.width / 1000, "goal_width": told.goal_width / 1000,
            "goal_depth": told.goal_depth / 1000}


class _Driver:
    """The loop: see, decide, command, log."""

    def __init__(self, job: Job, pitch: Pitch, stream: BinaryIO, match_id: str) -> None:
        self._job, self._match_id = job, match_id
        other = TeamSettings(kind="remote")
        home, away = (job.team, other) if job.side == HOME else (other, job.team)
        recipe = Recipe(home=home, away=away, seed=job.seed, robots=job.robots, pitch=pitch)
        policy = job.policies[job.team.policy] if job.team.policy else None
        self._view = np.zeros((1 + 2 * job.robots, 6))
        self._wheels = np.zeros((job.robots, 2))

        def begin() -> tuple[Controller, Sight]:
            return (controller_of(job.team, recipe, job.side, policy),
                    Sight(job.league, job.robots, pitch, HZ))

        trial, sight = begin()  # compiles what is compiled, which would keep robots waiting
        see(sight.now()[0], job.side, 1.0, self._view)
        trial.restarted(0, 0)
        trial.think(0, self._view, self._wheels)
        self._controller, self._sight = begin()
        self.whistle = Whistle(job.league)
        self.frames = self.blind = 0
        self._frame = self._first = 0
        self._samples: list[F64] = []
        self._events: list[Event] = []
        self._was_on = self._was_blind = False
        self._score = (0, 0)
        self._periods: list[tuple[int, int]] = []
        self._info = MatchInfo(
            match_id=match_id, source=f"{match_id}.mcap", format="driven", pitch=pitch, software=RELEASE,
            home=(job.word, _OTHER)[job.side], away=(_OTHER, job.word)[job.side],
            started_at=datetime.now(UTC), settings={"recipe": recipe.model_dump(mode="json")}, complete=True,
            periods=(Period(start_ns=0, end_ns=1, home_attacks=job.home_attacks(1), inferred=False),),
        )
        self._recorder = log.Recorder(stream, self._info)

    def take(self, packets: list[Packet]) -> None:
        """Take up sound packets."""
        self._sight.take(packets)
        self.whistle.hear(packets)

    def run(
        self, arrived: Callable[[float], list[Packet]], send: Callable[[F64 | None], None],
        ended: Callable[[], bool], say: Callable[[str], None],
    ) -> None:
        """Drive until it is ended."""
        due = time.monotonic()
        logged = due
        while not ended():
            due = max(due + 1 / HZ, time.monotonic() - 1 / HZ)  # a late computer does not hurry
            while (left := due - time.monotonic()) > 0:
                self.take(arrived(left))
            self.take(arrived(0.0))
            send(self._think())
            if due - logged >= _LOG_S:
                logged = due
                self._log()
                say(self._line())

    def close(self) -> None:
        """End the log."""
        self._set(on=False)
        self._events.append(Event(self._t_ns(self._frame), "end", None, *self._score, "ended"))
        self._log()
        ends = [start for start, _ in self._periods[1:]] + [self._t_ns(self._frame) + 1]
        periods = tuple(
            Period(start_ns=start, end_ns=end, home_attacks=self._job.home_attacks(half), inferred=False)
            for (start, half), end in zip(self._periods, ends, strict=True))
        self._recorder.close(info=self._info.model_copy(update={"periods": periods or self._info.periods}))

    def _think(self) -> F64 | None:
        """The wheels of this frame; None if robots have to stand."""
        job, whistle = self._job, self.whistle
        bodies, visible = self._sight.now()
        sample = bodies.copy()
        sample[~visible] = np.nan
        self._samples.append(sample)
        if not self._periods or self._periods[-1][1] != whistle.half:
            self._periods.append((self._t_ns(self._frame), whistle.half))
        blind = time.time_ns() - self._sight.seen_ns > BLIND_S * 1e9
        self.blind += blind and not self._was_blind
        self._was_blind = blind
        self._set(on=whistle.playing and not blind)
        self._frame += 1
        if not self._was_on:
            return None
        see(bodies, job.side, float(job.home_attacks(whistle.half) * (1, -1)[job.side]), self._view)
        self._controller.think(self._frame, self._view, self._wheels)
        self.frames += 1
        return self._wheels

    def _set(self, *, on: bool) -> None:
        """Note that play begins or stops, and who scored meanwhile."""
        score = self.whistle.score or self._score
        scored = [side for side in (HOME, AWAY) if score[side] > self._score[side]]
        if on == self._was_on and not scored:
            return
        at = self._t_ns(self._frame)
        if self._was_on:
            reward = 0.0 if not scored else 1.0 if scored[0] == self._job.side else -1.0
            self._controller.stopped(self._frame, reward)
        self._score = score
        if scored:
            self._events.append(Event(at, "goal", SIDES[scored[0]], *score, "score"))
        elif self._was_on:
            why = "vision lost" if self._was_blind else "referee"
            self._events.append(Event(at, "stop", None, *score, why))
        self._was_on = on
        if on:
            lead = score[self._job.side] - score[1 - self._job.side]
            self._controller.restarted(self._frame, lead)
            self._events.append(Event(at, "play", None, *score, "goes on"))

    def _log(self) -> None:
        samples, self._samples = self._samples, []
        events, self._events = self._events, []
        team: Side = SIDES[self._job.side]
        if samples:
            self._recorder.frames(frames_of(np.array(samples), self._first, HZ))
            self._first += len(samples)
        self._recorder.referee(referee(self._match_id, events))
        self._recorder.decisions(decisions_of(self._controller.decided(), team, self._match_id, HZ))
        self._recorder.flush()

    def _t_ns(self, frame: int) -> int:
        return round(frame * 1e9 / HZ)

    def _line(self) -> str:
        state = "vision lost" if self._was_blind else "plays" if self._was_on else "stands"
        blue, yellow = self._score
        return f"{self._frame / HZ:.0f} s, {state}, blue {blue} : {yellow} yellow"
