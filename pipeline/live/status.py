"""A line on the packets of a match: the state of play, and counts."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

import numpy as np

from pitchlore.pipeline.importers.packets import vsss
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.packets.streams import OPTIONS, LeagueName, channels
from pitchlore.pipeline.importers.ssl_logs import fields as f
from pitchlore.pipeline.importers.ssl_logs.stages import COMMANDS, STAGES
from pitchlore.pipeline.importers.ssl_logs.wire import fields
from pitchlore.pipeline.live.referee import said_in
from pitchlore.pipeline.live.screening import laid_out
from pitchlore.pipeline.numbers.arrays import I64

#: A number that rises by more is no loss but a camera, or a simulator, that began anew.
_GAP = 1_000
_WITHIN_NS = 1_000_000_000


class Teller(Protocol):
    """The state of a match, as a league's packets tell it."""

    def see(self, packets: Sequence[Packet]) -> None:
        """Take up sound packets, in order of time."""

    def says(self) -> str:
        """The score and the clock; "" as long as no packet says anything of them."""

    def state(self) -> str:
        """The state of the game and its clock; "" as long as no packet says anything of them."""


class FrameRate:
    """Frames of vision: how many there are in a second, and how many are missing.

    Attributes:
        lost: frames that were numbered and did not come.
    """

    def __init__(self) -> None:
        self.lost = 0
        self._last: dict[int, int] = {}
        self._times: deque[int] = deque()

    def add(self, t_ns: Iterable[int], camera: I64, number: I64) -> None:
        """Take up frames: when each came, its camera and its number, [M] each."""
        self._times.extend(t_ns)
        for of, now in zip(camera.tolist(), number.tolist(), strict=True):
            gap = now - self._last.get(of, now - 1) - 1
            if 0 < gap < _GAP:
                self.lost += gap
            self._last[of] = now

    def rate(self, now_ns: int) -> int:
        """Frames of the last second."""
        while self._times and abs(now_ns - self._times[0]) > _WITHIN_NS:  # a clock may be set back
            self._times.popleft()
        return len(self._times)


class Status:
    """Counts of what was received so far.

    Args:
        league: league of the received packets.

    Attributes:
        frames: frames of all cameras.
        packets: number of sound packets of the league.
        options: number of sound packets with a robot's option, as its team tells it.
    """

    def __init__(self, league: LeagueName) -> None:
        self.frames = FrameRate()
        self.packets = self.options = 0
        self._teller: Teller = _TELLERS[league](self.frames)

    def see(self, packets: Sequence[Packet]) -> None:
        """Take up sound packets, in order of time."""
        told = sum(packet.channel == OPTIONS.channel for packet in packets)
        self.options += told
        self.packets += len(packets) - told
        if packets:
            self._teller.see(packets)

    def state(self) -> str:
        """The state of the game and its clock; "" as long as nobody says."""
        return self._teller.state()

    def line(self, now_ns: int, refused: int) -> str:
        """Frames a second, losses, what was refused, options that teams told, score and clock."""
        parts = [f"{self.frames.rate(now_ns)} frames/s", f"{self.frames.lost} lost"]
        parts += [f"{refused} refused"] if refused else []
        parts += [f"{self.options} options"] if self.options else []
        parts += [said] if (said := self._teller.says()) else []
        return ", ".join(parts)


class _Ssl:
    def __init__(self, frames: FrameRate) -> None:
        self._frames = frames
        self._score = ["?", "?"]
        self._names = ["yellow", "blue"]
        self._clock = ""

    def see(self, packets: Sequence[Packet]) -> None:
        channel = channels("ssl")
        seen = [packet for packet in packets if packet.channel in (channel["vision"], channel["vision-2010"])]
        if seen:
            data, start, end = laid_out(seen)
            frames = fields(data, start, end)[0].spans(f.WRAPPER_DETECTION)
            inner, _ = fields(data, frames.value, frames.end)
            numbers = np.zeros((2, len(frames.of)), np.int64)
            for row, number in enumerate((f.FRAME_CAMERA, f.FRAME_NUMBER)):
                of, value = inner.varints(number)
                numbers[row, of] = value
            self._frames.add((seen[i].t_ns for i in frames.of.tolist()), *numbers)
        reported = [packet for packet in packets if packet.channel == channel["referee"]]
        if reported:
            self._hear(reported[-1])

    def _hear(self, packet: Packet) -> None:
        said = said_in(packet)
        self._names = [name or before for name, before in zip(said.names, self._names, strict=True)]
        self._score = ["?" if goals is None else str(goals) for goals in said.goals]
        parts = [words[number].replace("_", " ").lower()
                 for words, number in ((STAGES, said.stage), (COMMANDS, said.command))
                 if number is not None and 0 <= number < len(words)]
        if said.left_us is not None:
            parts.append(f"{_clock(said.left_us // 1_000_000)} left")
        self._clock = ", ".join(parts)

    def state(self) -> str:
        return self._clock

    def says(self) -> str:
        if not self._clock:
            return ""
        yellow, blue = self._names
        return f"{yellow} {self._score[0]} : {self._score[1]} {blue}, {self._clock}"


class _Vsss:
    def __init__(self, frames: FrameRate) -> None:
        self._frames = frames
        self._score = ("?", "?")
        self._state = ""

    def see(self, packets: Sequence[Packet]) -> None:
        channel = channels("vsss")
        seen = [packet for packet in packets if packet.channel == channel["vision"]]
        if seen:
            found = vsss.environments(*laid_out(seen))
            steps = np.nan_to_num(found.frames[:, vsss.STEP]).astype(np.int64)
            self._frames.add((packet.t_ns for packet in seen), np.zeros_like(steps), steps)
            if (score := vsss.goals_counted(found)) is not None:
                self._score = (str(score[0]), str(score[1]))
        reported = [packet for packet in packets if packet.channel == channel["referee"]]
        if reported:
            data, start, end = laid_out(reported)
            said, _ = vsss.commands(data, np.array([packet.t_ns for packet in reported]), start, end)
            if said:
                half = f", half {said[-1].half}" if said[-1].half > 0 else ""
                clock = f", {_clock(int(said[-1].clock_s))}" if said[-1].clock_s is not None else ""
                self._state = said[-1].state.replace("_", " for ") + half + clock

    def state(self) -> str:
        return self._state

    def says(self) -> str:
        score = f"blue {self._score[0]} : {self._score[1]} yellow"
        return f"{score}, {self._state}" if self._state else score if self._score[0] != "?" else ""


def _clock(seconds: int) -> str:
    sign = "-" if seconds < 0 else ""
    return f"{sign}{abs(seconds) // 60}:{abs(seconds) % 60:02d}"


_TELLERS: dict[LeagueName, Callable[[FrameRate], Teller]] = {"ssl": _Ssl, "vsss": _Vsss}
