"""Packets that we send: FIRASim's commands and frames, VSSReferee's commands, SSL's simulation control.

Field numbers are facts. For VSSS their sources are those of :mod:`pipeline.importers.packets.vsss`, and the
descriptors of vsss-client 0.1.3 for commands; wheels are in rad/s of a wheel of 26 mm, as rsoccer-gym 1.4
sends them (``Simulators/fira.py``). For SSL: RoboCup-SSL/ssl-simulation-protocol
(``proto/ssl_simulation_robot_control.proto`` at 9bec36d).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from pitchlore.pipeline.game.bodies import BALL, OMEGA, THETA, VX, VY, X, Y
from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.numbers.arrays import F64

#: Radius of a wheel, metres.
WHEEL_M = 0.026
#: VSSReferee's words, and its colours.
FREE_KICK, PENALTY_KICK, GOAL_KICK, FREE_BALL, KICKOFF, STOP, GAME_ON, HALT = range(8)
BLUE, YELLOW, NEITHER = range(3)


class Wheels(NamedTuple):
    """A command to one robot.

    Attributes:
        yellow: whether it is of the yellow team.
        number: number of the robot, from 0.
        left, right: speed of its wheels, m/s.
    """

    yellow: bool
    number: int
    left: float
    right: float


def wheel_commands(commands: Iterable[Wheels]) -> bytes:
    """FIRASim's packet with commands to robots."""
    reported = (span(1, _whole(1, one.number) + _whole(2, one.yellow) + _real(6, one.left / WHEEL_M)
                 + _real(7, one.right / WHEEL_M)) for one in commands)
    return span(1, b"".join(reported))


def environment(step: int, bodies: F64, pitch: Pitch, score: Sequence[int]) -> bytes:
    """FIRASim's frame.

    Args:
        step: number of the frame.
        bodies: float64 [1 + 2 N, 6] in the pitch frame; blue's robots are in rows 1 to N, and have the
            numbers 0 to N - 1 in the packet, as yellow's have.
        pitch: its size.
        score: goals of blue and of yellow, in two fields that FIRASim itself does not have; sent if they are
            0, too, so that it is known that they are counted.
    """
    robots = (len(bodies) - 1) // 2
    ball = bodies[BALL].tolist()
    frame = span(1, _real(1, ball[X]) + _real(2, ball[Y]) + _real(4, ball[VX]) + _real(5, ball[VY]))
    for team, first in ((2, 1 + robots), (3, 1)):
        for number in range(robots):
            row = bodies[first + number].tolist()
            frame += span(team, _whole(1, number) + b"".join(
                _real(i, row[column]) for i, column in enumerate((X, Y, THETA, VX, VY, OMEGA), 2)))
    size = (pitch.width, pitch.length, pitch.goal_width, pitch.goal_depth)
    field = span(3, b"".join(_real(i, metres) for i, metres in enumerate(size, 1)))
    return _whole(1, step) + span(2, frame) + field + _field(4, score[0]) + _field(5, score[1])


def referee_command(foul: int, colour: int, clock_s: float, half: int) -> bytes:
    """VSSReferee's command."""
    return _whole(1, foul) + _whole(2, colour) + _real(4, clock_s) + _whole(5, half)


def robot_control(commands: Iterable[tuple[int, float, float]]) -> bytes:
    """SSL's simulation control.

    Args:
        commands: each robot's number, speed forward (m/s) and turn rate (rad/s, counter-clockwise).
    """
    def moves(forward: float, turn: float) -> bytes:
        return span(2, b"".join(_short(i, value) for i, value in enumerate((forward, 0.0, turn), 1)))

    return b"".join(span(1, _field(1, number) + span(2, moves(forward, turn)))
                    for number, forward, turn in commands)


def span(field: int, content: bytes) -> bytes:
    """A field of a message."""
    return _varint(field << 3 | 2) + _varint(len(content)) + content


def _whole(field: int, value: int) -> bytes:
    """A field of a number that is not negative; what is 0 is not sent."""
    return _field(field, value) if value else b""


def _field(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _real(field: int, value: float) -> bytes:
    """A field of a double; what is 0, or no number, is not sent."""
    return _varint(field << 3 | 1) + struct.pack("<d", value) if value and math.isfinite(value) else b""


def _short(field: int, value: float) -> bytes:
    """A required field of a float."""
    return _varint(field << 3 | 5) + struct.pack("<f", value)


def _varint(value: int) -> bytes:
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])
