"""The state of a match, by what the referee's packets say."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from pitchlore.pipeline.importers.packets import vsss
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import LeagueName, channels
from pitchlore.pipeline.importers.rows import MAX_SCORE
from pitchlore.pipeline.importers.ssl_logs.stages import COMMANDS, STAGES
from pitchlore.pipeline.live.referee import said_in
from pitchlore.pipeline.live.screening import laid_out

#: Commands after which SSL's robots may play: the ball is in play, or a side may bring it there.
_PLAY = {COMMANDS.index(word) for word in (
    "NORMAL_START", "FORCE_START", "DIRECT_FREE_YELLOW", "DIRECT_FREE_BLUE", "INDIRECT_FREE_YELLOW",
    "INDIRECT_FREE_BLUE")}
_SECOND = STAGES.index("NORMAL_HALF_TIME")


class RefereeState:
    """The state of play. Without a referee play is always on.

    Args:
        league: league of the packets.

    Attributes:
        playing: whether robots may move.
        half: 1 or 2.
        score: goals of blue and of yellow, None as long as nobody says.
        names: names of blue and of yellow: their colours as long as nobody says.
        blue_attacks: direction along x; None as long as nobody says.
    """

    def __init__(self, league: LeagueName) -> None:
        self.playing = True
        self.half = 1
        self.score: tuple[int, int] | None = None
        self.names = ("blue", "yellow")
        self.blue_attacks: Literal[1, -1] | None = None
        self._channels = channels(league)
        self._league = league

    def hear(self, packets: Sequence[Packet]) -> None:
        """Take up sound packets, in order of time."""
        reported = [packet for packet in packets if packet.channel == self._channels["referee"]]
        if self._league == "ssl":
            if reported:
                self._ssl(reported[-1])
            return
        if reported:
            data, start, end = laid_out(reported)
            said, _ = vsss.commands(data, np.array([packet.t_ns for packet in reported]), start, end)
            for command in said:
                self.playing = command.state.startswith("gameon")
                self.half = 2 if command.half >= 2 else 1
        seen = [packet for packet in packets if packet.channel == self._channels["vision"]]
        if seen:
            self._count(vsss.goals_counted(vsss.environments(*laid_out(seen[-1:]))) or (None, None))

    def _ssl(self, packet: Packet) -> None:
        said = said_in(packet)
        self.playing = said.command in _PLAY
        self.half = 2 if said.stage is not None and said.stage >= _SECOND else 1
        if said.blue_on_positive is not None:
            self.blue_attacks = -1 if said.blue_on_positive else 1
        self.names = (said.names[1] or self.names[0], said.names[0] or self.names[1])
        yellow, blue = said.goals
        self._count((blue, yellow))

    def _count(self, score: tuple[int | None, int | None]) -> None:
        """Take up goals of blue and of yellow, if they are reported and a match may have so many."""
        blue, yellow = score
        if blue is None or yellow is None:
            return
        if min(blue, yellow) >= 0 and max(blue, yellow) <= MAX_SCORE:
            self.score = (blue, yellow)
