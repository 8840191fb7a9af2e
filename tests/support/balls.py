"""Balls that move by hand."""

import numpy as np

from pitchlore.pipeline.importers.tracking.ball_restarts import Ball

HZ = 60


def way(
    *points: tuple[float, float, float], lost: tuple[float, float] = (9e9, 9e9), line_ups: tuple[float, ...] = ()
) -> Ball:
    """A ball that moves straight from point to point (t, x, y); two points of one time are a jump.

    It is not seen while ``lost``. The robots are put elsewhere at ``line_ups``.
    """
    t, x, y = np.array(points).T
    t = t + np.arange(len(t)) * 1e-9
    at = np.arange(t[0], t[-1], 1 / HZ)
    at = at[(at < lost[0]) | (at > lost[1])]
    counts = np.searchsorted(np.array(line_ups), at - 1e-6).astype(np.int64)
    return Ball(np.round(at * 1e9).astype(np.int64), np.interp(at, t, x), np.interp(at, t, y),
                np.zeros(len(at), bool), counts)


def put(t: float, x: float, y: float, lies: float = 2.0) -> tuple[tuple[float, float, float], ...]:
    """The ball put to a place, where it lies for two seconds."""
    return (t, x, y), (t + lies, x, y)
