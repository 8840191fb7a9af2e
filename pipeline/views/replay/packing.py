"""The payload of a replay: its binary half, where bodies are and when situations begin and end.

After base64 and inflate (zlib): uint32 little-endian length of the JSON; the JSON in UTF-8 (its keys are
written in :func:`pipeline.views.replay.payload`); then for S samples, B bodies and N situations

======== ===== ================================================================================
what     bytes meaning
======== ===== ================================================================================
time     4 S   ticks since the first sample, of the JSON's ``tick`` milliseconds
joined   S     1 where the sample goes on from the one before without a cut
mask     S B   body by body: SEEN, SUSPECT and HEADED bits
x        2 S B body by body, in quanta of the JSON's ``quantum`` metres
y        2 S B the same
heading  2 S B turns counter-clockwise from +x, in 1 / TURN
kind     2 N   of each situation, body by body and by start, its index in the JSON's ``kinds``
after    4 N   ticks since the end of the body's situation before; of its first, since zero
lasts    4 N   its ticks
strength N     percent, or NO_STRENGTH
follows  N     1 where it follows the one before without a break, as in the table sequences
======== ===== ================================================================================

time is differences along the samples, from zero. Of x, y and heading it is how far a body's step differs
from the one expected, because bodies keep their speed more often than their place: the step before, times the
ratio of the two steps' times, rounded down after a half is added; none where two samples are not joined, or
the two before. Steps and differences are modulo 2 ** 16. A body that is not SEEN repeats its last value.
Numbers of several bytes are zigzagged and stored one byte plane after the other, lowest first, because small
numbers leave planes of zeros that deflate to nothing.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import polars as pl

from pitchlore.pipeline.game.pitch import Pitch
from pitchlore.pipeline.numbers.arrays import F64, I64, U8, Bools
from pitchlore.pipeline.stages.sequences.follows import followed

#: Mask bits: the body has a sample; the sample is an implausible jump; its heading is known.
SEEN, SUSPECT, HEADED = 1, 2, 4

#: Headings are stored in this many steps a turn (0.7 degrees each).
TURN = 512

#: Samples are left out where headings stay this near, radians.
_TURNED = 0.2

#: Positions are stored in steps of the largest of these, metres, that is fine enough.
_QUANTA = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)

#: Nanoseconds in a millisecond.
_MS = 1e6

#: Strength of a situation that has none; others are percent.
NO_STRENGTH = 255


def quantum_of(pitch: Pitch, near: float) -> float:
    """Metres a step of int16, so that bodies up to a pitch length from the centre fit.

    The largest of at most a quarter of ``near``, metres; the smallest that fits without one.
    """
    enough = [step for step in _QUANTA if 32767 * step >= pitch.length]
    return next((step for step in enough if step <= near / 4), enough[-1])


class ShownTracks(NamedTuple):
    """Tracks to show, of S samples and B bodies.

    Attributes:
        ticks: times since the first sample of the match, int64 [S].
        tick: milliseconds.
        joined: where a sample goes on from the one before without a cut, bool [S].
        mask: SEEN, SUSPECT and HEADED bits, uint8 [B, S].
        x, y: metres, float64 [B, S]; an unseen body is where it was seen last, at first in the centre.
        theta: headings, radians, float64 [B, S], likewise.
    """

    ticks: I64
    tick: float
    joined: Bools
    mask: U8
    x: F64
    y: F64
    theta: F64

    def taken(self, kept: Bools) -> ShownTracks:
        """Some of the samples, bool [S]; those left out lie on no cut."""
        return ShownTracks(
            self.ticks[kept], self.tick, self.joined[kept], self.mask[:, kept],
            self.x[:, kept], self.y[:, kept], self.theta[:, kept],
        )

    def near(self, metres: float) -> Bools:
        """Mask of samples to keep: the page's lines between them pass so near all others, bool [S]."""
        from pitchlore.pipeline.views.replay.thinning import thinned  # noqa: PLC0415 (numba, which `replay` does without)

        cut = ~self.joined
        cut[1:] |= (self.mask[:, 1:] != self.mask[:, :-1]).any(axis=0)
        cut[1:] |= np.diff(self.ticks) == 0
        near = np.repeat([metres, metres, _TURNED], len(self.mask))
        places: F64 = np.vstack([self.x, self.y, np.unwrap(self.theta, axis=1)])
        return thinned((self.ticks * self.tick / 1e3).astype(np.float64), places, near, cut)

    def packed(self, quantum: float) -> bytes:
        """Their part of the payload."""
        channels = []
        for values, scale in ((self.x, quantum), (self.y, quantum), (self.theta, 2 * np.pi / TURN)):
            limit = 32767 * scale
            steps = np.rint(np.clip(values, -limit, limit) / scale).astype(np.int64)
            steps = np.diff(steps, axis=1, prepend=0)
            if values is self.theta:  # the short way round
                steps = (steps + TURN // 2) % TURN - TURN // 2
            steps = steps.astype(np.int16).astype(np.int64)
            channels.append(_planes((steps - self._expected(steps)).ravel(), 2))
        time = _planes(np.diff(self.ticks, prepend=0), 4)
        return b"".join([time, self.joined.astype(np.uint8).tobytes(), self.mask.tobytes(), *channels])

    def _expected(self, steps: I64) -> I64:
        """The steps that are expected after those before, int64 [B, S]."""
        expected = np.zeros_like(steps)
        lasts = np.diff(self.ticks)
        on = self.joined[2:] & self.joined[1:-1] & (lasts[:-1] > 0)
        before, now = np.where(on, lasts[:-1], 1), np.where(on, lasts[1:], 0)
        expected[:, 2:] = (2 * steps[:, 1:-1] * now + before) // (2 * before)
        return expected


def samples_of(
    trajectories: pl.DataFrame, bodies: pl.DataFrame, shown: pl.DataFrame, tick: float
) -> ShownTracks:
    """Tracks to show of the trajectories."""
    rows = (
        trajectories.select("frame", "team", "robot", "x", "y", "theta", "suspect")
        .join(bodies, on=["team", "robot"], nulls_equal=True)
        .join(shown.select("frame", "sample"), on="frame")
    )
    cell = (rows["body"].to_numpy(), rows["sample"].to_numpy())
    shape = (len(bodies), len(shown))
    headed = rows["theta"].is_not_null() & rows["theta"].is_not_nan().fill_null(value=False)
    mask = np.zeros(shape, np.uint8)
    mask[cell] = SEEN + SUSPECT * rows["suspect"].to_numpy() + HEADED * headed.to_numpy()
    channels = []
    for name, bit in (("x", SEEN), ("y", SEEN), ("theta", HEADED)):
        values = np.zeros(shape)
        values[cell] = rows[name].fill_null(0.0).fill_nan(0.0).cast(pl.Float64).to_numpy()
        channels.append(_held(values, mask & bit > 0))
    ticks = shown.select(_in_ticks("t_ns", tick)).to_series().to_numpy()
    return ShownTracks(ticks, tick, shown["joined"].to_numpy(), mask, *channels)


class Situated(NamedTuple):
    """Situations of a match.

    Attributes:
        facts: for the JSON: ``kinds``, each a code, a target and a role; ``bodies``, each a body and the
            number of its situations.
        packed: their columns.
    """

    facts: dict[str, Any]
    packed: bytes


def situated(situations: pl.DataFrame, bodies: pl.DataFrame, gap_s: float, tick: float) -> Situated:
    """Situations, packed.

    Args:
        situations: schema Situations, of one match.
        bodies: team, robot and ``body``.
        gap_s: two situations of a robot at least so far apart are not consecutive, seconds.
        tick: milliseconds.
    """
    kind = ("code", "target", "role")
    rows = (
        followed(situations.sort("team", "robot", "start_ns"), gap_s)
        .with_columns(pl.col("team").cast(bodies.schema["team"]), pl.col("role").cast(pl.String))
        .join(bodies, on=["team", "robot"])
        .sort("body", "start_ns")
        .with_columns(
            after=_in_ticks("start_ns", tick) - _in_ticks("end_ns", tick).shift(1).over("body").fill_null(0),
            lasts=_in_ticks("end_ns", tick) - _in_ticks("start_ns", tick),
            strength=(pl.col("strength") * 100).round().fill_null(NO_STRENGTH).cast(pl.UInt8),
        )
    )
    kinds = rows.select(kind).unique().sort(kind).with_row_index("kind")
    rows = rows.join(kinds, on=kind, nulls_equal=True, maintain_order="left")
    columns = (("kind", 2), ("after", 4), ("lasts", 4))
    packed = [_planes(rows[name].cast(pl.Int64).to_numpy(), width) for name, width in columns]
    packed += [rows[name].cast(pl.UInt8).to_numpy().tobytes() for name in ("strength", "follows")]
    counts = rows.group_by("body", maintain_order=True).len()
    return Situated({"kinds": kinds.select(kind).rows(), "bodies": counts.rows()}, b"".join(packed))


def tick_of(frames: pl.Series, situations: pl.DataFrame) -> float:
    """Milliseconds from frame to frame, if all times are within 0.5 ms of whole numbers of them; else 1.

    Args:
        frames: their times, ns since the first sample, increasing.
        situations: schema Situations.
    """
    usual = frames.diff().median()
    if not isinstance(usual, float) or usual < _MS:
        return 1.0
    whole = frames[-1] - frames[0]
    tick = whole / round(whole / usual)
    times = pl.concat([frames, situations["start_ns"], situations["end_ns"]]).to_numpy()
    return tick / _MS if np.abs(times - np.rint(times / tick) * tick).max() <= _MS / 2 else 1.0


def _in_ticks(column: str, tick: float) -> pl.Expr:
    """A column of nanoseconds in whole ticks of so many milliseconds."""
    return (pl.col(column) / (tick * _MS)).round().cast(pl.Int64)


def milliseconds(column: str) -> pl.Expr:
    """A column of nanoseconds in whole milliseconds."""
    return _in_ticks(column, 1.0)


def _held(values: F64, known: Bools) -> F64:
    """``values`` [B, S], the unknown ones replaced by the last known one; zero before the first."""
    last = np.maximum.accumulate(np.where(known, np.arange(values.shape[1]), -1), axis=1)
    return np.where(last >= 0, np.take_along_axis(values, np.maximum(last, 0), axis=1), 0)


def _planes(differences: I64, width: int) -> bytes:
    """Differences [N] modulo 256 ** width, zigzagged, as ``width`` byte planes."""
    signed = differences.astype(f"<i{width}").astype(np.int64)
    zigzag = ((signed << 1) ^ (signed >> 63)).astype(f"<u{width}")
    return zigzag.view(np.uint8).reshape(-1, width).T.tobytes()
