"""How deep bodies are in what surrounds a pitch, frame by frame."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pitchlore.pipeline.arena.physics.walls import walls
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.matches.frame import Frames

F64 = npt.NDArray[np.float64]

#: What nothing is deeper in a wall than, metres (``PhysicsSettings.substeps`` says why it is at all).
BALL_MOST, ROBOT_MOST = 0.016, 0.015


def ball_overlaps(frames: Frames, pitch: Pitch) -> F64:
    """How far the ball reaches into a wall, metres [F]; negative where it is off all of them."""
    radius = SCALES[pitch.kind].ball_radius
    places = np.stack([frames.ball["x"], frames.ball["y"]], axis=-1).astype(float)
    found = np.full(len(places), -np.inf)
    for corners in map(np.array, walls(pitch)):
        edges = np.roll(corners, -1, axis=0) - corners
        along = ((places[:, None] - corners) * edges).sum(-1) / (edges**2).sum(-1)
        nearest = corners + np.clip(along, 0, 1)[..., None] * edges
        off = np.hypot(*np.moveaxis(places[:, None] - nearest, -1, 0)).min(-1)
        found = np.maximum(found, radius + np.where(_depth(places, corners) > 0, off, -off))
    return found


def robot_overlaps(frames: Frames, pitch: Pitch) -> F64:
    """How far each robot's corners are in a wall, or a wall's in the robot, metres [F, robots]."""
    half = SCALES[pitch.kind].robot_radius
    robots = frames.robots.reshape(len(frames), -1)
    x, y, theta = (robots[name].astype(float) for name in ("x", "y", "theta"))
    c, s = np.cos(theta), np.sin(theta)
    own = [np.stack([x + half * (a * c - b * s), y + half * (a * s + b * c)], axis=-1)
           for a in (-1, 1) for b in (-1, 1)]
    found = np.full(x.shape, -np.inf)
    for corners in map(np.array, walls(pitch)):
        for corner in own:
            found = np.maximum(found, _depth(corner, corners))
        for at_x, at_y in corners:
            dx, dy = at_x - x, at_y - y
            found = np.maximum(found, half - np.maximum(np.abs(dx * c + dy * s), np.abs(dy * c - dx * s)))
    return found


def _depth(places: F64, corners: F64) -> F64:
    """How deep places [..., 2] are in a convex polygon with corners counter-clockwise [K, 2]."""
    edges = np.roll(corners, -1, axis=0) - corners
    outward = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.hypot(*edges.T)[:, None]
    deep: F64 = -((places[..., None, :] - corners) * outward).sum(-1).max(-1)
    return deep
