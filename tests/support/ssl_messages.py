"""SSL logs for tests: messages written from field numbers, without any library of the league's or protobuf's.

The numbers are written here once more, so that a wrong one in ``pipeline.importers.ssl_logs.fields`` shows.
"""

import struct
from collections.abc import Iterable, Sequence
from typing import NamedTuple

VISION_2010, REFEREE, VISION_2014, TRACKER, INDEX = 2, 3, 4, 5, 6


def varint(number: int) -> bytes:
    """A varint; a negative number as its 64-bit two's complement."""
    number &= (1 << 64) - 1
    out = bytearray()
    while number >= 0x80:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*out, number])


def integer(field: int, value: int | None) -> bytes:
    """A field of an integer; none if it is None."""
    return b"" if value is None else varint(field << 3) + varint(value)


def f32(field: int, value: float | None) -> bytes:
    """A field of a float; none if it is None."""
    return b"" if value is None else varint(field << 3 | 5) + struct.pack("<f", value)


def f64(field: int, value: float | None) -> bytes:
    """A field of a double; none if it is None."""
    return b"" if value is None else varint(field << 3 | 1) + struct.pack("<d", value)


def span(field: int, content: bytes | str | None) -> bytes:
    """A field of a message or text; none if it is None."""
    if content is None:
        return b""
    data = content.encode() if isinstance(content, str) else content
    return varint(field << 3 | 2) + varint(len(data)) + data


class Seen(NamedTuple):
    """A detection: metres, radians; a ball has no number."""

    x: float
    y: float
    number: int | None = None
    theta: float | None = None
    confidence: float | None = 0.9


def detected_ball(ball: Seen) -> bytes:
    """A ball that a camera saw."""
    return (f32(1, ball.confidence) + integer(2, 80) + f32(3, ball.x * 1000) + f32(4, ball.y * 1000)
            + f32(6, 320.0) + f32(7, 240.0))


def detected_robot(robot: Seen) -> bytes:
    """A robot that a camera saw."""
    return (f32(1, robot.confidence) + integer(2, robot.number) + f32(3, robot.x * 1000) + f32(4, robot.y * 1000)
            + f32(5, robot.theta) + f32(6, 320.0) + f32(7, 240.0) + f32(8, 140.0))


def vision(
    number: int, t: float, *, camera: int = 0, balls: Iterable[Seen] = (), yellow: Iterable[Seen] = (),
    blue: Iterable[Seen] = (), geometry: bytes | None = None, sent: float | None = None,
) -> bytes:
    """A vision packet with a frame of one camera, captured at ``t`` seconds, and perhaps geometry."""
    frame = integer(1, number) + f64(2, t) + f64(3, t + 0.005 if sent is None else sent) + integer(4, camera)
    frame += b"".join(span(5, detected_ball(ball)) for ball in balls)
    frame += b"".join(span(6, detected_robot(robot)) for robot in yellow)
    frame += b"".join(span(7, detected_robot(robot)) for robot in blue)
    return span(1, frame) + span(2, geometry)


def size(length: float, width: float, goal_width: float, goal_depth: float, boundary: float = 0.3) -> bytes:
    """Geometry since 2014, metres, with a line and a camera, which nobody reads."""
    lengths = enumerate((length, width, goal_width, goal_depth, boundary), 1)
    point = f32(1, -1000.0) + f32(2, 500.0)
    line = span(1, "TopTouchLine") + span(2, point) + span(3, point) + f32(4, 10.0)
    camera = integer(1, 0) + b"".join(f32(field, 1.5) for field in range(2, 13))
    return span(1, b"".join(integer(i, round(m * 1000)) for i, m in lengths) + span(6, line)) + span(2, camera)


