"""The arena as a simulator that others' programs see and drive, in real time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.arena.match.controllers import PolicyTables, controllers_of
from pitchlore.pipeline.arena.match.match import MatchInPlay
from pitchlore.pipeline.arena.match.recipe import Recipe
from pitchlore.pipeline.engine.interrupt import until_stopped
from pitchlore.pipeline.engine.record import match_log
from pitchlore.pipeline.game.bodies import see
from pitchlore.pipeline.importers.packets.streams import LEAGUES, Stream
from pitchlore.pipeline.live.encoding import (
    BLUE,
    GAME_ON,
    KICKOFF,
    NEITHER,
    STOP,
    YELLOW,
    environment,
    referee_command,
)
from pitchlore.pipeline.live.remote import RemoteController, asked
from pitchlore.pipeline.live.sockets import Receiver, Sender
from pitchlore.pipeline.store import Store
from pitchlore.schemas import AWAY, HOME

#: The streams of a VSSS simulator: it sends vision and the referee's commands, and listens to commands.
COMMANDS = Stream("commands", 9, "127.0.0.1", 20011)
STREAMS = (*LEAGUES["vsss"], COMMANDS)
#: How often the referee says again what holds, and how often the match is logged, seconds.
_AGAIN_S = _LOG_S = 1.0
#: How late a frame may be; after a later one the match goes on from there.
_BEHIND_S = 0.05


class Simulated(NamedTuple):
    """A match that was simulated for others.

    Attributes:
        match_id: id of the match.
        score: goals of home and away.
        frames: frames that were sent.
        commands: commands to robots that came.
        others: packets in which there was none, as malformed ones.
        late: how often the match stood still, because this computer was busy.
    """

    match_id: str
    score: tuple[int, int]
    frames: int
    commands: int
    others: int
    late: int


def simulate(
    store: Store, recipe: Recipe, policies: Mapping[str, PolicyTables], streams: Mapping[str, Stream], *,
    interface: str | None = None, say: Callable[[str], None] = lambda _: None,
    listening: Callable[[str], None] = lambda _: None,
) -> Simulated:
    """Play a match in real time: frames go out, commands come in. It is logged like any other.

    Home is blue, away is yellow. Robots have the numbers 0 to N - 1. The referee's commands are sent when
    they change, and once a second. Ctrl-C ends the match; what was played is kept.

    Args:
        store: keeps the match.
        recipe: recipe of the match; its teams of kind remote are driven by others.
        policies: policies by the label that the recipe's teams name.
        streams: where vision and the referee are sent, and where commands are listened to, by name.
        interface: address of the network card by which groups are reached; None for the system's choice.
        say: gets a line of status, each second.
        listening: gets the address at which commands are listened to.

    Raises:
        BadSettings: if an address cannot be listened to.
        StorageFailed: if the log cannot be written.
    """
    top = recipe.physics.wheel_speed

    def begin() -> tuple[MatchInPlay, list[RemoteController | None]]:
        remotes = [RemoteController(recipe.robots, top) if team.kind == "remote" else None
                   for team in (recipe.home, recipe.away)]
        return MatchInPlay(recipe, controllers_of(recipe, policies, (remotes[HOME], remotes[AWAY]))), remotes

    begin()[0].advance()  # compiles what is compiled, which would keep others waiting
    match, remotes = begin()
    hz, sent = match.laws.hz, 0
    commands = others = late = 0
    bodies = np.zeros_like(match.bodies)
    with (
        Receiver((streams["commands"],)) as receiver, Sender(interface) as sender,
        match_log(store, match) as log_it, until_stopped() as stopped,
    ):
        listening(receiver.addresses["commands"])
        referee = _Referee(match)
        began = said = time.monotonic()
        while match.advance():
            due, now = began + match.frame / hz, time.monotonic()
            if now - due > _BEHIND_S:  # a simulator that is late does not hurry
                began += now - due
                late += 1
                due = now
            see(match.views[0], 0, match.attacks, bodies)
            for command in referee.says():  # first, so that it is known when the frame comes that it is about
                sender.send(streams["referee"], command)
            sender.send(streams["vision"], environment(match.frame, bodies, recipe.pitch, match.score))
            sent += 1
            while True:
                for one in receiver.receive(max(0.0, due - time.monotonic())):
                    reported = asked(one.packet.data)
                    others += not reported
                    for wheels in reported:
                        remote = remotes[wheels.yellow]
                        if remote is not None:
                            remote.ask(wheels)
                            commands += 1
                if time.monotonic() >= due:
                    break
            if now - said >= _LOG_S:
                said = now
                log_it()
                without = f"{others} packets without one, " if others else ""
                say(f"{match.frame / hz:.0f} s, {match.score[0]} : {match.score[1]}, {commands} commands, "
                    f"{without}{late} times late")
            if stopped():
                match.leave()
                break
    return Simulated(recipe.match_id, match.score, sent, commands, others, late)


class _Referee:
    """The referee's words of a match, as VSSReferee's commands."""

    def __init__(self, match: MatchInPlay) -> None:
        self._match = match
        self._score = match.score
        self._halves = [period.start_ns for period in match.laws.periods()]
        self._last: tuple[int, int] | None = None
        self._next = 0

    def says(self) -> list[bytes]:
        """The commands of this frame: what has changed, and each second what holds."""
        match, now = self._match, (GAME_ON if self._match.in_play else STOP, NEITHER)
        reported = []
        if match.score != self._score:
            conceded = YELLOW if match.score[0] > self._score[0] else BLUE
            self._score = match.score
            reported.append((KICKOFF, conceded))
        if now != self._last or match.frame >= self._next:
            self._last = now
            self._next = match.frame + round(_AGAIN_S * match.laws.hz)
            reported.append(now)
        half = 1 if match.attacks > 0 else 2
        start = self._halves[min(half, len(self._halves)) - 1]
        clock_s = max(match.laws.t_ns(match.frame) - start, 0) / 1e9
        return [referee_command(foul, colour, clock_s, half) for foul, colour in reported]
