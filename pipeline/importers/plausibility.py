"""Plausibility checks of an imported match: signs of a wrong map, flagged and never repaired."""

from __future__ import annotations

import numpy as np

from pitchlore.pipeline.matches.frame import MatchLog
from pitchlore.pipeline.matches.quality import Flaw

#: A robot may stand this far beyond the lines, as a share of the pitch.
MARGIN = 0.15

#: A larger share of positions beyond that margin is a wrong map, not robots that left the pitch.
TOO_MANY = 0.2

#: No match lasts longer, seconds; and with samples as far apart nobody sees who does what, seconds.
LONGEST_S, SLOWEST_S = 86_400.0, 1.0


def plausibility_checks(log: MatchLog) -> list[Flaw]:
    """Flaws of a whole match: no course of play, robots off the pitch, no ball, goals without a scorer."""
    found = _no_course(log)
    frames, pitch = log.frames, log.info.pitch
    outside, farthest = 0, 0.0
    for part in frames.parts():
        x, y = np.abs(part.robots["x"]), np.abs(part.robots["y"])
        outside += int(((x > pitch.length * (0.5 + MARGIN)) | (y > pitch.width * (0.5 + MARGIN))).sum())
        farthest = float(np.fmax.reduce(x, initial=farthest))
    if outside > TOO_MANY * len(frames.robots):
        found.append(Flaw(
            "off the pitch", count=outside,
            note=f"robots up to {farthest:.4g} m from the centre of a pitch of {pitch.length:.4g} m: "
                 "check length, origin and pitch in the map",
        ))
    if len(frames) and np.isnan(frames.ball["x"]).all():
        named = log.info.format == "tracking"  # other formats know their ball without a name
        cure = ("if it is there by another name, say so in a map, [teams] ball; if in columns of each row, "
                "[bodies] ball" if named
                else "no situation with it can be recognised")
        found.append(Flaw("ball lost", f"no ball was seen at all: {cure}", len(frames)))
    unknown = log.referee.filter(log.referee["event"] == "goal")["team"].null_count()
    if unknown:
        found.append(Flaw(
            "scorer unknown", count=unknown,
            note="nothing is learned from these goals" + (
                ": say in a map who scores, [states]" if log.info.format == "tracking" else ""),
        ))
    return found


def _no_course(log: MatchLog) -> list[Flaw]:
    """The flaw of a recording that is no course of play by its times; nothing is learned from it."""
    t_ns = np.sort(log.frames.t_ns)
    if not len(t_ns):
        return []
    lasts = int(t_ns[-1] - t_ns[0]) / 1e9
    steps = np.diff(t_ns)
    step = float(np.median(steps[steps > 0])) / 1e9 if lasts else 0.0
    if not lasts:
        why = "all samples are of one moment"
    elif lasts > LONGEST_S:
        why = f"it lasts {lasts:.4g} s, longer than any match: a clock is wrong, or it is several recordings"
    elif step >= SLOWEST_S:
        why = f"a sample each {step:.4g} s: too few to see who does what"
    else:
        return []
    return [Flaw("implausible", f"{why}. Nothing is learned from it", len(t_ns), 0, int(t_ns[-1]) + 1)]
