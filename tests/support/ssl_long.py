"""Long SSL logs for benchmarks: cameras that overlap, bodies that move, written by columns.

Every robot of a real log has the same fields, so that a packet is a slice of a table of bytes.
"""

import struct
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from support.ssl_games import EPOCH
from support.ssl_messages import VISION_2014, f64, header, integer, size, span, varint

HZ = 75
LENGTH, WIDTH = 12.0, 9.0
#: What cameras see beyond the middle lines of the pitch, metres.
_OVERLAP = 0.5
_GEOMETRY = span(2, size(LENGTH, WIDTH, 1.8, 0.18))

_BODY = [("confidence_tag", "u1"), ("confidence", "<f4")]
_PIXELS = [("pixel_x_tag", "u1"), ("pixel_x", "<f4"), ("pixel_y_tag", "u1"), ("pixel_y", "<f4")]
#: A robot as the league's software writes it, with the tag and length of the field that holds it.
_ROBOT = np.dtype([
    ("tag", "u1"), ("length", "u1"), *_BODY, ("id_tag", "u1"), ("id", "u1"), ("x_tag", "u1"), ("x", "<f4"),
    ("y_tag", "u1"), ("y", "<f4"), ("theta_tag", "u1"), ("theta", "<f4"), *_PIXELS, ("height_tag", "u1"), ("height", "<f4"),
])
_ROBOT_TAGS = {"confidence_tag": 0x0D, "id_tag": 0x10, "x_tag": 0x1D, "y_tag": 0x25, "theta_tag": 0x2D,
               "pixel_x_tag": 0x35, "pixel_y_tag": 0x3D, "height_tag": 0x45}
_BALL = np.dtype([
    ("tag", "u1"), ("length", "u1"), *_BODY, ("area_tag", "u1"), ("area", "u1"), ("x_tag", "u1"), ("x", "<f4"),
    ("y_tag", "u1"), ("y", "<f4"), *_PIXELS,
])
_BALL_TAGS = {"confidence_tag": 0x0D, "area_tag": 0x10, "x_tag": 0x1D, "y_tag": 0x25, "pixel_x_tag": 0x35, "pixel_y_tag": 0x3D}


def _table(dtype: np.dtype[np.void], tags: dict[str, int], shape: tuple[int, ...]) -> npt.NDArray[np.void]:
    """Messages of one kind, all with their tags."""
    table = np.zeros(shape, dtype)
    for name, tag in tags.items():
        table[name] = tag
    table["length"] = dtype.itemsize - 2
    table["confidence"] = 0.9
    return table


def long_log(seconds: float, *, cameras: int = 4, robots: int = 11, first: int = 0) -> Iterator[bytes]:
    """A log of so many seconds at ``HZ``, in pieces; two or four cameras, ``robots`` a side, a ball, geometry every 3 s.

    Bodies go round in ellipses; each detection has a noise of 2 mm.
    """
    yield header()
    for begin in range(first, round(seconds * HZ), HZ):
        yield b"".join(_second(begin, min(begin + HZ, round(seconds * HZ)), cameras, robots))


def _second(begin: int, end: int, cameras: int, robots: int) -> Iterator[bytes]:
    frames = np.arange(begin, end)
    rng = np.random.default_rng(begin)
    body = np.arange(2 * robots + 1)
    angle = frames[:, None] / HZ * (0.3 + 0.02 * body) + body
    place = np.stack([np.cos(angle) * LENGTH / 2 * (0.3 + 0.3 * np.sin(body)), np.sin(angle) * WIDTH / 2 * (0.3 + 0.3 * np.cos(body))], -1)
    shape = (cameras, *place.shape)
    noisy = 1000 * place + rng.normal(0, 2, shape)
    table = _table(_ROBOT, _ROBOT_TAGS, (cameras, len(frames), 2 * robots))
    table["tag"][..., :robots], table["tag"][..., robots:] = 6 << 3 | 2, 7 << 3 | 2
    table["id"] = np.tile(np.arange(robots), 2)
    table["theta"] = np.angle(np.exp(1j * angle[:, 1:]))
    table["x"], table["y"] = noisy[..., 1:, 0], noisy[..., 1:, 1]
    balls = _table(_BALL, _BALL_TAGS, (cameras, len(frames)))
    balls["tag"], balls["area"] = 5 << 3 | 2, 80
    balls["x"], balls["y"] = noisy[..., 0, 0], noisy[..., 0, 1]
    sides = [(sx, sy) for sx in (-1, 1) for sy in ((-1, 1) if cameras > 2 else (0,))]
    for f, frame in enumerate(frames.tolist()):
        for camera, (sx, sy) in enumerate(sides):
            captured = EPOCH + frame / HZ + camera * 0.001
            seen = (place[f, :, 0] * sx >= -_OVERLAP) & (place[f, :, 1] * sy >= -_OVERLAP)
            content = integer(1, frame) + f64(2, captured) + f64(3, captured + 0.004) + integer(4, camera)
            content += balls[camera, f].tobytes() if seen[0] else b""
            content += table[camera, f][seen[1:]].tobytes()
            packet = b"\x0a" + varint(len(content)) + content
            if frame % (3 * HZ) == 0:
                packet += _GEOMETRY
            yield struct.pack(">qii", round((captured + 0.006) * 1e9), VISION_2014, len(packet)) + packet
