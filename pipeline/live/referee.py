"""The words of SSL's game controller in a packet."""

from __future__ import annotations

from typing import NamedTuple

from pitchlore.pipeline.base.text import NAME_CHARACTERS, printable
from pitchlore.pipeline.importers.packets.recorder import Packet
from pitchlore.pipeline.importers.ssl_logs import fields as f
from pitchlore.pipeline.importers.ssl_logs.wire import fields, texts
from pitchlore.pipeline.live.screening import laid_out
from pitchlore.pipeline.numbers.arrays import I64


class RefereePacket(NamedTuple):
    """One packet of the game controller; None where it does not say.

    Attributes:
        stage, command: numbers in ``ssl_logs.commands.STAGES`` and ``COMMANDS``.
        left_us: time left of the stage, microseconds; negative when it lasts longer.
        names, goals: yellow's and blue's.
        blue_on_positive: whether blue's goal is at +x.
    """

    stage: int | None
    command: int | None
    left_us: int | None
    names: tuple[str | None, str | None]
    goals: tuple[int | None, int | None]
    blue_on_positive: bool | None


def said_in(packet: Packet) -> RefereePacket:
    """The words of a sound packet of the game controller."""
    data, start, end = laid_out([packet])
    reported, _ = fields(data, start, end)
    stage, command, left, turned = (_last(reported.varints(number)[1]) for number in (
        f.REFEREE_STAGE, f.REFEREE_COMMAND, f.REFEREE_TIME_LEFT, f.REFEREE_BLUE_ON_POSITIVE))
    names, goals = [], []
    for number in (f.REFEREE_YELLOW, f.REFEREE_BLUE):
        span = reported.spans(number)
        own, _ = fields(data, span.value, span.end)
        name = own.spans(f.TEAM_NAME)
        given = [text for text in texts(data, name.value, name.end) if text]
        names.append(printable(given[-1].decode(errors="replace"), NAME_CHARACTERS) if given else None)
        goals.append(_last(own.varints(f.TEAM_SCORE)[1]))
    zigzag = None if left is None else (left >> 1) ^ -(left & 1)
    sides = None if turned is None else bool(turned)
    return RefereePacket(stage, command, zigzag, (names[0], names[1]), (goals[0], goals[1]), sides)


def _last(values: I64) -> int | None:
    return int(values[-1]) if len(values) else None