def legacy_size(length: float, width: float, goal_width: float, goal_depth: float, boundary: float = 0.3) -> bytes:
    """Geometry before 2014, metres."""
    given = (0.01, length, width, boundary, 0.4, goal_width, goal_depth, 0.02, 0.5, 0.8, 0.35, 0.2, 0.75, 0.4)
    return span(1, b"".join(integer(i, round(m * 1000)) for i, m in enumerate(given, 1)))


class Team(NamedTuple):
    """A team as the game controller tells it."""

    name: str = ""
    score: int = 0
    red: int = 0
    yellow: int = 0


#: A team of which nothing was reported yet.
UNTOLD = Team()


def _team(team: Team) -> bytes:
    times = varint(60_000_000) * team.yellow
    return (span(1, team.name) + integer(2, team.score) + integer(3, team.red) + span(4, times or None)
            + integer(5, team.yellow) + integer(6, 4) + integer(7, 300_000_000) + integer(8, 0))


def referee(
    stage: int, command: int, counter: int, yellow: Team = UNTOLD, blue: Team = UNTOLD, *, t: float = 0.0,
    blue_on_positive: bool | None = None, source: str | None = None,
) -> bytes:
    """A referee packet, with fields besides that nobody reads."""
    side = None if blue_on_positive is None else int(blue_on_positive)
    return (integer(1, round(t * 1e6)) + integer(2, stage) + integer(3, 600) + integer(4, command)
            + integer(5, counter) + integer(6, round(t * 1e6)) + span(7, _team(yellow)) + span(8, _team(blue))
            + span(9, f32(1, 0.0) + f32(2, -250.0)) + integer(10, side) + integer(15, -5_000_000)
            + span(16, integer(40, 11)) + span(18, source))


class Tracked(NamedTuple):
    """A tracked body: metres, m/s, radians; a ball has no team (1 yellow, 2 blue)."""

    x: float
    y: float
    vx: float | None = None
    vy: float | None = None
    team: int | None = None
    number: int | None = None
    theta: float | None = None
    omega: float | None = None
    visibility: float | None = 1.0


def tracked(
    number: int, t: float, balls: Sequence[Tracked], robots: Sequence[Tracked], *, uuid: str = "u-1",
    name: str | None = "TIGERs", doubles: bool = False,
) -> bytes:
    """A tracker's packet; vectors are of doubles, as before 2021, or of floats."""
    real = f64 if doubles else f32

    def vector(x: float | None, y: float | None, z: float | None = None) -> bytes | None:
        return None if x is None else real(1, x) + real(2, y) + real(3, z)

    frame = integer(1, number) + f64(2, t)
    for ball in balls:
        frame += span(3, span(1, vector(ball.x, ball.y, 0.0)) + span(2, vector(ball.vx, ball.vy, 0.0))
                      + f32(3, ball.visibility))
    for body in robots:
        frame += span(4, span(1, integer(1, body.number) + integer(2, body.team)) + span(2, vector(body.x, body.y))
                      + f32(3, body.theta) + span(4, vector(body.vx, body.vy)) + f32(5, body.omega)
                      + f32(6, body.visibility))
    frame += integer(6, 1) + integer(6, 3)
    return span(1, uuid) + span(2, name) + span(3, frame)


class Message(NamedTuple):
    """A message of a log: when it was received (ns), its type, its content."""

    received: int
    kind: int
    content: bytes


def header(version: int = 1) -> bytes:
    """Header of a log."""
    return b"SSL_LOG_FILE" + struct.pack(">i", version)


def log(messages: Iterable[Message], *, version: int = 1, index: bool = False) -> bytes:
    """A log of messages, with an index at its end if wanted."""
    out, places = bytearray(header(version)), []
    for message in messages:
        places.append(len(out))
        out += struct.pack(">qii", message.received, message.kind, len(message.content)) + message.content
    if index:
        offsets = b"".join(struct.pack(">q", place) for place in places)
        content = offsets + struct.pack(">q", len(offsets) + 8 + 7) + b"INDEXED"
        out += struct.pack(">qii", 0, INDEX, len(content)) + content
    return bytes(out)
