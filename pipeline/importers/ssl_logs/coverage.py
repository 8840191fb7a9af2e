"""How much of the pitch a log shows."""

from __future__ import annotations

import numpy as np

from pipeline.matches.frame import Frames
from pipeline.matches.quality import Flaw
from pipeline.pitch import Pitch

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
        seen = np.concatenate((frames.robots[axis], frames.ball[axis]))
        seen = seen[np.isfinite(seen)]
        edge = _BEYOND * side / 2
        for sign, more in ((1, ">"), (-1, "<")):
            if len(seen) and (seen * sign).min() > -edge and (seen * sign).max() > _REACH * side / 2:
                place = f"{axis} {more} {-sign * edge:g} m"
                note = (f"bodies were only seen at {place}: the cameras show half the pitch. What "
                        "happens on the other half is not in this log")
                start, end = int(frames.t_ns.min()), int(frames.t_ns.max()) + 1
                return [Flaw("half a pitch", note, len(frames), start, end)]
    return []
