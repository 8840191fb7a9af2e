"""Long SSL logs: four cameras that overlap, and bodies that move; what is seen of them in a second is written once."""

from collections.abc import Iterable

import numpy as np
from support import ssl_messages as ssl
from support.ssl_games import EPOCH

HZ = 75
LENGTH, WIDTH = 12.0, 9.0
#: What cameras see beyond the middle lines of the pitch, metres.
_OVERLAP = 0.5
_GEOMETRY = ssl.span(2, ssl.size(LENGTH, WIDTH, 1.8, 0.18))


def long_log(seconds: float, *, robots: int = 11) -> bytes:
    """A log of so many seconds at ``HZ``: ``robots`` a side, a ball, geometry every 3 s.

    Bodies go a second forth and a second back on ellipses; each detection has a noise of 2 mm.
    """
    seen = [list(_seen(frame, robots)) for frame in range(HZ)]
    messages = []
    for frame in range(round(seconds * HZ)):
        for camera, bodies in enumerate(seen[min(frame % (2 * HZ), -(frame + 1) % (2 * HZ))]):
            t = EPOCH + frame / HZ + camera * 0.001
            content = ssl.span(1, ssl.integer(1, frame) + ssl.f64(2, t) + ssl.f64(3, t + 0.004) + ssl.integer(4, camera) + bodies)
            content += _GEOMETRY * (frame % (3 * HZ) == 0)
            messages.append(ssl.Message(round((t + 0.006) * 1e9), ssl.VISION_2014, content))
    return ssl.log(messages)


def _seen(frame: int, robots: int) -> Iterable[bytes]:
    """Packets of all cameras, each with what it sees."""
    rng, body = np.random.default_rng(frame), np.arange(2 * robots + 1)
    angle = frame / HZ * (0.3 + 0.02 * body) + body
    x, y = np.cos(angle) * LENGTH / 2 * (0.3 + 0.3 * np.sin(body)), np.sin(angle) * WIDTH / 2 * (0.3 + 0.3 * np.cos(body))
    for far in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        out = b""
        for i in np.flatnonzero((x * far[0] >= -_OVERLAP) & (y * far[1] >= -_OVERLAP)).tolist():
            place = x[i] + rng.normal(0, 0.002), y[i] + rng.normal(0, 0.002)
            if i == 0:
                out += ssl.span(5, ssl.detected_ball(ssl.Seen(*place)))
            else:
                team, number = divmod(i - 1, robots)
                out += ssl.span(6 + team, ssl.detected_robot(ssl.Seen(*place, number, np.angle(np.exp(1j * angle[i])))))
        yield out
