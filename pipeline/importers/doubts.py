"""What a recording says that can hardly be: signs of a wrong map, flagged and never mended."""

from __future__ import annotations

import numpy as np

from pipeline.matches.frame import MatchLog
from pipeline.matches.quality import Flaw

#: How far beyond the lines a robot may well be, as a share of the pitch.
MARGIN = 0.15

#: The share of positions beyond that which no robot's wandering explains.
TOO_MANY = 0.2


def doubts(log: MatchLog) -> list[Flaw]:
    """Flaws of a whole match: bodies off the pitch, no ball at all, goals that nobody scored.

    Args:
        log: what an importer made.
    """
    found = []
    frames, pitch = log.frames, log.info.pitch
    x, y = np.abs(frames.robots["x"]), np.abs(frames.robots["y"])
    outside = (x > pitch.length * (0.5 + MARGIN)) | (y > pitch.width * (0.5 + MARGIN))
    if len(outside) and outside.mean() > TOO_MANY:
        found.append(Flaw(
            "off the pitch", count=int(outside.sum()),
            note=f"robots up to {np.nanmax(x):.4g} m from the centre of a pitch of {pitch.length:.4g} m: "
                 "check length, origin and pitch in the map",
        ))
    if len(frames) and np.isnan(frames.ball["x"]).all():
        found.append(Flaw(
            "ball lost", count=len(frames),
            note="no ball was seen at all: say in a map what it is called, [teams] ball",
        ))
    unknown = log.referee.filter(log.referee["event"] == "goal")["team"].null_count()
    if unknown:
        found.append(Flaw(
            "scorer unknown", count=unknown,
            note="nothing is learned from these goals: say in a map who scores, [states]",
        ))
    return found
