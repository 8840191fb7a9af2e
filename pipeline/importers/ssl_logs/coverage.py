"""How much of the pitch a log shows."""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.matches.frame import Frames
from pitchlore.pipeline.matches.quality import Flaw
from pitchlore.pipeline.numbers.arrays import F32

#: Cameras of one half see so much of the other one, as a share of a half.
_BEYOND = 0.2
#: Bodies that stay near the middle line tell nothing: one has to be this far from it.
_REACH = 0.5


def half_a_pitch(frames: Frames, pitch: Pitch) -> list[Flaw]:
    """Flaw of a log in which no body was ever seen on one half of the pitch, along or across; else none.

    Args:
        frames: the samples.
        pitch: the pitch, as the log's geometry or a map says.
    """
    for axis, side in (("x", pitch.length), ("y", pitch.width)):
        ends = [end for part in frames.parts() for bodies in (part.robots, part.ball)
                for end in _ends(bodies[axis])]
        edge = _BEYOND * side / 2
        for sign, more in ((1, ">"), (-1, "<")):
            reached = [end * sign for end in ends]
            if reached and min(reached) > -edge and max(reached) > _REACH * side / 2:
                place = f"{axis} {more} {-sign * edge:g} m"
                note = (f"bodies were only seen at {place}: the cameras show half the pitch. What "
                        "happens on the other half is not in this log")
                start, end = int(frames.t_ns.min()), int(frames.t_ns.max()) + 1
                return [Flaw("half a pitch", note, len(frames), start, end)]
    return []


def _ends(places: F32) -> list[float]:
    """The least and the greatest of some places; none if there are no places."""
    known = places[np.isfinite(places)]
    return [float(known.min()), float(known.max())] if len(known) else []
