"""Stretches of a recorded match at even times, as each team sees them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from harness import read

from pitchlore.pipeline.base.errors import BadSettings
from pitchlore.pipeline.game.bodies import BALL, COLUMNS, THETA, VX, X
from pitchlore.pipeline.game.pitch import SCALES, Pitch
from pitchlore.pipeline.numbers.arrays import F64, Bools
from pitchlore.pipeline.settings import TrajectorySettings
from pitchlore.pipeline.stages.options.windows import Bodies, bodies, views_of
from pitchlore.pipeline.stages.trajectories.derive import trajectories

#: Samples a second that a stretch is read at. A recording of SSL has some 80, not evenly.
HZ = 60
#: Steps whose slope is a body's velocity: of the past alone, so that nothing is foretold from itself.
STEPS = 3
#: A pause between samples that ends a stretch, s; a body that is seen less than this share is not there.
_PAUSE_S, _SEEN = 0.15, 0.5


class Stretch(NamedTuple):
    """A time without a pause, in play or while play is stopped.

    Attributes:
        play: whether it is play.
        start_s: its first sample, seconds from the first of the recording.
        places: float64 [T, 1 + 2 N, 6] in the pitch frame, home attacks +x, ``HZ`` samples a second. NaN
            where a body is not there; velocities of the first ``STEPS`` samples are NaN, too.
    """

    play: bool
    start_s: float
    places: F64

    @property
    def seconds(self) -> float:
        """Length of the stretch."""
        return len(self.places) / HZ


class Recording(NamedTuple):
    """A match of omnidirectional robots: names of home and away, pitch, stretches in order of time."""

    names: tuple[str, str]
    pitch: Pitch
    stretches: list[Stretch]


def recorded(path: Path) -> Recording:
    """Read a recording.

    Raises:
        BadSettings: if its robots do not drive sideways, or it has no play.
    """
    log = read(path)
    if not SCALES[log.info.pitch.kind].omnidirectional:
        raise BadSettings(
            f"{path.name} is of {log.info.pitch.kind.value}, whose robots do not drive sideways",
            where=str(path), next_step="Give a recording of SSL")
    table, _ = trajectories(log, TrajectorySettings())
    found = stretches(bodies(table, 1 / 1000))
    if not any(each.play for each in found):
        raise BadSettings(f"{path.name} has no play", where=str(path), next_step="Give a recording with play")
    return Recording((log.info.home, log.info.away), log.info.pitch, found)


def stretches(match: Bodies) -> list[Stretch]:
    """The stretches of a match that are long enough for a velocity."""
    seconds = (match.t_ns - match.t_ns[0]) / 1e9
    new = (np.diff(match.segment, prepend=-2) != 0) | (np.diff(seconds, prepend=seconds[0]) > _PAUSE_S)
    found = []
    for first, last in pairwise([*np.flatnonzero(new), len(seconds)]):
        even = np.arange(seconds[first], seconds[last - 1], 1 / HZ)
        if len(even) > STEPS:
            places = _evenly(seconds[first:last], match.places[first:last], even)
            found.append(Stretch(bool(match.segment[first] >= 0), float(even[0]), places))
    return found


def _evenly(seconds: F64, places: F64, even: F64) -> F64:
    """Places at even times, with velocities; float64 [T, 1 + 2 N, 6]."""
    out = np.full((len(even), places.shape[1], COLUMNS), np.nan)
    for row in range(places.shape[1]):
        seen: Bools = np.isfinite(places[:, row, X])
        if seen.mean() < _SEEN:
            continue
        for column in (*range(X, THETA), *([] if row == BALL else [THETA])):
            own = places[seen, row, column]
            out[:, row, column] = np.interp(even, seconds[seen], np.unwrap(own) if column == THETA else own)
    out[:, BALL, THETA] = 0.0
    around = np.arange(STEPS + 1) - STEPS / 2
    slope = around * HZ / np.sum(around**2)
    for t in range(STEPS, len(even)):
        out[t, :, VX:] = np.tensordot(slope, out[t - STEPS:t + 1, :, :VX], axes=1)
    return out


def view_of(stretch: Stretch, team: int) -> F64:
    """Bodies of a stretch as a team sees them, its own goal at -x; float64 [T, 1 + 2 N, 6]."""
    return views_of(stretch.places, team)


def halves(recording: Recording, *, play: bool = True) -> tuple[list[Stretch], list[Stretch]]:
    """Stretches that begin in the first half of the play (or of stopped play), and the later ones."""
    own = [each for each in recording.stretches if each.play == play]
    before = np.cumsum([0.0, *(each.seconds for each in own)])
    earlier = [each for each, past in zip(own, before[:-1], strict=True) if past < before[-1] / 2]
    return earlier, own[len(earlier):]
