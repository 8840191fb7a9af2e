"""Pitch and colours, as the viewers draw them."""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.game.pitch import MARKINGS, Pitch

#: Red, green, blue, 0 to 255.
COLOURS: dict[str, tuple[int, int, int]] = {
    "home": (47, 107, 255), "away": (255, 190, 0), "ball": (255, 138, 0), "chalk": (235, 235, 235),
}

Line = list[tuple[float, float]]


def outline(pitch: Pitch) -> list[Line]:
    """The lines of a pitch, each a list of points, metres: edge, halfway line, circle, areas, goals."""
    x, y, post = pitch.length / 2, pitch.width / 2, pitch.goal_width / 2
    turn = np.linspace(0, 2 * np.pi, 49)
    circle, areas, *_ = MARKINGS[pitch.kind]
    lines: list[Line] = [
        [(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)], [(0.0, -y), (0.0, y)],
        [(float(circle * np.cos(a)), float(circle * np.sin(a))) for a in turn],
    ]
    for side in (-1.0, 1.0):
        back = side * (x + pitch.goal_depth)
        lines.append([(side * x, -post), (back, -post), (back, post), (side * x, post)])
        for deep, wide in areas:
            edge = side * (x - deep)
            lines.append([(side * x, -wide / 2), (edge, -wide / 2), (edge, wide / 2), (side * x, wide / 2)])
    return lines
