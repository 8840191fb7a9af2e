"""The bodies of a match at evenly spaced times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pitchlore.pipeline.game.bodies import THETA
from pitchlore.pipeline.matches.frame import wrap
from pitchlore.pipeline.numbers.arrays import F64, I64
from pitchlore.pipeline.stages.options.windows import Bodies

#: Samples of a recording are rounded to nanoseconds: so near to one, a frame is that sample.
_ROUNDED_NS = 1_000


class EvenFrames(NamedTuple):
    """A stretch of play at evenly spaced times.

    Attributes:
        t_ns: int64 [K], times of frames.
        places: float64 [K, 1 + 2 N, 6] as :class:`pipeline.stages.options.windows.Bodies` has them.
    """

    t_ns: I64
    places: F64


def even_frames(match: Bodies, segment: int, fps: int) -> EvenFrames:
    """The frames of a stretch of play, from its first sample on.

    A frame that falls between two samples is interpolated, headings the short way round. A body that one of
    the two lacks is not seen there, and none is where the two are more than two frames apart.

    Args:
        match: all samples of the match.
        segment: the stretch of play.
        fps: frames a second.
    """
    within = np.flatnonzero(match.segment == segment)
    t_all, places = match.t_ns[within], match.places[within]
    frames = int((t_all[-1] - t_all[0]) * fps // 1_000_000_000) + 1
    t_ns = t_all[0] + np.round(np.arange(frames) * (1e9 / fps)).astype(np.int64)
    t_ns = np.minimum(t_ns, t_all[-1])
    low = np.searchsorted(t_all, t_ns + _ROUNDED_NS, side="right") - 1
    high = np.minimum(low + 1, len(t_all) - 1)
    exact = np.abs(t_ns - t_all[low]) <= _ROUNDED_NS
    high = np.where(exact, low, high)
    gap = t_all[high] - t_all[low]
    share = ((t_ns - t_all[low]) / np.maximum(gap, 1) * ~exact)[:, None, None]
    before, after = places[low], places[high]
    step = after - before
    step[..., THETA] = wrap(step[..., THETA])
    found = before + share * step
    found[..., THETA] = wrap(found[..., THETA])
    found[gap > 2e9 / fps] = np.nan
    return EvenFrames(t_ns, found)
