"""A team that drives robots which we do not simulate: its job, and the loop that sees and decides."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import BinaryIO, Literal

import numpy as np

from pitchlore.pipeline import matches as log
from pitchlore.pipeline.arena.match.controllers import PolicyTables, controller_of
from pitchlore.pipeline.arena.match.match import decisions_of, logged_frames
from pitchlore.pipeline.arena.match.recipe import Recipe, TeamSettings
from pitchlore.pipeline.arena.physics.settings import PhysicsSettings
from pitchlore.pipeline.base.software import RELEASE
from pitchlore.pipeline.game.bodies import see
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import LEAGUES, LeagueName, Stream
from pitchlore.pipeline.importers.rows import Event, referee
from pitchlore.pipeline.live.bodies import BodyTracker
from pitchlore.pipeline.live.encoding import Wheels, robot_control, wheel_commands
from pitchlore.pipeline.live.referee_state import RefereeState
from pitchlore.pipeline.matches.frame import MatchInfo, Period
from pitchlore.pipeline.matches.quality import Flaw, quality_table
from pitchlore.pipeline.numbers.arrays import F64
from pitchlore.schemas import AWAY, HOME, SIDES, Side

Protocol = Literal["vsss", "ssl-sim"]
TeamColour = Literal["blue", "yellow"]

#: The league of each protocol.
LEAGUE: dict[Protocol, LeagueName] = {"vsss": "vsss", "ssl-sim": "ssl"}
#: Commands a second.
HZ = 60.0
#: Robots stop when no vision came for so long, seconds.
BLIND_S = 0.3
_LOG_S = 1.0
#: Between the wheels whose speeds a team decides.
_AXLE_M = PhysicsSettings().axle
#: Flaw of a log whose score nobody reported.
_UNTOLD = Flaw("goals unknown", (
    "neither the simulator nor a referee told the score: nothing is learned of goals. Let a referee run, or "
    "a simulator that counts goals"))
#: Name of the team that we do not drive.
_OTHER = "adversary"


def streams_of(protocol: Protocol, colour: TeamColour) -> tuple[Stream, ...]:
    """The streams that are listened to, and the stream ``commands`` to which commands are sent.

    Sources: FIRASim, as for ``pipeline.importers.packets.streams``; the ports of
        RoboCup-SSL/ssl-simulation-protocol.
    """
    port = 20011 if protocol == "vsss" else 10301 if colour == "blue" else 10302
    return (*LEAGUES[LEAGUE[protocol]], Stream("commands", 9, "127.0.0.1", port))


@dataclass
class Job:
    """A team that is to be driven, and where.

    Attributes:
        protocol: protocol of the robots.
        colour: colour of the team.
        team: settings of our team.
        word: its name.
        policies: by label.
        robots: N, robots a side.
        attacks: direction in which the team attacks in the first half; None: as the referee says,
            else blue attacks +x, yellow -x.
        streams: from :func:`streams_of`, with addresses.
        interface: address of the network card; None for the system's choice.
        seconds: how long; None until Ctrl-C.
        seed: seed of the random draws of the team.
    """

    protocol: Protocol
    colour: TeamColour
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
        """League whose packets are seen."""
        return LEAGUE[self.protocol]

    @property
    def side(self) -> int:
        """HOME for blue, AWAY for yellow."""
        return HOME if self.colour == "blue" else AWAY

    def home_attacks(self, half: int) -> Literal[1, -1]:
        """Direction in which blue attacks."""
        usual = self.attacks is None or (self.attacks == "right") == (self.side == HOME)
        return 1 if usual == (half == 1) else -1


def wheel_packet(job: Job, wheels: F64) -> bytes:
    """The packet that turns the wheels of a team, float64 [N, 2], m/s."""
    if job.protocol == "vsss":
        return wheel_commands(Wheels(job.colour == "yellow", number, left, right)
                              for number, (left, right) in enumerate(wheels.tolist()))
    return robot_control((number, (left + right) / 2, (right - left) / _AXLE_M)
                         for number, (left, right) in enumerate(wheels.tolist()))


class Driver:
    """The loop: see, decide, command, log.

    Args:
        job: team and protocol to be driven.
        pitch: pitch of the match.
        stream: gets the log; buffered, writable.
        match_id: id of the log.

    Attributes:
        referee: the state of play.
        frames: frames in which the team decided.
        blind: how often robots were stopped because vision was lost.

    Raises:
        BadSettings: if the team cannot be played.
    """

    def __init__(self, job: Job, pitch: Pitch, stream: BinaryIO, match_id: str) -> None:
        self._job, self._match_id = job, match_id
        other = TeamSettings(kind="remote")
        home, away = (job.team, other) if job.side == HOME else (other, job.team)
        recipe = Recipe(home=home, away=away, seed=job.seed, robots=job.robots, pitch=pitch)
        policy = job.policies[job.team.policy] if job.team.policy else None
        self._view = np.zeros((1 + 2 * job.robots, 6))
        self._wheels = np.zeros((job.robots, 2))
        self._controller = controller_of(job.team, recipe, job.side, policy)
        self._tracker = BodyTracker(job.league, job.robots, pitch, HZ)
        self.referee = RefereeState(job.league)
        self.frames = self.blind = 0
        self._frame = self._first = 0
        self._samples: list[F64] = []
        self._events: list[Event] = []
        self._was_on = self._was_blind = False
        self._score: tuple[int, int] | None = None
        self._periods: list[tuple[int, Literal[1, -1]]] = []
        self._info = MatchInfo(
            match_id=match_id, source=f"{match_id}.mcap", format="driven", pitch=pitch, software=RELEASE,
            home=(job.word, _OTHER)[job.side], away=(_OTHER, job.word)[job.side],
            started_at=datetime.now(UTC), settings={"recipe": recipe.model_dump(mode="json")}, complete=True,
            periods=(Period(start_ns=0, end_ns=1, home_attacks=job.home_attacks(1), inferred=False),),
        )
        self._recorder = log.Recorder(stream, self._info)

    @property
    def began(self) -> bool:
        """True if there was a frame."""
        return self._frame > 0

    def warm(self) -> None:
        """Compile what is compiled, which would keep robots waiting. Nothing can be driven then."""
        see(self._tracker.now()[0], self._job.side, 1.0, self._view)
        self._controller.restarted(0, 0)
        self._controller.think(0, self._view, self._wheels)

    def take(self, packets: list[Packet]) -> None:
        """Take up sound packets."""
        self._tracker.take(packets)
        self.referee.hear(packets)

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
        """End the log, which has a frame."""
        self._set(on=False, why="ended")
        self._events.append(Event(self._t_ns(self._frame), "end", None, *self._reported(), "ended"))
        self._log()
        ends = [start for start, _ in self._periods[1:]] + [self._t_ns(self._frame) + 1]
        periods = tuple(
            Period(start_ns=start, end_ns=end, home_attacks=attacks, inferred=False)
            for (start, attacks), end in zip(self._periods, ends, strict=True))
        added = {"goals": {"from": None if self._score is None else "referee"}}
        self._recorder.close(
            info=self._info.model_copy(update={"periods": periods, "settings": self._info.settings | added}),
            quality=quality_table(self._match_id, [_UNTOLD] if self._score is None else []))

    def _think(self) -> F64 | None:
        """The wheels of this frame; None if robots have to stand."""
        job, state = self._job, self.referee
        bodies, visible = self._tracker.now()
        sample = bodies.copy()
        sample[~visible] = np.nan
        self._samples.append(sample)
        attacks = self._blue_attacks()
        if not self._periods or self._periods[-1][1] != attacks:
            self._periods.append((self._t_ns(self._frame), attacks))
        blind = time.monotonic() - self._tracker.seen_s > BLIND_S
        self.blind += blind and not self._was_blind
        self._was_blind = blind
        self._set(on=state.playing and not blind, why="vision lost" if blind else "referee")
        self._frame += 1
        if not self._was_on:
            return None
        see(bodies, job.side, float(attacks * (1, -1)[job.side]), self._view)
        self._controller.think(self._frame, self._view, self._wheels)
        self.frames += 1
        return self._wheels

    def _blue_attacks(self) -> Literal[1, -1]:
        """Direction by the settings, else by the referee, else by the half."""
        reported = self.referee.blue_attacks if self._job.attacks is None else None
        return reported or self._job.home_attacks(self.referee.half)

    def _set(self, *, on: bool, why: str) -> None:
        """Note that play begins, or stops and why, and who scored meanwhile."""
        score = self.referee.score or self._score
        before = self._score = self._score or score  # the first that is reported is that at which we came
        scored = [] if score is None or before is None else [
            side for side in (HOME, AWAY) if score[side] > before[side]]
        if on == self._was_on and not scored:
            return
        at = self._t_ns(self._frame)
        if self._was_on:
            reward = 0.0 if not scored else 1.0 if scored[0] == self._job.side else -1.0
            self._controller.stopped(self._frame, reward)
        self._score = score
        if scored:
            self._events.append(Event(at, "goal", SIDES[scored[0]], *self._reported(), "score"))
        elif self._was_on:
            self._events.append(Event(at, "stop", None, *self._reported(), why))
        self._was_on = on
        if on:
            lead = 0 if score is None else score[self._job.side] - score[1 - self._job.side]
            self._controller.restarted(self._frame, lead)
            self._events.append(Event(at, "play", None, *self._reported(), "goes on"))

    def _reported(self) -> tuple[int | None, int | None]:
        """The score, as far as it was reported."""
        return self._score or (None, None)

    def _log(self) -> None:
        samples, self._samples = self._samples, []
        events, self._events = self._events, []
        team: Side = SIDES[self._job.side]
        if samples:
            self._recorder.frames(logged_frames(np.array(samples), self._first, HZ))
            self._first += len(samples)
        self._recorder.referee(referee(self._match_id, events))
        self._recorder.decisions(decisions_of(self._controller.decided(), team, self._match_id, HZ))
        self._recorder.flush()

    def _t_ns(self, frame: int) -> int:
        return round(frame * 1e9 / HZ)

    def _line(self) -> str:
        state = "vision lost" if self._was_blind else "plays" if self._was_on else "stands"
        blue, yellow = ("?" if goals is None else goals for goals in self._reported())
        return f"{self._frame / HZ:.0f} s, {state}, blue {blue} : {yellow} yellow"
