"""Pitch and colours, as the viewers draw them."""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.game.pitch import Pitch

#: Red, green, blue, 0 to 255.
COLOURS: dict[str, tuple[int, int, int]] = {
    "home": (47, 107, 255), "away": (255, 190, 0), "ball": (255, 138, 0), "chalk": (235, 235, 235),
}
#: Radius of the centre circle over the pitch's length: football's 9.15 m of 105 m.
_CIRCLE = 9.15 / 105

Line = list[tuple[float, float]]


def outline(pitch: Pitch) -> list[Line]:
    """The lines of a pitch, each a list of points, metres: edge, halfway line, centre circle, both goals."""
    x, y, post = pitch.length / 2, pitch.width / 2, pitch.goal_width / 2
    turn = np.linspace(0, 2 * np.pi, 49)
    circle = _CIRCLE * pitch.length
    lines: list[Line] = [
        [(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)], [(0.0, -y), (0.0, y)],
        [(float(circle * np.cos(a)), float(circle * np.sin(a))) for a in turn],
    ]
    for side in (-1.0, 1.0):
        back = side * (x + pitch.goal_depth)
        lines.append([(side * x, -post), (back, -post), (back, post), (side * x, post)])
    return lines
